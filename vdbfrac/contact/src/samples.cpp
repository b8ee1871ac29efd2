#include <vdbfrac/contact/samples.h>

#include "sharp_edges.h"

#include <vdbfrac/base/key_table.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/phi_sampler.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <functional>
#include <limits>
#include <span>
#include <utility>

namespace vdbfrac::contact {

namespace {

using tetmesh::EmbeddedPoint;
using tetmesh::EmbeddedSurface;
using Corners = std::array<std::uint32_t, 3>;

/// Voxels that the cut may be off the surface.
constexpr double kOffSurface = 0.1;

/// Of a triangle, from those of its corners in any order.
std::uint64_t keyOf(const Corners& t, std::span<const std::uint64_t> key)
{
    constexpr std::uint64_t kSpread = 0x9E3779B97F4A7C15;
    std::uint64_t sum = 0;
    for (const std::uint32_t p : t) sum += (key[p] * kSpread) ^ (key[p] * kSpread >> 32);
    return kSpread * sum;
}

/// Of points of the cut [m].
std::vector<Vec3> atRest(std::span<const EmbeddedPoint> points, const tetmesh::BodyMesh& mesh)
{
    std::vector<Vec3> X(points.size(), Vec3::Zero());
    parallelChunks(X.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            for (std::size_t a = 0; a < 4; ++a) X[i] += points[i].weight[a] * mesh.restPosition(points[i].node[a]);
    });
    return X;
}

std::vector<std::uint8_t> tornPoints(const EmbeddedSurface& surface)
{
    std::vector<std::uint8_t> isTorn(surface.points.size(), 0);
    for (std::size_t f = 0; f < surface.triangles.size(); ++f)
        for (const std::uint32_t p : surface.triangles[f]) isTorn[p] |= surface.torn[f];
    return isTorn;
}

/// At X [m] at rest, in the tet of one of some points that it lies in, or is least far outside of.
EmbeddedPoint inTetOf(std::span<const std::uint32_t> some, std::span<const EmbeddedPoint> points, const Vec3& X,
                      const tetmesh::BodyMesh& mesh)
{
    EmbeddedPoint best;
    double least = std::numeric_limits<double>::infinity();
    for (const std::uint32_t p : some) {
        std::array<Vec3, 4> corner;
        for (std::size_t a = 0; a < 4; ++a) corner[a] = mesh.restPosition(points[p].node[a]);
        const tetmesh::RestTet tet = tetmesh::restTet(points[p].node, corner);
        const EmbeddedPoint at = tet.embed(X);
        if (const double outside = tet.outside(at); outside < least) least = outside, best = at;
    }
    return best;
}

/// The sharp place of a triangle, if it has one. Beside a crack nothing holds what lies outside of the cut.
class PlacesOfTriangles {
public:
    PlacesOfTriangles(const SharpPlaces& places, const Samples& own) : places_(places), own_(own), rows_(places.key)
    {
        for (std::uint32_t i = 0; i < places.key.size(); ++i) rows_.add(i);
    }
    const Vec3* operator()(const Corners& t) const
    {
        if (places_.key.empty() || std::ranges::any_of(t, [&](std::uint32_t p) { return own_.isTorn[p] != 0; }))
            return nullptr;
        const std::uint32_t row = rows_.find(keyOf(t, own_.key));
        return row == KeyTable::kNone ? nullptr : &places_.at[row];
    }

private:
    const SharpPlaces& places_;
    const Samples& own_;
    KeyTable rows_;
};

/// Of the body that they are of, those that were there before.
std::vector<std::uint32_t> rowsOf(std::span<const std::uint64_t> now, std::span<const std::uint64_t> before)
{
    KeyTable rows(before);
    for (std::uint32_t i = 0; i < before.size(); ++i) rows.add(i);
    std::vector<std::uint32_t> found(now.size());
    parallelChunks(now.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) found[i] = rows.find(now[i]);
    });
    return found;
}

/// Reaches of samples, of which the first are points of the cut.
class Reaches {
public:
    Reaches(const core::Body& body, const Sampling& sampling, std::size_t ofCut)
        : phi_(grid::cubicPhiSampler(body.phi)),
          gap_(sampling.gap),
          farthest_(kOffSurface * body.phi.voxelSize()),
          ofCut_(ofCut)
    {
    }
    /// Of some samples.
    void find(std::span<const std::uint32_t> some, Samples& own) const
    {
        std::vector<Vec3> at;
        for (const std::uint32_t i : some) at.push_back(own.rest[i].at);
        std::vector<double> value(at.size());
        phi_(at, value);
        for (std::size_t k = 0; k < some.size(); ++k) {
            // The cut takes phi for linear along edges, and so cuts corners off round surfaces.
            const double off = some[k] < ofCut_ ? std::clamp(value[k], -farthest_, farthest_) : 0;
            own.reach[some[k]] = -off;
            at[k] += (gap_ - off) * own.rest[some[k]].normal;
        }
        if (gap_ == 0) return;
        phi_(at, value);
        for (std::size_t k = 0; k < some.size(); ++k) own.reach[some[k]] += std::clamp(value[k], 0., gap_);
    }

private:
    std::function<void(std::span<const Vec3>, std::span<double>)> phi_;
    double gap_, farthest_;  // m
    std::size_t ofCut_;
};

