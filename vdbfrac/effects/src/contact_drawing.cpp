#include "contact_drawing.h"

#include <vdbfrac/base/by_voxel.h>
#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/base/polygon.h>
#include <vdbfrac/base/primitive.h>
#include <vdbfrac/base/triangle.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace vdbfrac::effects {

namespace {

using core::DrawnSurface;
using Corners = std::array<Vec3, 3>;

constexpr double kDeepest = 2, kPassed = 3;  // voxels: as deep is moved all the way, and not at all
constexpr double kTouching = .01;            // voxels: what closed lips may be off each other

const Bounds kNowhere{Vec3::Constant(kInfinity), Vec3::Constant(-kInfinity)};

void include(const Vec3& point, Bounds& box)
{
    box.lower = box.lower.cwiseMin(point), box.upper = box.upper.cwiseMax(point);
}

bool meet(const Bounds& a, const Bounds& b)
{
    return (a.lower.array() <= b.upper.array()).all() && (b.lower.array() <= a.upper.array()).all();
}

Bounds common(const Bounds& a, const Bounds& b) { return {a.lower.cwiseMax(b.lower), a.upper.cwiseMin(b.upper)}; }

/// A fragment as it is drawn.
struct Piece {
    DrawnSurface* surface;
    std::vector<std::uint32_t> points;                    // rising
    std::vector<std::array<std::uint32_t, 3>> triangles;  // of points of the surface
    Bounds box = kNowhere;
    double volume = 0;  // m^3; below 0 where it is inside out

    Corners corners(const std::array<std::uint32_t, 3>& t) const
    {
        return {surface->points[t[0]], surface->points[t[1]], surface->points[t[2]]};
    }
    void measure()
    {
        box = kNowhere, volume = 0;
        for (const std::uint32_t p : points) include(surface->points[p], box);
        for (const auto& t : triangles)
            volume += volumeBelow(3, [&](std::size_t k) -> const Vec3& { return surface->points[t[k]]; });
    }
};

/// In the order of surfaces and fragments.
std::vector<Piece> piecesOf(std::span<DrawnSurface> surfaces)
{
    std::vector<Piece> pieces;
    for (DrawnSurface& surface : surfaces) {
        const tetmesh::DrawnTopology& drawn = surface.topology;
        const tetmesh::Fans fans = tetmesh::fansOf(drawn.mesh);
        std::map<std::uint32_t, Piece> own;  // by fragment
        for (std::size_t t = 0; t < fans.face.size(); ++t) {
            if (drawn.isTaken(fans.face[t])) continue;
            Piece& piece = own.try_emplace(drawn.fragment[fans.face[t]], Piece{&surface, {}, {}}).first->second;
            auto& triangle = piece.triangles.emplace_back();
            for (std::size_t k = 0; k < 3; ++k)
                piece.points.push_back(triangle[k] = drawn.mesh.corners[fans.corners[t][k]].point);
        }
        for (auto& [fragment, piece] : own) {
            std::sort(piece.points.begin(), piece.points.end());
            piece.points.erase(std::unique(piece.points.begin(), piece.points.end()), piece.points.end());
            pieces.push_back(std::move(piece));
        }
    }
    return pieces;
}

/// A part of a piece's surface, found by place.
class NearSurface {
public:
    /// `box`: what points that are asked for lie in.
    NearSurface(const Piece& piece, Bounds box, double dx) : reach_(kPassed * dx)
    {
        box.lower.array() -= reach_, box.upper.array() += reach_;
        for (const auto& t : piece.triangles) {
            const Corners corners = piece.corners(t);
            Bounds own = kNowhere;
            for (const Vec3& corner : corners) include(corner, own);
            const Vec3 area = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            if (!meet(own, box) || !(area.norm() > 0)) continue;
            const Bounds part = common(own, box);
            forVoxelsOf(cellOf(part.lower), cellOf(part.upper),
                        [&](Coord cell) { byCell_.add(cell, std::uint32_t(all_.size())); });
            all_.push_back({corners, own, area.normalized()});
        }
        byCell_.sort();
    }

