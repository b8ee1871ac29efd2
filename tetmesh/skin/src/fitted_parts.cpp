#include "fitted_parts.h"

#include <Eigen/Geometry>
#include <Eigen/Sparse>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace vdbfrac::skin {

namespace {

constexpr std::uint32_t kKnown = std::numeric_limits<std::uint32_t>::max();

/// Cotangents of a triangle's angles: weights of the edges opposite to them. One without area has edges alone.
Vec3 cotangents(const Vec3& a, const Vec3& b, const Vec3& c)
{
    constexpr double kFlat = 1e-6;  // of the square of an edge: area that is told from none
    const Vec3 p = b - a, q = c - b, r = a - c;
    const double area = p.cross(q).norm();
    if (!(area > kFlat * std::max({p.squaredNorm(), q.squaredNorm(), r.squaredNorm()}))) return Vec3::Ones();
    return Vec3(-p.dot(r), -p.dot(q), -q.dot(r)) / area;
}

/// Of a point, numbered as SkinCut::Part has them [m].
Vec3 placeOf(const SkinTopology& skin, std::span<const Vec3> X, std::uint32_t point)
{
    const std::size_t given = skin.pointOf.size();
    return point < given ? skin.points[skin.pointOf[point]] : X[point - given];
}

}  // namespace

std::vector<PlaceOnSkin> placesOf(const SkinTopology& skin, std::span<const SkinCut::Part> parts,
                                  const std::function<bool(std::uint32_t place)>& isWanted)
{
    std::vector<PlaceOnSkin> places;
    std::vector<std::uint32_t> ends;
    for (const auto& [triangle, corner] : parts)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t place = skin.triangles[triangle][k];
            const auto given = std::ranges::find_if(
                corner, [&](std::uint32_t c) { return c < skin.pointOf.size() && skin.pointOf[c] == place; });
            if (given == corner.end() || !isWanted(place)) continue;
            places.push_back({place, true, triangle, triangle, *given});
            for (const std::uint32_t e : {skin.edgeOf[triangle][k], skin.edgeOf[triangle][(k + 2) % 3]}) {
                if (skin.isSharp[e]) places.push_back({place, false, e, triangle, *given});
                if (skin.trianglesOf[e].size() == 1) ends.push_back(place);
            }
        }
    std::ranges::sort(places);
    std::vector<PlaceOnSkin> once;
    for (const PlaceOnSkin& p : places)
        if (once.empty() || once.back().place != p.place)
            once.push_back(p);
        else if (!p.isSmooth && std::abs(skin.along(once.back().number).dot(skin.along(p.number))) < kSameFace)
            once.back().isCorner = true;
    std::ranges::sort(ends);
    for (PlaceOnSkin& p : once) p.isCorner = p.isCorner || std::ranges::binary_search(ends, p.place);
    return once;
}

void copyGiven(const SkinTopology& skin, std::span<const PlaceOnSkin> places, std::vector<SkinCut::Part>& parts,
               std::vector<SkinCut::Point>& points)
{
    const std::size_t given = skin.pointOf.size(), before = points.size();
    for (const PlaceOnSkin& p : places) points.push_back({skin.points[p.place], {}, p.number, !p.isSmooth, p.triangle});
    for (SkinCut::Part& part : parts)
        for (std::uint32_t& c : part.corner) {
            if (c >= given) continue;
            const auto at = std::ranges::lower_bound(places, skin.pointOf[c], {}, &PlaceOnSkin::place);
            if (at == places.end() || at->place != skin.pointOf[c]) continue;
            c = std::uint32_t(given + before + std::size_t(at - places.begin()));
        }
}

std::vector<Vec3> harmonic(const SkinTopology& skin, std::span<const SkinCut::Part> parts, std::span<const Vec3> X,
                           std::span<const std::uint8_t> isFree, std::vector<Vec3> shift, Weights weights)
{
    constexpr double kLeast = 1e-3;  // of a cotangent
    const std::size_t given = skin.pointOf.size();
    std::vector<std::uint32_t> unknown, number(shift.size(), kKnown);
    for (std::uint32_t i = 0; i < shift.size(); ++i)
        if (isFree[i]) number[i] = std::uint32_t(unknown.size()), unknown.push_back(i);
    if (unknown.empty()) return shift;
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::MatrixX3d sum = Eigen::MatrixX3d::Zero(Eigen::Index(unknown.size()), 3);
    const auto numberOf = [&](std::uint32_t point) { return point < given ? kKnown : number[point - given]; };
    const auto addEdge = [&](std::uint32_t i, std::uint32_t j, double weight) {
        const std::uint32_t row = numberOf(i), column = numberOf(j);
        if (row == kKnown) return;
        entries.emplace_back(row, row, weight);
        if (column != kKnown)
            entries.emplace_back(row, column, -weight);
        else if (j >= given)
            sum.row(row) += weight * shift[j - given].transpose();
    };
    for (const SkinCut::Part& part : parts) {
        const auto& c = part.corner;
        if (std::ranges::all_of(c, [&](std::uint32_t p) { return numberOf(p) == kKnown; })) continue;
        Vec3 weight = cotangents(placeOf(skin, X, c[0]), placeOf(skin, X, c[1]), placeOf(skin, X, c[2]));
        if (weights == Weights::positive) weight = weight.cwiseMax(kLeast);
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t i = c[(k + 1) % 3], j = c[(k + 2) % 3];
            addEdge(i, j, weight[int(k)]), addEdge(j, i, weight[int(k)]);
        }
    }
    Eigen::SparseMatrix<double> laplacian(sum.rows(), sum.rows());
    laplacian.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(laplacian);
    const Eigen::MatrixX3d solved = solver.solve(sum);
    if (solver.info() != Eigen::Success || !solved.allFinite()) return shift;
    for (std::uint32_t u = 0; u < unknown.size(); ++u) shift[unknown[u]] = solved.row(u).transpose();
    return shift;
}

const Vec3& placeOf(const SkinTopology& skin, std::span<const SkinCut::Point> points, std::uint32_t corner)
{
    const std::size_t given = skin.pointOf.size();
    return corner < given ? skin.points[skin.pointOf[corner]] : points[corner - given].X;
}

double outwardArea(const SkinTopology& skin, std::span<const SkinCut::Point> points, const SkinCut::Part& part)
{
    const auto at = [&](std::size_t k) -> const Vec3& { return placeOf(skin, points, part.corner[k]); };
    return (at(1) - at(0)).cross(at(2) - at(0)).dot(skin.normal[part.triangle]);
}

void dropInward(const SkinTopology& skin, std::span<const SkinCut::Point> points, std::vector<SkinCut::Part>& parts)
{
    std::erase_if(parts, [&](const SkinCut::Part& part) { return !(outwardArea(skin, points, part) > 0); });
}

}  // namespace vdbfrac::skin
