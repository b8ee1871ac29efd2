#include "lips.h"

#include "cut_pieces.h"
#include "fairing.h"
#include "redivide.h"
#include "slider.h"

#include <vdbfrac/skin/opposite.h>

#include <vdbfrac/base/by_voxel.h>
#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/nearest_triangle.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace vdbfrac::skin {

namespace {

constexpr double kFarthest = 1.5;  // voxels that a lip moves: more is no gap that a crack has made

/// The triangles of the outer surface in and beside cracks, by voxel.
class SkinNearCracks {
public:
    SkinNearCracks(const SkinTopology& skin, const CrackLattice& lattice) : skin_(skin), dx_(lattice.voxelSize())
    {
        for (std::uint32_t t = 0; t < skin.triangles.size(); ++t)
            forVoxels(skin, t, lattice, [&](Coord voxel) {
                if (lattice.isMixed(voxel) || lattice.isOpen(voxel)) byVoxel_.add(voxel, t);
            });
        byVoxel_.sort();
    }

    /// How deep X lies below the surface [m], up to `most`; 0 outside of it.
    double depth(const Vec3& X, double most) const
    {
        const NearestTriangle skin = closest(X);
        if (!skin.isSeen()) return most;
        return skin.isOutside() ? 0 : std::min(most, (X - skin.at()).norm());
    }
    /// X, or a point near to it that is no less deep than this [m].
    Vec3 inside(const Vec3& X, double depth) const
    {
        const NearestTriangle skin = closest(X);
        if (!skin.isSeen() || (!skin.isOutside() && (X - skin.at()).norm() >= depth)) return X;
        return skin.at() - depth * skin.normal();
    }

private:
    /// Of the surface, if it is near.
    NearestTriangle closest(const Vec3& X) const
    {
        NearestTriangle nearest(X, std::numeric_limits<double>::infinity());
        const Coord middle = tetmesh::floorOf(X / dx_), one{1, 1, 1};
        byVoxel_.visit(middle - one, middle + one, [&](std::uint32_t t) {
            const auto corners = skin_.corners(t);
            nearest.see(corners, triangleBox(corners), skin_.normal[t]);
        });
        return nearest;
    }
    const SkinTopology& skin_;
    double dx_;
    ByVoxel byVoxel_;
};

/// Half the way from a lip to the one opposite; none where nothing is opposite.
std::optional<Vec3> halfWay(const CrackLattice& lattice, const Vec3& X)
{
    constexpr double kStep = 0.1, kLip = 0.6;  // voxels: of the search, and until it must have left the lip
    constexpr double kOpposite = -0.3;         // cosine between the directions in which two lips look
    const double dx = lattice.voxelSize();
    const auto outwards = [&](const Vec3& at) {
        Vec3 slope;
        for (int k = 0; k < 3; ++k)
            slope[k] = lattice.smoothC(at + 0.5 * dx * Vec3::Unit(k)) - lattice.smoothC(at - 0.5 * dx * Vec3::Unit(k));
        return Vec3(slope.stableNormalized());
    };
    const Vec3 out = outwards(X);
    bool entered = false;
    double before = 0;
    for (double s = kStep; s <= 2 * kFarthest; s += kStep) {
        const double c = lattice.smoothC(X + s * dx * out);
        if (entered && !(c > 0)) {
            if (outwards(X + s * dx * out).dot(out) > kOpposite) return std::nullopt;
            return 0.5 * (s - kStep * c / (c - before)) * dx * out;
        }
        entered = entered || c > 0;
        before = c;
        if (!entered && s > kLip) return std::nullopt;
    }
    return std::nullopt;
}

/// Each way becomes the mean of it and of those round it; points without one take that of their neighbours.
std::vector<std::optional<Vec3>> evened(const std::vector<std::optional<Vec3>>& way, const Groups& neighbours)
{
    std::vector<std::optional<Vec3>> result(way.size());
    parallelChunks(way.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Vec3 sum = Vec3::Zero();
            int count = 0;
            for (const std::uint32_t next : neighbours[i])
                if (const auto& other = way[next]) sum += *other, ++count;
            if (count == 0)
                result[i] = way[i];
            else
                result[i] = way[i] ? 0.5 * (*way[i] + sum / count) : Vec3(sum / count);
        }
    });
    return result;
}

