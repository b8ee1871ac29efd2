#include <vdbfrac/core/taken_faces.h>

#include "arrivals.h"

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/nearest_source.h>
#include <vdbfrac/base/polygon.h>
#include <vdbfrac/skin/opposite.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace vdbfrac::core {

namespace {

using tetmesh::DrawnTopology;
using tetmesh::RenderMesh;
constexpr std::uint32_t kNever = std::numeric_limits<std::uint32_t>::max();

/// Points by the edges of faces that cracks have taken, and of torn faces where these count.
Groups linksOf(const DrawnTopology& drawn, bool withTorn)
{
    return pointsBeside(drawn.mesh.points.size(), [&](const auto& visit) {
        for (std::size_t f = 0; f < drawn.mesh.faces(); ++f) {
            if (!(withTorn && drawn.torn[f]) && !drawn.isTaken(f)) continue;
            const auto face = drawn.mesh.face(f);  // torn and taken ones are triangles
            visit(std::array{face[0].point, face[1].point, face[2].point});
        }
    });
}

/// Points of rims that lie on the rim of another lip.
std::vector<std::uint8_t> rimsThatMeet(const DrawnTopology& drawn, double dx)
{
    std::vector<std::uint8_t> meets(drawn.mesh.points.size(), 0);
    for (const skin::Opposite& lip : skin::closedLips(drawn, dx).rims) meets[lip.point] = 1;
    return meets;
}

/// Faces that cracks have taken, but for what is left between lips that meet: slivers whose corners lie on another
/// lip. Corners on no rim are as the nearest on one.
std::vector<std::uint32_t> facesApart(const DrawnTopology& drawn, std::span<const std::uint8_t> meets, double dx)
{
    constexpr double kSliver = 0.02;  // voxels: its height
    const RenderMesh& mesh = drawn.mesh;
    std::vector<std::uint8_t> isRim(mesh.points.size(), 0);
    for (std::size_t f = 0; f < mesh.faces(); ++f)
        for (const RenderMesh::Corner& c : mesh.face(f))
            if (drawn.torn[f]) isRim[c.point] = 1;
    const std::vector<std::uint32_t> nearest = nearestSources(linksOf(drawn, false), isRim);
    const auto hasMet = [&](const RenderMesh::Corner& c) {
        return nearest[c.point] != kNoSource && meets[nearest[c.point]];
    };
    const auto isSliver = [&](std::span<const RenderMesh::Corner> face) {
        const auto at = [&](std::size_t k) -> const Vec3& { return mesh.points[face[k].point]; };
        const double longest = std::max({(at(1) - at(0)).norm(), (at(2) - at(1)).norm(), (at(0) - at(2)).norm()});
        return doubleArea(3, at).norm() < kSliver * dx * longest;
    };
    std::vector<std::uint32_t> apart;
    for (std::uint32_t f = drawn.taken[0]; f < drawn.taken[1]; ++f)
        if (!isSliver(mesh.face(f)) || !std::ranges::all_of(mesh.face(f), hasMet)) apart.push_back(f);
    return apart;
}

/// Of each point the one of those with `isKnown` that the fewest links lead to; of what none leads to, all that hangs
/// together, the one that is nearest to a point of it.
std::vector<std::uint32_t> nearestKnown(const Groups& links, std::span<const std::uint8_t> isKnown,
                                        std::span<const Vec3> X)
{
    std::vector<std::uint32_t> nearest = nearestSources(links, isKnown), known, reached;
    for (std::uint32_t p = 0; p < X.size(); ++p)
        if (isKnown[p]) known.push_back(p);
    for (std::uint32_t p = 0; p < X.size() && !known.empty(); ++p) {
        if (nearest[p] != kNoSource || links[p].empty()) continue;
        nearest[p] = *std::ranges::min_element(known, {}, [&](std::uint32_t k) { return (X[k] - X[p]).squaredNorm(); });
        reached.assign(1, p);
        for (std::size_t r = 0; r < reached.size(); ++r)
            for (const std::uint32_t next : links[reached[r]])
                if (nearest[next] == kNoSource) nearest[next] = nearest[p], reached.push_back(next);
    }
    return nearest;
}

/// The first frame in which a crack has come to each point; where none is known to have, that of the nearest point with
/// one, or kNever.
std::vector<std::uint32_t> framesOf(const DrawnTopology& drawn, bool lipsClosed, const Stages& stages, const Body& body,
                                    double fps)
{
    const std::vector<Vec3>& X = drawn.mesh.points;
    std::vector<std::uint32_t> frame(X.size(), kNever);
    // Lips that are closed cover a gap until it is a voxel wide on all sides.
    std::vector<Vec3> places = X;
    for (int side = 0; side < 6 && lipsClosed; ++side)
        for (Vec3 beside : X) {
            beside[side / 2] += (side % 2 ? 1 : -1) * body.phi.voxelSize();
            places.push_back(beside);
        }
    std::vector<float> times = arrivalTimes(stages, body, places);
    if (times.empty()) return frame;
    for (std::size_t i = X.size(); i < places.size(); ++i)
        if (float& own = times[i % X.size()]; own >= 0) own = std::max(own, times[i]);
    times.resize(X.size());
    const Groups links = linksOf(drawn, true);
    std::vector<std::uint8_t> isKnown(X.size());
    for (std::size_t p = 0; p < X.size(); ++p) isKnown[p] = times[p] >= 0 && !links[p].empty();
    const std::vector<std::uint32_t> nearest = nearestKnown(links, isKnown, X);
    for (std::size_t p = 0; p < X.size(); ++p)
        if (nearest[p] != kNoSource) frame[p] = frameOfArrival(times[nearest[p]], fps);
    return frame;
}

/// All of a mesh but the faces that cracks have taken.
DrawnTopology withoutTaken(const DrawnTopology& drawn)
{
    DrawnTopology left = drawn;
    RenderMesh& mesh = left.mesh;
    mesh.corners.clear(), mesh.faceEnd.clear(), mesh.group.clear(), mesh.material.clear();
    left.torn.clear(), left.fragment.clear(), left.taken = {};
    for (std::size_t f = 0; f < drawn.mesh.faces(); ++f) {
        if (drawn.isTaken(f)) continue;
        mesh.addFace(drawn.mesh.face(f), drawn.mesh.group[f], drawn.mesh.material[f]);
        left.torn.push_back(drawn.torn[f]), left.fragment.push_back(drawn.fragment[f]);
    }
    return left;
}

/// Of each face a number that those have which go in the same frame and have their middle in the same voxel.
std::vector<std::uint32_t> cellsOf(std::span<const std::pair<std::uint32_t, std::uint32_t>> faces,
                                   const RenderMesh& mesh, double dx)
{
    using Cell = std::array<std::int64_t, 4>;
    std::vector<Cell> of;
    for (const auto& [frame, f] : faces) {
        Vec3 middle = Vec3::Zero();
        for (const RenderMesh::Corner& c : mesh.face(f)) middle += mesh.points[c.point] / 3;
        const Coord voxel = tetmesh::floorOf(middle.array() / dx);
        of.push_back({frame, voxel.x, voxel.y, voxel.z});
    }
    std::vector<Cell> cells = of;
    sortUnique(cells);
    std::vector<std::uint32_t> number;
    for (const Cell& cell : of) number.push_back(std::uint32_t(std::ranges::lower_bound(cells, cell) - cells.begin()));
    return number;
}

}  // namespace

