#include "taken_skin.h"

#include "redivide.h"
#include "slider.h"

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/nearest_source.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <Eigen/Geometry>
#include <Eigen/Sparse>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace vdbfrac::skin {

namespace {

/// Points of the cut that what is kept has.
std::vector<std::uint8_t> rimPoints(const SkinCut& cut, std::uint32_t given)
{
    std::vector<std::uint8_t> isRim(cut.points.size(), 0);
    for (const SkinCut::Part& part : cut.parts)
        for (const std::uint32_t c : part.corner)
            if (c >= given) isRim[c - given] = 1;
    return isRim;
}

/// A place of the outer surface, and the sharp edge that it is on, or else a triangle.
struct PlaceOnSkin {
    std::uint32_t place = 0;
    bool isSmooth = false;
    std::uint32_t number = 0, triangle = 0;
    bool isCorner = false;  // sharp edges meet there
    auto operator<=>(const PlaceOnSkin&) const = default;
};

/// The places that parts in cracks have of the outer surface, rising.
std::vector<PlaceOnSkin> placesOf(const SkinTopology& skin, const SkinCut& cut)
{
    std::vector<PlaceOnSkin> places;
    for (const auto& [triangle, corner] : cut.taken)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t place = skin.triangles[triangle][k];
            if (std::ranges::none_of(
                    corner, [&](std::uint32_t c) { return c < skin.pointOf.size() && skin.pointOf[c] == place; }))
                continue;
            places.push_back({place, true, triangle, triangle});
            for (const std::uint32_t e : {skin.edgeOf[triangle][k], skin.edgeOf[triangle][(k + 2) % 3]})
                if (skin.isSharp[e]) places.push_back({place, false, e, triangle});
        }
    std::ranges::sort(places);
    std::vector<PlaceOnSkin> once;
    for (const PlaceOnSkin& p : places)
        if (once.empty() || once.back().place != p.place)
            once.push_back(p);
        else if (!p.isSmooth && std::abs(skin.along(once.back().number).dot(skin.along(p.number))) < kSameFace)
            once.back().isCorner = true;
    return once;
}

/// Gives the parts in cracks copies of the given points that they have, one of each of these places.
void copyGiven(const SkinTopology& skin, std::span<const PlaceOnSkin> places, SkinCut& cut)
{
    const auto given = std::uint32_t(skin.pointOf.size());
    const std::size_t before = cut.points.size();
    for (const PlaceOnSkin& p : places)
        cut.points.push_back({skin.points[p.place], {}, p.number, !p.isSmooth, p.triangle});
    for (SkinCut::Part& part : cut.taken)
        for (std::uint32_t& c : part.corner) {
            if (c >= given) continue;
            const auto at = std::ranges::lower_bound(places, skin.pointOf[c], {}, &PlaceOnSkin::place);
            c = std::uint32_t(given + before + std::size_t(at - places.begin()));
        }
}

/// Points of the cut, by the edges of the parts in cracks.
Groups linksOf(const SkinCut& cut, std::uint32_t given)
{
    return pointsBeside(cut.points.size(), [&](const auto& visit) {
        for (const SkinCut::Part& part : cut.taken)
            visit(std::array{part.corner[0] - given, part.corner[1] - given, part.corner[2] - given});
    });
}

/// Cotangents of a triangle's angles: weights of the edges opposite to them. One without area has edges alone.
Vec3 cotangents(const Vec3& a, const Vec3& b, const Vec3& c)
{
    constexpr double kFlat = 1e-6;  // of the square of an edge: area that is told from none
    const Vec3 p = b - a, q = c - b, r = a - c;
    const double area = p.cross(q).norm();
    if (!(area > kFlat * std::max({p.squaredNorm(), q.squaredNorm(), r.squaredNorm()}))) return Vec3::Ones();
    return Vec3(-p.dot(r), -p.dot(q), -q.dot(r)) / area;
}

