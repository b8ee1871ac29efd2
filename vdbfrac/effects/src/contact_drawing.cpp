#include "contact_drawing.h"

#include <vdbfrac/base/by_voxel.h>
#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/nearest_triangle.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/base/polygon.h>
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
using Box = Eigen::AlignedBox3d;
using Corners = std::array<Vec3, 3>;

constexpr double kDeepest = 2, kPassed = 3;  // voxels: as deep is moved all the way, and not at all
constexpr double kTouching = .01;            // voxels: what closed lips may be off each other

/// A point's way out of a piece that it is in [m], and how much of it the point is to go.
struct Out {
    Vec3 way = Vec3::Zero();
    double share = 0;
};

/// A fragment as it is drawn.
struct Piece {
    DrawnSurface* surface;
    std::vector<std::uint32_t> points;                    // rising
    std::vector<std::array<std::uint32_t, 3>> triangles;  // of points of the surface
    Box box;
    double volume = 0;  // m^3; below 0 where it is inside out

    Corners corners(const std::array<std::uint32_t, 3>& t) const
    {
        return {surface->points[t[0]], surface->points[t[1]], surface->points[t[2]]};
    }
    void measure()
    {
        box.setEmpty(), volume = 0;
        for (const std::uint32_t p : points) box.extend(surface->points[p]);
        for (const auto& t : triangles)
            volume += volumeBelow(3, [&](std::size_t k) { return Vec3(surface->points[t[k]] - box.min()); });
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
            Piece& piece = own.try_emplace(drawn.fragment[fans.face[t]], Piece{&surface, {}, {}, {}}).first->second;
            auto& triangle = piece.triangles.emplace_back();
            for (std::size_t k = 0; k < 3; ++k)
                piece.points.push_back(triangle[k] = drawn.mesh.corners[fans.corners[t][k]].point);
        }
        for (auto& [fragment, piece] : own) {
            sortUnique(piece.points);
            pieces.push_back(std::move(piece));
        }
    }
    return pieces;
}

/// A part of a piece's surface, found by place.
class NearSurface {
public:
    /// `box`: what points that are asked for lie in.
    NearSurface(const Piece& piece, Box box, double dx) : reach_(kPassed * dx)
    {
        box.min().array() -= reach_, box.max().array() += reach_;
        for (const auto& t : piece.triangles) {
            const Corners corners = piece.corners(t);
            const Box own = triangleBox(corners);
            const Vec3 area = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            if (!own.intersects(box) || !(area.norm() > 0)) continue;
            const Box part = own.intersection(box);
            const Vec3 normal = area.normalized();
            forVoxelsOf(cellOf(part.min()), cellOf(part.max()), [&](Coord cell) {
                const Vec3 middle = reach_ * (cell.toVec().array() + .5);
                if (std::abs((middle - corners[0]).dot(normal)) < reach_)  // half of a diagonal is less
                    byCell_.add(cell, std::uint32_t(all_.size()));
            });
            all_.push_back({corners, own, normal});
        }
        byCell_.sort();
    }

    /// The way out of a point inside, where that is no longer than kPassed voxels. What is deeper than kDeepest goes
    /// less of it, and what comes near to the middle of something thin: beyond that the way out is another.
    std::optional<Out> out(const Vec3& X) const
    {
        const Vec3 way = wayOut(X);
        const double depth = way.norm();
        if (depth <= kTouching * reach_ / kPassed) return {};
        const double deep = (reach_ - depth) / (reach_ * (1 - kDeepest / kPassed));
        const double thin = 4 * (.5 - depth / (depth + behind(X, -way / depth)));
        return Out{way, std::clamp(std::min(deep, thin), 0., 1.)};
    }

private:
    struct Triangle {
        Corners corners;
        Box box;
        Vec3 normal;
    };
    Coord cellOf(const Vec3& X) const { return tetmesh::floorOf(X / reach_); }
    /// All triangles that are no farther from X than reach_, and others.
    template <class Visit>
    void visitNear(const Vec3& X, const Visit& visit) const
    {
        const Coord one{1, 1, 1}, cell = cellOf(X);
        byCell_.visit(cell - one, cell + one, [&](std::uint32_t number) { visit(all_[number]); });
    }

    /// From a point inside to the surface [m]; 0 where it is not inside, or deeper than reach_.
    Vec3 wayOut(const Vec3& X) const
    {
        NearestTriangle nearest(X, reach_);
        visitNear(X, [&](const Triangle& t) { nearest.see(t.corners, t.box, t.normal); });
        return nearest.isSeen() && !nearest.isOutside() ? Vec3(nearest.at() - X) : Vec3::Zero();
    }
    /// From a point inside along a way of length 1 to the surface [m]; infinity where that is farther than reach_.
    double behind(const Vec3& X, const Vec3& along) const
    {
        double nearest = kInfinity;
        visitNear(X, [&](const Triangle& t) {
            const double slope = along.dot(t.normal), s = (t.corners[0] - X).dot(t.normal) / slope;
            if (!(slope > 0 && s > 0 && s < std::min(nearest, reach_))) return;
            const Vec3 shares = sharesOf(t.corners, X + s * along);
            if (shares.minCoeff() >= 0) nearest = s;
        });
        return nearest;
    }

    double reach_;  // m
    std::vector<Triangle> all_;
    ByVoxel byCell_;
};

/// Of length 1, of the points of a surface; 0 where nothing is known.
std::vector<Vec3> normalsOf(const DrawnSurface& surface, std::span<const Piece> pieces)
{
    std::vector<Vec3> normals(surface.points.size(), Vec3::Zero());
    for (const Piece& piece : pieces)
        for (const auto& t : piece.triangles) {
            if (piece.surface != &surface) break;
            const auto& [a, b, c] = piece.corners(t);
            for (const std::uint32_t p : t) normals[p] += (b - a).cross(c - a);
        }
    for (Vec3& n : normals) n.stableNormalize();
    return normals;
}