PartedFaces::PartedFaces(const DrawnTopology& drawn, std::span<const std::uint8_t> mayRide, const Body& body)
    : drawn_(&drawn), mesh_(&*body.mesh), dx_(body.phi.voxelSize()), frame_(drawn.taken[1] - drawn.taken[0], kNever)
{
    const auto rides = [&](const RenderMesh::Corner& c) { return mayRide[c.point] != 0; };
    for (std::uint32_t f = 0; f < drawn.mesh.faces(); ++f)
        if (!drawn.isTaken(f) && std::ranges::any_of(drawn.mesh.face(f), rides)) skin_.push_back(f);
    if (!hasAny()) return;
    for (std::uint32_t e = 0; e < mesh_->elements().size(); ++e) {
        Vec3 middle = Vec3::Zero();
        for (const std::uint32_t n : mesh_->elements()[e].node) middle += mesh_->restPosition(n) / tetmesh::kCorners;
        elements_.add(tetmesh::floorOf(middle.array() / mesh_->spacing()), e);
    }
    elements_.sort();
}

/// The most that what is left of the material is stretched beside a line at rest; 1 where it is not.
double PartedFaces::stretchAlong(const Vec3& A, const Vec3& B, std::span<const Vec3> x) const
{
    double most = 1;
    const auto see = [&](std::uint32_t element) {
        const auto& node = mesh_->elements()[element].node;
        for (std::size_t a = 0; a < node.size(); ++a)
            for (std::size_t b = 0; b < a; ++b) {
                const double rest = (mesh_->restPosition(node[a]) - mesh_->restPosition(node[b])).norm();
                if (rest > 0) most = std::max(most, (x[node[a]] - x[node[b]]).norm() / rest);
            }
    };
    const double h = mesh_->spacing();
    const int steps = int(std::ceil((B - A).norm() / h));
    for (int s = 0; s <= steps; ++s) {
        const Vec3 X = A + (steps > 0 ? double(s) / steps : 0) * (B - A);
        elements_.visit(tetmesh::floorOf(X.array() / h - 1.), tetmesh::floorOf(X.array() / h + 1.), see);
    }
    return most;
}