    /// The way [m] from a point inside to the surface, where that is no longer than kPassed voxels.
    std::optional<Vec3> wayOut(const Vec3& X) const
    {
        constexpr double kSame = 1e-9;  // relative: at an edge the triangles on both sides are as near
        double nearest = reach_ * reach_, steepest = 0;
        Vec3 way = Vec3::Zero();
        bool isInside = false;
        const Coord one{1, 1, 1}, cell = cellOf(X);
        byCell_.visit(cell - one, cell + one, [&](std::uint32_t number) {
            const Triangle& t = all_[number];
            const Vec3 gap = (t.box.lower - X).cwiseMax(X - t.box.upper).cwiseMax(0);
            if (gap.squaredNorm() > nearest * (1 + kSame)) return;
            const Vec3 to = closestPoint(t.corners, X).at - X;
            const double square = to.squaredNorm(), in = to.dot(t.normal);
            if (square > nearest * (1 + kSame)) return;
            if (square < nearest * (1 - kSame)) steepest = 0;
            if (std::abs(in) >= steepest) steepest = std::abs(in), isInside = in > 0;
            if (square < nearest) nearest = square, way = to;
        });
        return isInside ? std::optional(way) : std::nullopt;
    }

private:
    struct Triangle {
        Corners corners;
        Bounds box;
        Vec3 normal;
    };
    Coord cellOf(const Vec3& X) const { return tetmesh::floorOf(X / reach_); }

    double reach_;  // m
    std::vector<Triangle> all_;
    ByVoxel byCell_;
};

/// Adds where points of `piece` go, to be out of `other`: the longest way of each.
void addWays(const Piece& piece, const Piece& other, const NearSurface& surface, double dx, std::vector<Vec3>& ways)
{
    const Bounds box = common(piece.box, other.box);
    parallelChunks(piece.points.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const std::uint32_t p = piece.points[i];
            const Vec3& X = piece.surface->points[p];
            if (!meet({X, X}, box)) continue;
            const std::optional<Vec3> way = surface.wayOut(X);
            if (!way || way->norm() <= kTouching * dx) continue;
            const double share = std::clamp((kPassed - way->norm() / dx) / (kPassed - kDeepest), 0., 1.);
            if (Vec3 own = share * *way; own.squaredNorm() > ways[p].squaredNorm()) ways[p] = own;
        }
    });
}

}  // namespace

void drawApart(std::span<DrawnSurface> surfaces, double dx)
{
    std::vector<Piece> pieces = piecesOf(surfaces);
    if (pieces.size() < 2) return;
    // First both sides go half of the way; then what is left, where only one of them has points.
    for (const double part : {.5, 1.}) {
        for (Piece& piece : pieces) piece.measure();
        std::map<const DrawnSurface*, std::vector<Vec3>> ways;
        for (const DrawnSurface& s : surfaces) ways[&s].assign(s.points.size(), Vec3::Zero());
        for (const Piece& other : pieces) {
            if (!(other.volume > 0)) continue;
            std::vector<const Piece*> guests;
            Bounds box = kNowhere;
            for (const Piece& piece : pieces)
                if (&piece != &other && meet(piece.box, other.box)) {
                    guests.push_back(&piece);
                    const Bounds shared = common(piece.box, other.box);
                    include(shared.lower, box), include(shared.upper, box);
                }
            if (guests.empty()) continue;
            const NearSurface surface(other, box, dx);
            for (const Piece* guest : guests) addWays(*guest, other, surface, dx, ways[guest->surface]);
        }
        for (DrawnSurface& s : surfaces) {
            const std::vector<Vec3>& way = ways[&s];
            for (std::size_t p = 0; p < way.size(); ++p)
                if (!way[p].isZero(0)) s.points[p] += part * way[p], s.isMoved[p] = 1;
        }
    }
}

}  // namespace vdbfrac::effects