/// Of a way out of another piece, how much a point of a piece may go that has this normal. Where surfaces touch that is
/// back into its own piece. Where the other one is folded, the nearest of its faces may lie across a crack: points
/// would be drawn far out of their own piece to there.
double shareBack(const Vec3& way, const Vec3& normal, double dx)
{
    constexpr double kBack = .25;            // cosine: from here on all of it
    constexpr double kShort = .5, kFar = 1;  // voxels: as far any point may go, and none out of its piece
    const double depth = way.norm(), back = -normal.dot(way) / depth / kBack,
                 near = (kFar - depth / dx) / (kFar - kShort);
    return std::clamp(std::max(back, near), 0., 1.);
}

/// Points of a piece that are in another one, and their ways out.
struct Meeting {
    const Piece *piece, *other;
    struct Way {
        std::uint32_t point;
        Out out;
    };
    std::vector<Way> ways;  // by rising point

    Meeting(const Piece& of, const Piece& in, const NearSurface& surface, std::span<const Vec3> normals, double dx)
        : piece(&of), other(&in)
    {
        const Box box = of.box.intersection(in.box);
        const auto add = [&](std::size_t begin, std::size_t end, std::vector<Way>& all) {
            for (const std::uint32_t p : std::span(of.points).subspan(begin, end - begin)) {
                const Vec3& X = of.surface->points[p];
                std::optional<Out> out = box.contains(X) ? surface.out(X) : std::nullopt;
                if (!out) continue;
                out->share *= shareBack(out->way, normals[p], dx);
                all.push_back({p, *out});
            }
        };
        ways = gatherChunks<Way>(of.points.size(), kChunk / 16, add);
    }
    /// Of the ways: a crumb that lies in a body with most of its points is not beside it, and stays where it is.
    double shareBeside() const
    {
        constexpr double kBeside = .5, kWithin = .8;  // of its points
        return std::clamp((kWithin - double(ways.size()) / double(piece->points.size())) / (kWithin - kBeside), 0., 1.);
    }
};

/// Of all pieces that are in others.
std::vector<Meeting> meetingsOf(std::span<DrawnSurface> surfaces, std::span<const Piece> pieces, double dx)
{
    std::vector<std::vector<Vec3>> normals;
    for (const DrawnSurface& s : surfaces) normals.push_back(normalsOf(s, pieces));
    std::vector<Meeting> all;
    for (const Piece& other : pieces) {
        if (!(other.volume > 0)) continue;  // it would push the wrong way
        std::vector<const Piece*> guests;
        Box box;
        for (const Piece& piece : pieces)
            if (&piece != &other && piece.box.intersects(other.box)) {
                guests.push_back(&piece);
                box.extend(piece.box.intersection(other.box));
            }
        if (guests.empty()) continue;
        const NearSurface surface(other, box, dx);
        for (const Piece* guest : guests)
            all.emplace_back(*guest, other, surface, normals[std::size_t(guest->surface - surfaces.data())], dx);
    }
    return all;
}

/// The ways of all points out of other pieces, by surface: of each that which it goes farthest.
std::vector<std::vector<Out>> waysOut(std::span<DrawnSurface> surfaces, std::vector<Piece>& pieces, double dx)
{
    for (Piece& piece : pieces) piece.measure();
    const std::vector<Meeting> meetings = meetingsOf(surfaces, pieces, dx);
    std::map<std::pair<const Piece*, const Piece*>, double> beside;  // both ways
    for (const Meeting& m : meetings) {
        const auto [at, isNew] = beside.try_emplace(std::minmax(m.piece, m.other), 1.);
        at->second = std::min(at->second, m.shareBeside());
    }
    std::vector<std::vector<Out>> ways;
    for (const DrawnSurface& s : surfaces) ways.emplace_back(s.points.size());
    for (const Meeting& m : meetings)
        for (const auto& [point, out] : m.ways) {
            Out& longest = ways[std::size_t(m.piece->surface - surfaces.data())][point];
            const double share = out.share * beside.at(std::minmax(m.piece, m.other));
            if (share * out.way.norm() > longest.share * longest.way.norm()) longest = {out.way, share};
        }
    return ways;
}

}  // namespace

void drawApart(std::span<DrawnSurface> surfaces, double dx)
{
    std::vector<Piece> pieces = piecesOf(surfaces);
    if (pieces.size() < 2) return;
    // First each side goes half of its way; then what is left of that where the other side has no points to move. Where
    // points were deep, some is to be left.
    std::vector<std::vector<double>> rest;  // m
    for (const bool isFirst : {true, false}) {
        const std::vector<std::vector<Out>> ways = waysOut(surfaces, pieces, dx);
        for (std::size_t b = 0; b < surfaces.size(); ++b) {
            DrawnSurface& s = surfaces[b];
            if (isFirst) rest.emplace_back(s.points.size(), 0);
            for (std::size_t p = 0; p < s.points.size(); ++p) {
                const auto& [way, share] = ways[b][p];
                const double depth = way.norm();
                if (depth == 0) continue;
                if (isFirst) rest[b][p] = depth * (1 - share);
                const double far = isFirst ? .5 * share * depth : std::min(share * depth, depth - rest[b][p]);
                if (far > 0) s.points[p] += far / depth * way, s.isMoved[p] = 1;
            }
        }
    }
}

}  // namespace vdbfrac::effects