/// How far each point is made fair, from 0 to 1: closed pieces as long as what is evened out would shrink to nothing.
std::vector<double> fairness(const SkinTopology& skin, double dx, const SkinCut& cut)
{
    constexpr double kNot = 2, kWholly = 4;  // voxels: size of pieces
    const CutPieces pieces(skin, cut, kWholly * dx);
    std::vector<double> share(cut.points.size(), 1);
    for (std::size_t i = 0; i < share.size(); ++i)
        if (const std::uint32_t piece = pieces.ofCutPoint(i); pieces.isSmall(piece))
            share[i] = std::max(0., (pieces.size(piece) / dx - kNot) / (kWholly - kNot));
    return share;
}

/// Moves points of torn faces and rims to the middle between them and the lip opposite, as each lip has been made fair
/// by itself: rims, which are seen before the crack opens, until they lie on each other.
void meet(const SkinTopology& skin, double dx, SkinCut& cut)
{
    constexpr int kRounds = 4;
    const auto first = std::uint32_t(skin.pointOf.size());
    std::vector<std::array<std::uint32_t, 3>> torn;
    for (const auto& [a, b, c] : cut.torn) torn.push_back({a - first, b - first, c - first});
    const Slider slider(skin);
    std::vector<Vec3> X, normal;
    for (const SkinCut::Point& point : cut.points) {
        X.push_back(point.X);
        normal.push_back(slider.normalAt(point));
    }
    const auto goHalfWay = [&](const std::vector<Opposite>& lips) {
        std::vector<Vec3> middle(lips.size());
        parallelChunks(lips.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const std::uint32_t p = lips[i].point;
                middle[i] = 0.5 * (X[p] + lips[i].at(X));
                if (cut.points[p].skin != SkinCut::kNoSkin)
                    middle[i] = slider.closest(cut.points[p], middle[i], cut.points[p].on);
            }
        });
        for (std::size_t i = 0; i < lips.size(); ++i) X[lips[i].point] = middle[i];
    };
    goHalfWay(oppositeFaces(X, torn, normal, dx));
    for (int round = 0; round < kRounds; ++round) goHalfWay(oppositeRims(X, torn, normal, dx));
    for (std::size_t i = 0; i < X.size(); ++i) cut.points[i].X = X[i];
}

}  // namespace

void closeLips(const SkinTopology& skin, const CrackLattice& lattice, SkinCut& cut)
{
    constexpr int kRounds = 3, kUnfolded = 20;
    constexpr double kDepth = 0.1;  // voxels: what lies under the outer surface stays under it
    const SkinNearCracks near(skin, lattice);
    std::vector<std::optional<Vec3>> way(cut.points.size());
    std::vector<double> depth(cut.points.size());  // of those that are not on the outer surface
    parallelChunks(way.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            way[i] = halfWay(lattice, cut.points[i].X);
            if (cut.points[i].skin != SkinCut::kNoSkin) continue;
            depth[i] = near.depth(cut.points[i].X, kDepth * lattice.voxelSize());
        }
    });
    const Groups neighbours = neighboursOf(cut, std::uint32_t(skin.pointOf.size()));
    for (int round = 0; round < kRounds; ++round) way = evened(way, neighbours);
    for (std::size_t i = 0; i < way.size(); ++i)
        if (way[i]) cut.points[i].X += *way[i];
    fair(skin, neighbours, lattice.voxelSize(), fairness(skin, lattice.voxelSize(), cut), cut.points);
    meet(skin, lattice.voxelSize(), cut);
    std::vector<std::uint32_t> moved;
    for (std::uint32_t i = 0; i < cut.points.size(); ++i)
        if (cut.points[i].skin == SkinCut::kNoSkin) moved.push_back(i);
    for (int round = 0;; ++round) {
        parallelChunks(moved.size(), kChunk / 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t m = begin; m < end; ++m)
                cut.points[moved[m]].X = near.inside(cut.points[moved[m]].X, depth[moved[m]]);
        });
        if (round == kUnfolded) break;
        moved = unfold(neighbours, std::uint32_t(skin.pointOf.size()), cut);
        if (moved.empty()) break;
    }
    redivide(skin, cut.points, cut.parts);
}

}  // namespace vdbfrac::skin