/// A displacement of points `X` [m] that is harmonic on the parts in cracks, with what is given on rims: where rims
/// come together, what is between them comes to lie there too. Discretised with cotangents (Pinkall and Polthier
/// 1993), which is exact where the displacement is linear. `nearest`: the rim of each point, itself on a rim.
std::vector<Vec3> harmonic(const SkinCut& cut, std::uint32_t given, std::span<const Vec3> X,
                           std::span<const std::uint32_t> nearest, std::vector<Vec3> shift)
{
    std::vector<std::uint32_t> unknown, number(shift.size(), kNoSource);
    for (std::uint32_t i = 0; i < shift.size(); ++i)
        if (nearest[i] != kNoSource && nearest[i] != i) number[i] = std::uint32_t(unknown.size()), unknown.push_back(i);
    if (unknown.empty()) return shift;
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::MatrixX3d sum = Eigen::MatrixX3d::Zero(Eigen::Index(unknown.size()), 3);
    const auto addEdge = [&](std::uint32_t i, std::uint32_t j, double weight) {
        const std::uint32_t row = number[i];
        if (row == kNoSource) return;
        entries.emplace_back(row, row, weight);
        if (number[j] == kNoSource)
            sum.row(row) += weight * shift[j].transpose();
        else
            entries.emplace_back(row, number[j], -weight);
    };
    for (const SkinCut::Part& part : cut.taken) {
        const std::array<std::uint32_t, 3> c = {part.corner[0] - given, part.corner[1] - given, part.corner[2] - given};
        const Vec3 weight = cotangents(X[c[0]], X[c[1]], X[c[2]]);
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t i = c[(k + 1) % 3], j = c[(k + 2) % 3];
            addEdge(i, j, weight[int(k)]), addEdge(j, i, weight[int(k)]);
        }
    }
    Eigen::SparseMatrix<double> laplacian(sum.rows(), sum.rows());
    laplacian.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(laplacian);
    const Eigen::MatrixX3d solved = solver.solve(sum);
    // Needles may leave rounding alone.
    const bool isSolved = solver.info() == Eigen::Success && solved.allFinite();
    for (std::uint32_t u = 0; u < unknown.size(); ++u)
        shift[unknown[u]] = isSolved ? Vec3(solved.row(u).transpose()) : shift[nearest[unknown[u]]];
    return shift;
}

/// Does a part look inward, or nowhere? Where lips have passed each other it lies over others, which look outward.
bool looksInward(const SkinTopology& skin, const SkinCut& cut, const SkinCut::Part& part)
{
    const auto given = std::uint32_t(skin.pointOf.size());
    const auto at = [&](std::size_t k) -> const SkinCut::Point& { return cut.points[part.corner[k] - given]; };
    return !((at(1).X - at(0).X).cross(at(2).X - at(0).X).dot(skin.normal[part.triangle]) > 0);
}

}  // namespace

void fitTaken(const SkinTopology& skin, double dx, std::span<const SkinCut::Point> made, SkinCut& cut)
{
    const auto given = std::uint32_t(skin.pointOf.size());
    std::ranges::stable_sort(cut.taken, {}, &SkinCut::Part::triangle);
    std::vector<std::uint8_t> isRim = rimPoints(cut, given);
    const std::size_t before = cut.points.size();
    const std::vector<PlaceOnSkin> places = placesOf(skin, cut);
    copyGiven(skin, places, cut);
    isRim.resize(cut.points.size(), 0);
    const Groups links = linksOf(cut, given);
    const std::vector<std::uint32_t> nearest = nearestSources(links, isRim);
    for (std::size_t i = 0; i < cut.points.size(); ++i)
        if (!links[i].empty() && !isRim[i])
            cut.points[i].anchor = nearest[i] != kNoSource ? cut.points[nearest[i]].anchor
                                                           : tetmesh::floorOf(cut.points[i].X.array() / dx + .5);
    if (made.empty()) return;
    std::vector<Vec3> X(cut.points.size()), rimShift(cut.points.size(), Vec3::Zero());
    for (std::size_t i = 0; i < X.size(); ++i) X[i] = i < before ? made[i].X : cut.points[i].X;
    for (std::size_t i = 0; i < before; ++i)
        if (isRim[i]) rimShift[i] = cut.points[i].X - X[i];
    const std::vector<Vec3> shift = harmonic(cut, given, X, nearest, std::move(rimShift));
    const Slider slider(skin);
    for (std::size_t i = 0; i < cut.points.size(); ++i) {
        if (links[i].empty() || isRim[i]) continue;
        SkinCut::Point& point = cut.points[i];
        if (i < before) point.X = made[i].X, point.on = made[i].on;
        if (i < before || !places[i - before].isCorner) point.X = slider.closest(point, point.X + shift[i], point.on);
    }
    redivide(skin, cut.points, cut.taken);
    std::erase_if(cut.taken, [&](const SkinCut::Part& part) { return looksInward(skin, cut, part); });
}

}  // namespace vdbfrac::skin
