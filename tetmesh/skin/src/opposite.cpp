#include <vdbfrac/skin/opposite.h>

#include <vdbfrac/base/by_voxel.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/base/polygon.h>
#include <vdbfrac/base/triangle.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace vdbfrac::skin {

namespace {

using Corners = std::array<std::uint32_t, 3>;

constexpr double kClosed = 0.75;    // voxels: lips farther apart have not been closed
constexpr double kThrough = 0.25;   // voxels that one may lie behind the other; more is thin material between cracks
constexpr double kOpposite = -0.3;  // cosine between the directions in which two lips look

/// A torn face, or an edge of a rim with two of its corners in one.
struct LipPiece {
    Corners corner{};
    Vec3 out;  // into the crack
};

/// Pieces of lips by the voxels that their boxes touch.
class LipPieces {
public:
    LipPieces(std::span<const Vec3> X, std::vector<LipPiece> pieces, double dx)
        : X_(X), pieces_(std::move(pieces)), dx_(dx)
    {
        for (std::uint32_t i = 0; i < pieces_.size(); ++i) {
            const auto [p, q, r] = corners(pieces_[i]);
            const Coord low = tetmesh::floorOf(p.cwiseMin(q).cwiseMin(r) / dx);
            const Coord high = tetmesh::floorOf(p.cwiseMax(q).cwiseMax(r) / dx);
            forVoxelsOf(low, high, [&](Coord voxel) { byVoxel_.add(voxel, i); });
        }
        byVoxel_.sort();
    }

    /// For each point that looks anywhere the closest place on what looks against it, if that is near.
    std::vector<Opposite> opposites(std::span<const Vec3> out) const
    {
        std::vector<std::uint32_t> points;
        for (std::uint32_t p = 0; p < out.size(); ++p)
            if (!out[p].isZero()) points.push_back(p);
        return gatherChunks<Opposite>(points.size(), kChunk / 16, [&](std::size_t begin, std::size_t end, auto& found) {
            for (std::size_t i = begin; i < end; ++i)
                if (const auto other = opposite(points[i], out[points[i]].stableNormalized())) found.push_back(*other);
        });
    }

private:
    std::array<Vec3, 3> corners(const LipPiece& piece) const
    {
        return {X_[piece.corner[0]], X_[piece.corner[1]], X_[piece.corner[2]]};
    }
    std::optional<Opposite> opposite(std::uint32_t point, const Vec3& out) const
    {
        for (const double reach : {kClosed / 4, kClosed})  // most are as near as that
            if (auto found = within(reach * dx_, point, out)) return found;
        return std::nullopt;
    }
    std::optional<Opposite> within(double reach, std::uint32_t point, const Vec3& out) const
    {
        const Vec3& X = X_[point];
        double nearest = reach * reach;
        const LipPiece* best = nullptr;
        Vec3 at;
        forNear(X, reach, [&](const LipPiece& piece) {
            if (piece.out.dot(out) > kOpposite) return;
            const Vec3 p = closestPoint(corners(piece), X).at;
            const double d = (p - X).squaredNorm();
            if (d < nearest && (p - X).dot(out) > -kThrough * dx_) nearest = d, best = &piece, at = p;
        });
        if (!best) return std::nullopt;
        return Opposite{point, best->corner, sharesOf(corners(*best), at)};
    }
    template <class Visit>
    void forNear(const Vec3& X, double reach, const Visit& visit) const
    {
        byVoxel_.visit(tetmesh::floorOf((X.array() - reach) / dx_), tetmesh::floorOf((X.array() + reach) / dx_),
                       [&](std::uint32_t i) { visit(pieces_[i]); });
    }

    std::span<const Vec3> X_;
    std::vector<LipPiece> pieces_;
    double dx_;
    ByVoxel byVoxel_;
};

/// Edges of rims: those of one torn face alone.
std::vector<std::pair<std::uint32_t, std::uint32_t>> rimOf(std::span<const Corners> torn, std::span<const Vec3> normal)
{
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges, rim;
    for (const Corners& t : torn)
        for (std::size_t k = 0; k < 3; ++k)
            if (!normal[t[k]].isZero() && !normal[t[(k + 1) % 3]].isZero()) edges.emplace_back(t[k], t[(k + 1) % 3]);
    std::sort(edges.begin(), edges.end());
    for (const auto& [a, b] : edges)
        if (!std::binary_search(edges.begin(), edges.end(), std::pair{b, a})) rim.emplace_back(a, b);
    return rim;
}

}  // namespace

std::vector<Opposite> oppositeFaces(std::span<const Vec3> X, std::span<const Corners> torn,
                                    std::span<const Vec3> normal, double dx)
{
    std::vector<LipPiece> faces;
    std::vector<Vec3> out(X.size(), Vec3::Zero());
    for (const Corners& t : torn) {
        const Vec3 area = (X[t[1]] - X[t[0]]).cross(X[t[2]] - X[t[0]]);
        faces.push_back({t, area.stableNormalized()});
        for (const std::uint32_t p : t)
            if (normal[p].isZero()) out[p] += area;
    }
    return LipPieces(X, std::move(faces), dx).opposites(out);
}

std::vector<Opposite> oppositeRims(std::span<const Vec3> X, std::span<const Corners> torn, std::span<const Vec3> normal,
                                   double dx)
{
    std::vector<LipPiece> edges;
    std::vector<Vec3> out(X.size(), Vec3::Zero());
    for (const auto& [a, b] : rimOf(torn, normal)) {
        const Vec3 across = (normal[a] + normal[b]).cross(X[b] - X[a]);
        edges.push_back({{a, b, b}, across.stableNormalized()});
        out[a] += across, out[b] += across;
    }
    return LipPieces(X, std::move(edges), dx).opposites(out);
}

ClosedLips closedLips(const tetmesh::DrawnTopology& drawn, double dx)
{
    constexpr double kMet = 0.05;  // voxels
    const tetmesh::RenderMesh& mesh = drawn.mesh;
    std::vector<Corners> torn;
    std::vector<Vec3> normal(mesh.points.size(), Vec3::Zero());
    for (std::size_t f = 0; f < mesh.faces(); ++f) {
        const auto c = mesh.face(f);
        if (drawn.torn[f]) {
            torn.push_back({c[0].point, c[1].point, c[2].point});
            continue;
        }
        const Vec3 area = doubleArea(c.size(), [&](std::size_t k) -> const Vec3& { return mesh.points[c[k].point]; });
        for (const tetmesh::RenderMesh::Corner& corner : c) normal[corner.point] += area;
    }
    for (Vec3& n : normal) n.stableNormalize();
    ClosedLips lips{oppositeFaces(mesh.points, torn, normal, dx), oppositeRims(mesh.points, torn, normal, dx)};
    const auto isApart = [&](const Opposite& lip) {
        return (lip.at(mesh.points) - mesh.points[lip.point]).norm() > kMet * dx;
    };
    std::erase_if(lips.faces, isApart), std::erase_if(lips.rims, isApart);
    return lips;
}

}  // namespace vdbfrac::skin
