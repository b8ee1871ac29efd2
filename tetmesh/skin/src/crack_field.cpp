#include <vdbfrac/skin/crack_field.h>

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

namespace vdbfrac::skin {

namespace {

using Field = tetmesh::NodeField<float>;

constexpr double kFar = 3;        // voxels: nothing is known of cracks that are farther
constexpr double kRaised = 0.25;  // voxels: by less, re-levelling may have moved what did not tear
constexpr double kNear = 1.5;     // voxels from a crack that its surface may need the values of
constexpr int kReach = 3;         // voxels over which known values are carried on

/// Calls visit(offset) for the nodes of a cube round one.
template <class Visit>
void forOffsets(int reach, const Visit& visit)
{
    for (int z = -reach; z <= reach; ++z)
        for (int y = -reach; y <= reach; ++y)
            for (int x = -reach; x <= reach; ++x) visit(Coord{x, y, z});
}

class Extension {
public:
    Extension(const Field& rest, const Field& now, double dx)
        : rest_(rest), now_(now), dx_(dx), c_(rest.lower(), rest.upper(), float(-kFar * dx), float(-kFar * dx))
    {
    }

    Field run()
    {
        const std::vector<Coord> known = raisedNodes();
        for (Coord n : known) c_.set(n, now_(n));
        carryInside(known);
        carryOutside();
        smooth();
        return std::move(c_);
    }

private:
    bool isInside(Coord n) const { return rest_(n) < 0; }
    bool isRaised(Coord n) const { return isInside(n) && now_(n) > rest_(n) + kRaised * dx_; }

    /// The nodes inside, at rest, whose phi a crack has raised.
    std::vector<Coord> raisedNodes() const
    {
        std::vector<Coord> blocks;
        now_.forEachBlock([&](Coord low) { blocks.push_back(low); });
        std::vector<std::vector<Coord>> found(blocks.size());
        parallelChunks(blocks.size(), 1, [&](std::size_t begin, std::size_t) {
            Field::forEachNode(blocks[begin], [&](Coord n) {
                if (isRaised(n)) found[begin].push_back(n);
            });
        });
        std::vector<Coord> all;
        for (const auto& some : found) all.insert(all.end(), some.begin(), some.end());
        return all;
    }

    /// Nodes round those near a crack for which `wanted` holds, sorted.
    template <class Wanted>
    std::vector<Coord> nodesRound(std::span<const Coord> nodes, int reach, const Wanted& wanted) const
    {
        std::vector<Coord> round;
        for (Coord n : nodes)
            if (c_(n) > -kNear * dx_)
                forOffsets(reach, [&](Coord d) {
                    if (c_.contains(n + d) && wanted(n + d)) round.push_back(n + d);
                });
        std::sort(round.begin(), round.end());
        round.erase(std::unique(round.begin(), round.end()), round.end());
        return round;
    }

    /// Inside, where phi is as it was: midway between the least and the greatest function through the known values
    /// that changes no faster than distances do, and no more than phi.
    void carryInside(const std::vector<Coord>& known)
    {
        near_ = nodesRound(known, 2, [&](Coord n) { return isInside(n) && !isRaised(n); });
        std::vector<float> value(near_.size());
        parallelChunks(near_.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) value[i] = float(between(near_[i]));
        });
        for (std::size_t i = 0; i < near_.size(); ++i) c_.set(near_[i], value[i]);
        near_.insert(near_.end(), known.begin(), known.end());
    }
    double between(Coord n) const
    {
        double low = -kFar * dx_, high = kFar * dx_;
        forOffsets(kReach, [&](Coord d) {
            if (!isRaised(n + d)) return;
            const double value = now_(n + d), distance = dx_ * d.toVec().norm();
            low = std::max(low, value - distance), high = std::min(high, value + distance);
        });
        const double middle = 0.5 * (low + high);
        return now_(n) < 0 ? std::min<double>(middle, now_(n)) : middle;
    }

    /// Outside, the value one voxel below the closest point of the skin.
    void carryOutside()
    {
        constexpr double kBeyond = 2.5;  // voxels: outer surfaces of any make stay within
        const std::vector<Coord> outside =
            nodesRound(near_, kReach, [&](Coord n) { return !isInside(n) && rest_(n) < kBeyond * dx_; });
        std::vector<float> value(outside.size());
        parallelChunks(outside.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const Coord n = outside[i];
                const std::optional<Vec3> up = uphill(n);
                value[i] = up ? float(at(n.toVec() - (rest_(n) / dx_ + 1) * *up)) : c_(n);
            }
        });
        for (std::size_t i = 0; i < outside.size(); ++i) c_.set(outside[i], value[i]);
        near_.insert(near_.end(), outside.begin(), outside.end());
    }
    /// Direction in which phi rises at rest.
    std::optional<Vec3> uphill(Coord n) const
    {
        const auto slope = [&](Coord d) { return double(rest_(n + d)) - double(rest_(n - d)); };
        const Vec3 g(slope({1, 0, 0}), slope({0, 1, 0}), slope({0, 0, 1}));
        const double length = g.norm();
        if (!(length > 0)) return std::nullopt;
        return g / length;
    }
    /// c between the nodes, trilinear; X in voxels.
    double at(const Vec3& X) const
    {
        const Vec3 low = X.array().floor();
        const Coord base{int(low.x()), int(low.y()), int(low.z())};
        const Vec3 f = X - low;
        double sum = 0;
        for (int k = 0; k < 8; ++k) {
            const Coord d{k & 1, k >> 1 & 1, k >> 2};
            const double w = (d.x ? f.x() : 1 - f.x()) * (d.y ? f.y() : 1 - f.y()) * (d.z ? f.z() : 1 - f.z());
            if (w > 0) sum += w * c_(base + d);
        }
        return sum;
    }

    /// Half of each value, and half the mean of its neighbours: takes off what is left of the voxels.
    void smooth()
    {
        std::sort(near_.begin(), near_.end());
        near_.erase(std::unique(near_.begin(), near_.end()), near_.end());
        std::vector<float> value(near_.size());
        parallelChunks(near_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) value[i] = float(settled(near_[i]));
        });
        for (std::size_t i = 0; i < near_.size(); ++i) c_.set(near_[i], value[i]);
    }
    double settled(Coord n) const
    {
        constexpr Coord kAxes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        double sum = 0;
        for (Coord d : kAxes) sum += double(c_(n + d)) + double(c_(n - d));
        const double before = c_(n), smooth = 0.5 * before + sum / 12;
        const double least = kLeast * dx_;
        if (isInside(n) && now_(n) < 0) return std::min(smooth < 0 ? smooth : before, -least);
        if (isRaised(n)) return std::max(smooth > 0 ? smooth : before, least);
        return smooth < 0 ? std::min(smooth, -least) : std::max(smooth, least);
    }

    const Field &rest_, &now_;
    double dx_;
    Field c_;
    std::vector<Coord> near_;  // nodes that were given a value
};

}  // namespace

Field crackField(const Field& rest, const Field& now, double dx) { return Extension(rest, now, dx).run(); }

}  // namespace vdbfrac::skin