void findReaches(const Reaches& reaches, const Samples& before, std::span<const std::uint32_t> rows, Samples& own)
{
    const auto isAsBefore = [&](std::size_t i) {
        const std::uint32_t j = rows[i];
        return j != KeyTable::kNone && !own.isTorn[i] && !before.isTorn[j] && own.rest[i].at == before.rest[j].at &&
               own.rest[i].normal == before.rest[j].normal && (before.lip.empty() || before.lip[j].gap == 0);
    };
    own.reach.resize(own.rest.size());
    parallelChunks(own.rest.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> others;
        for (std::size_t i = begin; i < end; ++i) {
            if (isAsBefore(i))
                own.reach[i] = before.reach[rows[i]];
            else
                others.push_back(std::uint32_t(i));
        }
        reaches.find(others, own);
    });
}

/// Adds samples at sharp places, and areas, normals and edges of all.
void addTriangles(const EmbeddedSurface& surface, const SharpPlaces& places, const Sampling& sampling,
                  const tetmesh::BodyMesh& mesh, Samples& own)
{
    const PlacesOfTriangles placeOf(places, own);
    std::vector<Vec3> area(own.rest.size(), Vec3::Zero());  // six times
    for (const Corners& t : surface.triangles) {
        const auto X = [&](int k) -> const Vec3& { return own.rest[t[std::size_t(k)]].at; };
        const Vec3 twice = (X(1) - X(0)).cross(X(2) - X(0));
        const Vec3* const sharp = placeOf(t);
        for (const std::uint32_t p : t) {
            own.rest[p].normal += twice;
            if (!sharp) area[p] += twice;
        }
        // Closed and wound one way, the surface has each edge once from its lesser end.
        for (std::size_t k : {0, 1, 2})
            if (const Samples::Edge edge{t[k], t[(k + 1) % 3]}; sampling.keepsEdges && edge[0] < edge[1])
                own.edge.push_back(edge);
        if (!sharp) continue;
        own.sharp.push_back({std::uint32_t(own.point.size()), t});
        own.point.push_back(inTetOf(t, own.point, *sharp, mesh));
        own.key.push_back(keyOf(t, own.key)), own.isTorn.push_back(0);
        own.rest.push_back({*sharp, 3 * twice}), area.push_back(3 * twice);
    }
    for (const Vec3& six : area) own.area.push_back(six.norm() / 6);
    for (AtRest& r : own.rest) r.normal.stableNormalize();
}

}  // namespace

SharpPlaces sharpPlaces(const core::Body& body)
{
    const EmbeddedSurface surface = body.mesh->surface();
    SharpPlaces places;
    for (const EdgePoint& p : edgePoints(surface, atRest(surface.points, *body.mesh), tornPoints(surface), body.phi)) {
        places.key.push_back(keyOf(surface.triangles[p.triangle], surface.key));
        places.at.push_back(p.at);
    }
    return places;
}

Resampled resample(const core::Body& body, const Sampling& sampling, const SharpPlaces& places, const Samples& before)
{
    EmbeddedSurface surface = body.mesh->surface();
    Resampled now;
    Samples& own = now.samples;
    own.isTorn = tornPoints(surface);
    own.point = std::move(surface.points), own.key = std::move(surface.key);
    const std::size_t ofCut = own.point.size();
    for (const Vec3& X : atRest(own.point, *body.mesh)) own.rest.push_back({X, Vec3::Zero()});
    addTriangles(surface, places, sampling, *body.mesh, own);
    now.before = rowsOf(own.key, before.key);
    findReaches(Reaches(body, sampling, ofCut), before, now.before, own);
    if (!sampling.closesLips) return now;
    own.lip = lipsOf(body, own.rest);
    for (std::size_t i = 0; i < own.lip.size(); ++i)
        if (own.lip[i].gap > 0) own.reach[i] = 0;  // a gap is from cut to cut
    return now;
}

std::size_t Samples::bytes() const
{
    return point.capacity() * sizeof(EmbeddedPoint) + (area.capacity() + reach.capacity()) * sizeof(double) +
           rest.capacity() * sizeof(AtRest) + isTorn.capacity() + key.capacity() * sizeof(std::uint64_t) +
           lip.capacity() * sizeof(Lip) + edge.capacity() * sizeof(Edge) + sharp.capacity() * sizeof(Sharp);
}

}  // namespace vdbfrac::contact
