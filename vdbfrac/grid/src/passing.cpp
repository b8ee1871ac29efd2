#include "passing.h"

#include <cmath>

namespace vdbfrac::grid {

namespace {

/// Mean way from a voxel node to points near by.
class MeanWay {
public:
    void add(double weight, const Vec3& way) { sum_ += weight * way, weights_ += weight; }
    bool isKnown() const { return weights_ > 0; }
    Vec3 operator()() const { return sum_ / weights_; }

private:
    Vec3 sum_ = Vec3::Zero();
    double weights_ = 0;
};

MeanWay toPath(Coord voxel, const CrackPath& path, const std::vector<Neighbour>& near)
{
    MeanWay mean;
    for (const Neighbour& n : near)
        if (const auto point = path.at(voxel + n.offset)) mean.add(n.weight, *point - voxel.toVec());
    return mean;
}

MeanWay toStart(Coord voxel, const Sparse& R, const std::vector<Neighbour>& near)
{
    // As good as the node with the largest, but between nodes where several are as large.
    constexpr double kSharp = 8;
    MeanWay mean;
    const double largest = R.largestNear(voxel, near);
    if (largest <= 0) return mean;
    mean.add(std::pow(R(voxel) / largest, kSharp), Vec3::Zero());
    for (const Neighbour& n : near)
        mean.add(n.weight * std::pow(R(voxel + n.offset) / largest, kSharp), n.offset.toVec());
    return mean;
}

}  // namespace

Passing passingAt(Coord voxel, const Vec3& normal, const CrackPath& path, const Sparse& R,
                  const std::vector<Neighbour>& near)
{
    // What a voxel off the way takes. Of .2 to .5, .3 is best in turned plates, shear and halves at 10 and 20 cells.
    constexpr double kOff = .3;
    MeanWay mean = toPath(voxel, path, near);
    if (!mean.isKnown()) mean = toStart(voxel, R, near);
    if (!mean.isKnown()) return {voxel.toVec()};
    const double off = -mean().dot(normal), square = std::min(1., off * off);
    // What is farther off than a voxel belongs to another way: the crack has turned.
    return {std::abs(off) <= 1 ? Vec3(voxel.toVec() - off * normal) : voxel.toVec(), 1 - kOff * square};
}

}  // namespace vdbfrac::grid
