#include "true_share.h"

#include "coord_ranges.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace vdbfrac::tetmesh {

namespace {

constexpr int kParts = 4;  // along an edge: second order, 16 times better than the cut

/// Volume fraction where a linear phi is below 0; at least one value is, and one is above.
double linearShare(std::array<double, 4> phi)
{
    std::sort(phi.begin(), phi.end());
    const auto along = [&](std::size_t in, std::size_t out) { return phi[in] / (phi[in] - phi[out]); };
    if (!(phi[1] < 0)) return along(0, 1) * along(0, 2) * along(0, 3);
    if (phi[2] < 0) return 1 - (1 - along(0, 3)) * (1 - along(1, 3)) * (1 - along(2, 3));
    const double ac = along(0, 2), ad = along(0, 3), bc = along(1, 2), bd = along(1, 3);
    return bc * bd + ac * (1 - bc) * bd + ac * ad * (1 - bd);
}

}  // namespace

/// The Kuhn tets of a grid with `parts` cells along an edge that lie in the tet 1 >= x >= y >= z >= 0.
DividedTet divideTet(int parts)
{
    DividedTet divided;
    std::map<std::array<int, 3>, std::uint16_t> number;
    const auto add = [&](const std::array<int, 3>& p) {
        const auto [at, isNew] = number.emplace(p, std::uint16_t(divided.points.size()));
        const auto part = [&](int i) { return double(i) / parts; };
        if (isNew) divided.points.push_back({part(parts - p[0]), part(p[0] - p[1]), part(p[1] - p[2]), part(p[2])});
        return at->second;
    };
    forBox({0, 0, 0}, {parts - 1, parts - 1, parts - 1}, [&](Coord c) {
        std::array<std::size_t, 3> axis = {0, 1, 2};
        do {
            std::array<std::array<int, 3>, 4> p;
            p.fill({c.x, c.y, c.z});
            for (std::size_t k = 1; k < 4; ++k) p[k] = p[k - 1], ++p[k][axis[k - 1]];
            const auto isInside = [](const auto& q) { return q[0] >= q[1] && q[1] >= q[2]; };
            if (std::all_of(p.begin(), p.end(), isInside))
                divided.tets.push_back({add(p[0]), add(p[1]), add(p[2]), add(p[3])});
        } while (std::next_permutation(axis.begin(), axis.end()));
    });
    return divided;
}

namespace {

/// The tet as it is divided along each of the three diagonals of its middle: the same whatever the order of its
/// vertices, so that a tet and its mirror image hold the same.
DividedTet divideAlike(int parts)
{
    DividedTet divided = divideTet(parts);
    const auto& points = divided.points;
    const std::size_t count = divided.tets.size();
    for (const auto& order : {std::array<std::size_t, 4>{0, 1, 3, 2}, {0, 2, 1, 3}}) {
        std::vector<std::uint16_t> image;
        for (const auto& p : points) {
            const std::array<double, 4> moved{p[order[0]], p[order[1]], p[order[2]], p[order[3]]};
            image.push_back(std::uint16_t(std::find(points.begin(), points.end(), moved) - points.begin()));
        }
        for (std::size_t t = 0; t < count; ++t) {
            const auto [a, b, c, d] = divided.tets[t];
            divided.tets.push_back({image[a], image[b], image[c], image[d]});
        }
    }
    return divided;
}

}  // namespace

TrueShare::TrueShare(const RestShape& shape, double voxelSize)
    : shape_(shape), dx_(voxelSize), parts_(divideAlike(kParts)), X_(parts_.points.size()), phi_(parts_.points.size())
{
    for (std::size_t p = 0; p < parts_.points.size(); ++p)
        for (std::size_t a = 0; a < 4; ++a)
            if (parts_.points[p][a] == 1) corners_[a] = std::uint16_t(p);
}

double TrueShare::of(const std::array<Vec3, 4>& X)
{
    for (std::size_t p = 0; p < X_.size(); ++p) {
        const auto& b = parts_.points[p];
        X_[p] = b[0] * X[0] + b[1] * X[1] + b[2] * X[2] + b[3] * X[3];
    }
    shape_(X_, phi_);
    for (double& phi : phi_)
        if (std::abs(phi) < kSnap * dx_) phi = 0;
    if (isLinear()) return ofPart(corners_);
    double sum = 0;
    for (const auto& part : parts_.tets) sum += ofPart(part);
    return sum / double(parts_.tets.size());
}

/// Most of a surface is flat: the linear cut is true there, and costs less.
bool TrueShare::isLinear() const
{
    for (std::size_t p = 0; p < phi_.size(); ++p) {
        double linear = 0;
        for (std::size_t a = 0; a < 4; ++a) linear += parts_.points[p][a] * phi_[corners_[a]];
        if (std::abs(phi_[p] - linear) > kSnap * dx_) return false;
    }
    return true;
}

std::uint8_t TrueShare::faces() const
{
    unsigned faces = 0;
    for (std::size_t p = 0; p < phi_.size(); ++p)
        for (std::size_t a = 0; a < 4; ++a)
            if (phi_[p] < 0 && parts_.points[p][a] == 0) faces |= 1u << a;
    return std::uint8_t(faces);
}

double TrueShare::ofPart(const std::array<std::uint16_t, 4>& part) const
{
    const std::array<double, 4> phi{phi_[part[0]], phi_[part[1]], phi_[part[2]], phi_[part[3]]};
    const auto [low, high] = std::minmax_element(phi.begin(), phi.end());
    if (*low < 0) return *high > 0 ? linearShare(phi) : 1;
    if (*high > 0) return 0;
    // Along edges and corners of a body on voxel planes all vertices of a part are on the surface.
    const Vec3 center = (X_[part[0]] + X_[part[1]] + X_[part[2]] + X_[part[3]]) / 4;
    double inside = 0;
    shape_({&center, 1}, {&inside, 1});
    return inside < 0 ? 1 : 0;
}

double correction(double share, double linear)
{
    constexpr double kSame = 1e-4;    // flat faces: phi is a float
    constexpr double kSmallest = .1;  // of what is left of a tet that has a vertex inside
    const double factor = share / linear;
    return std::abs(factor - 1) < kSame ? 1. : std::max(factor, kSmallest);
}

void scale(TetCut& cut, double factor)
{
    const double bounded = std::min(factor, 1 / cut.fraction);
    cut.fraction = std::min(1., bounded * cut.fraction);
    for (double& m : cut.moment) m *= bounded;
}

TetCut wholeCut(double fraction)
{
    TetCut cut;
    cut.fraction = fraction;
    cut.moment.fill(fraction / 4);
    return cut;
}

}  // namespace vdbfrac::tetmesh
