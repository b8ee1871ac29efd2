#include "touching_lips.h"

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/nearest_source.h>
#include <vdbfrac/base/parallel.h>

#include <Eigen/Geometry>

#include <algorithm>

namespace vdbfrac::skin {

namespace {

using tetmesh::DrawnTopology;
using tetmesh::RenderMesh;

constexpr double kBeside = 2;            // voxels at rest: as far the skin goes along with a rim
constexpr double kPast = 2, kGone = 3;   // voxels: lips as far past each other meet, and are taken for others
constexpr double kSlid = .5, kAway = 1;  // voxels: the same along each other
constexpr double kOpposite = -0.3;       // cosine between the directions in which lips look that face each other
constexpr double kTouching = .01;        // voxels: less is not seen

/// 1 up to `whole`, 0 from `none` on.
double fading(double value, double whole, double none) { return std::clamp((none - value) / (none - whole), 0., 1.); }

}  // namespace

TouchingLips::TouchingLips(const DrawnTopology& drawn, std::span<const std::uint32_t> places, double dx) : dx_(dx)
{
    const RenderMesh& mesh = drawn.mesh;
    for (std::size_t f = 0; f < mesh.faces(); ++f) {
        if (!drawn.torn[f]) continue;
        const auto c = mesh.face(f);
        torn_.push_back({c[0].point, c[1].point, c[2].point});
        point_.insert(point_.end(), torn_.back().begin(), torn_.back().end());
    }
    if (torn_.empty()) return;
    sortUnique(point_);
    const auto toOwn = [&](std::uint32_t& p) {
        p = std::uint32_t(std::ranges::lower_bound(point_, p) - point_.begin());
    };
    for (auto& t : torn_) std::ranges::for_each(t, toOwn);
    ClosedLips closed = closedLips(drawn, dx);
    lips_ = std::move(closed.faces);
    const std::size_t faces = lips_.size();
    lips_.insert(lips_.end(), closed.rims.begin(), closed.rims.end());
    if (lips_.empty()) return;
    for (Opposite& lip : lips_) toOwn(lip.point), std::ranges::for_each(lip.corner, toOwn);
    besidePoint_ = pointsBeside(point_.size(), [&](const auto& visit) {
        for (const auto& t : torn_) visit(t);
    });
    std::vector<Vec3> X;
    for (const std::uint32_t p : point_) X.push_back(mesh.points[p]);
    const std::vector<Vec3> normal = normalsAt(X);
    for (const Opposite& lip : lips_) past_.push_back(std::min(0., gapOf(lip, X, normal).size));
    addBeside(drawn, places, std::span(lips_).subspan(faces));
}

/// The skin within reach of rims that lie on another lip, by the rim that the fewest edges lead to.
void TouchingLips::addBeside(const DrawnTopology& drawn, std::span<const std::uint32_t> places,
                             std::span<const Opposite> rims)
{
    const RenderMesh& mesh = drawn.mesh;
    const auto first = std::uint32_t(places.size());
    const auto placeOf = [&](std::uint32_t p) { return p < first ? places[p] : p; };  // places are less than `first`
    std::vector<std::uint32_t> rimAt(mesh.points.size(), kNoSource);
    std::vector<std::uint8_t> isRim(mesh.points.size(), 0);
    for (const Opposite& rim : rims) rimAt[point_[rim.point]] = rim.point, isRim[point_[rim.point]] = 1;
    std::vector<std::uint32_t> corners;
    const Groups links = pointsBeside(mesh.points.size(), [&](const auto& visit) {
        for (std::size_t f = 0; f < mesh.faces(); ++f) {
            if (drawn.torn[f] || drawn.isTaken(f)) continue;
            corners.clear();
            for (const RenderMesh::Corner& c : mesh.face(f)) corners.push_back(placeOf(c.point));
            visit(corners);
        }
    });
    const std::vector<std::uint32_t> nearest = nearestSources(links, isRim);
    for (std::uint32_t p = 0; p < mesh.points.size(); ++p) {
        const std::uint32_t place = placeOf(p);
        if (nearest[place] == kNoSource || isRim[place]) continue;
        const double distance = (mesh.points[p] - mesh.points[nearest[place]]).norm();
        if (distance < kBeside * dx_) beside_.push_back({p, rimAt[nearest[place]], 1 - distance / (kBeside * dx_)});
    }
}

/// Into the crack, of length 1, at points of torn faces.
std::vector<Vec3> TouchingLips::normalsAt(std::span<const Vec3> points) const
{
    std::vector<Vec3> normals(points.size(), Vec3::Zero());
    for (const auto& t : torn_) {
        const Vec3 area = (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
        for (const std::uint32_t p : t) normals[p] += area;
    }
    for (Vec3& n : normals) n.stableNormalize();
    return normals;
}

TouchingLips::Gap TouchingLips::gapOf(const Opposite& lip, std::span<const Vec3> at, std::span<const Vec3> normal)
{
    const Vec3 own = normal[lip.point], other = lip.at(normal).stableNormalized();
    Gap gap{(own - other).stableNormalized(), lip.at(at) - at[lip.point], 0, own.dot(other) <= kOpposite};
    gap.size = gap.between.dot(gap.normal);
    return gap;
}

TouchingLips::Move TouchingLips::moveOf(std::size_t lip, std::span<const Vec3> at, std::span<const Vec3> v,
                                        std::span<const Vec3> normal) const
{
    const Gap gap = gapOf(lips_[lip], at, normal);
    const double past = past_[lip] - gap.size, slid = (gap.between - gap.size * gap.normal).norm();
    if (!gap.isFacing || past < kTouching * dx_) return {};
    const double half = fading(past / dx_, kPast, kGone) * fading(slid / dx_, kSlid, kAway) / 2;
    const double closing = (v[lips_[lip].point] - lips_[lip].at(v)).dot(gap.normal);
    return {-half * past * gap.normal, -half * closing * gap.normal};
}

/// Of all points of torn faces: what lips go, evened out with what is beside it, as neighbours that part would fold.
/// Empty where none goes anywhere.
std::vector<TouchingLips::Move> TouchingLips::movesOf(std::span<const Vec3> at, std::span<const Vec3> v) const
{
    constexpr int kRounds = 3;
    const std::vector<Vec3> normal = normalsAt(at);
    std::vector<Move> moves(point_.size());
    parallelChunks(lips_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t l = begin; l < end; ++l) moves[lips_[l].point] = moveOf(l, at, v, normal);
    });
    if (std::ranges::all_of(moves, [](const Move& move) { return move.way.isZero(); })) return {};
    for (int round = 0; round < kRounds; ++round) {
        const std::vector<Move> before = moves;
        parallelChunks(moves.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            for (std::size_t p = begin; p < end; ++p) {
                Move sum;
                for (const std::uint32_t q : besidePoint_[p])
                    sum.way += before[q].way, sum.velocity += before[q].velocity;
                const double share = .5 / double(besidePoint_[p].size());
                moves[p].way = .5 * before[p].way + share * sum.way;
                moves[p].velocity = .5 * before[p].velocity + share * sum.velocity;
            }
        });
    }
    return moves;
}

void TouchingLips::part(std::span<Vec3> points, std::span<Vec3> velocity) const
{
    if (lips_.empty()) return;
    std::vector<Vec3> at, v;
    for (const std::uint32_t p : point_) at.push_back(points[p]), v.push_back(velocity[p]);
    const std::vector<Move> moves = movesOf(at, v);
    if (moves.empty()) return;
    const auto move = [&](std::uint32_t point, const Move& by, double share) {
        points[point] += share * by.way, velocity[point] += share * by.velocity;
    };
    for (std::size_t p = 0; p < point_.size(); ++p) move(point_[p], moves[p], 1);
    for (const Beside& b : beside_) move(b.point, moves[b.rim], b.share);
}

}  // namespace vdbfrac::skin