bool PartedFaces::isLong(std::size_t face, std::span<const Vec3> at, std::span<const Vec3> x) const
{
    // Times what the material beside it is, and voxels more. What cracks take covers lips that are closed, and goes as
    // they part.
    const double kLong = drawn_->isTaken(face) ? 1.5 : 2, kMore = drawn_->isTaken(face) ? .5 : 1;
    const std::vector<Vec3>& rest = drawn_->mesh.points;
    const auto corners = drawn_->mesh.face(face);
    for (std::size_t k = 0; k < corners.size(); ++k) {
        const std::uint32_t a = corners[k].point, b = corners[(k + 1) % corners.size()].point;
        const double now = (at[a] - at[b]).norm(), then = (rest[a] - rest[b]).norm();
        if (now > kLong * then + kMore * dx_ && now > kLong * stretchAlong(rest[a], rest[b], x) * then + kMore * dx_)
            return true;
    }
    return false;
}

std::vector<std::uint32_t> PartedFaces::spanning(std::span<const Vec3> at, std::span<const Vec3> x) const
{
    std::vector<std::uint32_t> corners;
    for (const std::uint32_t f : skin_)
        if (isLong(f, at, x))
            for (const RenderMesh::Corner& c : drawn_->mesh.face(f)) corners.push_back(c.point);
    return corners;
}

void PartedFaces::seeTaken(std::uint32_t frame, std::span<const Vec3> at, std::span<const Vec3> x)
{
    for (std::size_t i = 0; i < frame_.size(); ++i)
        if (frame_[i] == kNever && isLong(drawn_->taken[0] + i, at, x)) frame_[i] = frame;
}

TakenFaces::TakenFaces(const DrawnTopology& drawn, bool lipsClosed, const Stages& stages, const Body& body, double fps,
                       const PartedFaces& parted)
{
    const double dx = body.phi.voxelSize();
    const std::vector<std::uint8_t> meets =
        lipsClosed ? rimsThatMeet(drawn, dx) : std::vector<std::uint8_t>(drawn.mesh.points.size(), 0);
    const std::vector<std::uint32_t> frameOf = framesOf(drawn, lipsClosed, stages, body, fps);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> faces;  // frame and number
    for (const std::uint32_t f : facesApart(drawn, meets, dx)) {
        std::uint32_t frame = kNever;  // by the first corner: what went later would hang on rims as a fringe
        for (const RenderMesh::Corner& c : drawn.mesh.face(f)) frame = std::min(frame, frameOf[c.point]);
        if (frame == kNever)
            ++unknown_;
        else
            faces.emplace_back(std::min(frame, parted.frameOf(f)), f);
    }
    const std::vector<std::uint32_t> cell = cellsOf(faces, drawn.mesh, dx);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> points;  // cell and number
    for (std::size_t i = 0; i < faces.size(); ++i)
        for (const RenderMesh::Corner& c : drawn.mesh.face(faces[i].second)) points.emplace_back(cell[i], c.point);
    sortUnique(points);
    DrawnTopology now = withoutTaken(drawn);
    const auto first = std::uint32_t(now.mesh.points.size());
    // What is gone lies in a point of what stays: others may be carried far away.
    std::vector<std::uint8_t> stays(first, 0);
    for (const RenderMesh::Corner& c : now.mesh.corners) stays[c.point] = 1;
    std::vector<std::uint32_t> frameOfPoint(points.size());
    DisjointSets sets(points.size());
    for (std::size_t i = 0; i < faces.size(); ++i) {
        const auto [frame, f] = faces[i];
        std::array<std::uint32_t, 3> own;
        std::array<RenderMesh::Corner, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) {
            corners[k] = drawn.mesh.face(f)[k];
            const auto at = std::ranges::lower_bound(points, std::pair(cell[i], corners[k].point));
            own[k] = std::uint32_t(at - points.begin());
            corners[k].point = first + own[k];
            frameOfPoint[own[k]] = frame;
            sets.join(own[0], own[k]);
        }
        now.mesh.addFace(corners, drawn.mesh.group[f], drawn.mesh.material[f]);
        now.torn.push_back(0), now.fragment.push_back(drawn.fragment[f]);
    }
    const std::vector<std::uint32_t> nearest = nearestKnown(linksOf(drawn, false), stays, drawn.mesh.points);
    const std::vector<std::uint32_t> patch = std::move(sets).names();
    for (std::size_t i = 0; i < points.size(); ++i) {
        const std::uint32_t all = points[patch[i]].second;
        now.mesh.points.push_back(now.mesh.points[points[i].second]);
        points_.push_back({points[i].second, frameOfPoint[i], all, nearest[all] != kNoSource ? nearest[all] : all});
    }
    topology_ = std::make_shared<const DrawnTopology>(std::move(now));
}

bool TakenFaces::goesIn(std::size_t frame) const
{
    return std::ranges::any_of(points_, [&](const Point& point) { return point.frame == frame; });
}

void TakenFaces::addTo(std::size_t frame, std::span<const Vec3> before, DrawnBody& drawn) const
{
    drawn.topology = topology_;
    for (const Point& point : points_) {
        const bool goesNow = frame == point.frame && frame > 0;
        const std::uint32_t at = frame < point.frame ? point.from : point.goesTo;
        drawn.points.push_back(goesNow ? before[point.patch] : drawn.points[at]);
        drawn.velocity.push_back(drawn.velocity[at]);
    }
}

}  // namespace vdbfrac::core
