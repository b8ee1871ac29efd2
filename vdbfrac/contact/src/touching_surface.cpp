#include <vdbfrac/contact/touching_surface.h>

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/phi_sampler.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace vdbfrac::contact {

namespace {

using tetmesh::EmbeddedPoint;

/// Voxels that the cut may be off the surface.
constexpr double kOffSurface = 0.1;

Vec3 atRest(const EmbeddedPoint& point, const tetmesh::BodyMesh& mesh)
{
    Vec3 X = Vec3::Zero();
    for (std::size_t a = 0; a < 4; ++a) X += point.weight[a] * mesh.restPosition(point.node[a]);
    return X;
}

}  // namespace

void TouchingSurface::start(std::span<const core::Body> bodies, double gap)
{
    bodies_ = bodies;
    gap_ = gap;
    for (const core::Body& body : bodies) {
        own_.push_back(samplesOf(body));
        own_.back().first = memory_.size();
        memory_.resize(memory_.size() + own_.back().point.size());
    }
}

TouchingSurface::Own TouchingSurface::samplesOf(const core::Body& body) const
{
    const tetmesh::BodyMesh& mesh = *body.mesh;
    tetmesh::EmbeddedSurface surface = mesh.surface();
    const std::size_t count = surface.points.size();
    Own own;
    own.point = std::move(surface.points);
    own.key = std::move(surface.key);
    own.area.resize(count), own.reach.resize(count), own.rest.resize(count);
    std::vector<Vec3> X(count), normal(count, Vec3::Zero());
    parallelChunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) X[i] = atRest(own.point[i], mesh);
    });
    for (const auto& t : surface.triangles) {
        const Vec3 twice = (X[t[1]] - X[t[0]]).cross(X[t[2]] - X[t[0]]);
        for (std::uint32_t p : t) normal[p] += twice;
    }
    // The cut takes phi for linear along edges, and so cuts corners off round surfaces.
    const double farthest = kOffSurface * mesh.voxelSize();
    const auto phi = grid::cubicPhiSampler(body.phi);
    parallelChunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
        const std::span<Vec3> at = std::span(X).subspan(begin, end - begin),
                              out = std::span(normal).subspan(begin, end - begin);
        std::vector<double> value(at.size());
        phi(at, value);
        for (std::size_t i = 0; i < at.size(); ++i) {
            const double off = std::clamp(value[i], -farthest, farthest);
            own.area[begin + i] = out[i].norm() / 6;
            own.reach[begin + i] = -off;
            own.rest[begin + i] = {at[i], out[i].stableNormalized()};
            at[i] += (gap_ - off) * own.rest[begin + i].normal;
        }
        if (gap_ == 0) return;
        phi(at, value);
        for (std::size_t i = 0; i < at.size(); ++i) own.reach[begin + i] += std::clamp(value[i], 0., gap_);
    });
    return own;
}

void TouchingSurface::recut(const core::Body& body)
{
    isSettled_ = false;
    point_.clear();  // nodes are numbered anew
    const std::size_t b = std::size_t(&body - bodies_.data());
    const Own before = std::move(own_[b]);
    own_[b] = samplesOf(body);
    own_[b].first = before.first;
    std::unordered_map<std::uint64_t, std::uint32_t> numberOf;
    numberOf.reserve(before.key.size());
    for (std::uint32_t i = 0; i < before.key.size(); ++i) numberOf.emplace(before.key[i], i);
    std::vector<TouchMemory> memory(own_[b].key.size());
    for (std::size_t i = 0; i < memory.size(); ++i)
        if (const auto it = numberOf.find(own_[b].key[i]); it != numberOf.end())
            memory[i] = memory_[before.first + it->second];
    const auto first = memory_.begin() + std::ptrdiff_t(before.first);
    memory_.erase(first, first + std::ptrdiff_t(before.key.size()));
    memory_.insert(memory_.begin() + std::ptrdiff_t(before.first), memory.begin(), memory.end());
    for (std::size_t next = b + 1; next < own_.size(); ++next)
        own_[next].first = own_[next - 1].first + own_[next - 1].key.size();
}

void TouchingSurface::settle()
{
    if (isSettled_) return;
    isSettled_ = true;
    point_.clear(), area_.clear(), reach_.clear(), rest_.clear(), body_.clear();
    std::size_t nodes = 0;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        for (EmbeddedPoint p : own_[b].point) {
            for (std::uint32_t& n : p.node) n += bodies_[b].firstNode;
            point_.push_back(p);
        }
        area_.insert(area_.end(), own_[b].area.begin(), own_[b].area.end());
        reach_.insert(reach_.end(), own_[b].reach.begin(), own_[b].reach.end());
        rest_.insert(rest_.end(), own_[b].rest.begin(), own_[b].rest.end());
        body_.resize(point_.size(), std::uint16_t(b));
        nodes = std::max(nodes, bodies_[b].firstNode + bodies_[b].mesh->nodeCount());
    }
    collectShares(nodes);
}

void TouchingSurface::collectShares(std::size_t nodes)
{
    node_.clear(), start_.assign(1, 0), share_.clear();
    const Groups ofNode = groupItems(nodes, [&](const auto& add) {
        for (std::uint32_t i = 0; i < point_.size(); ++i)
            for (std::uint32_t n : point_[i].node) add(n, i);
    });
    for (std::uint32_t n = 0; n < nodes; ++n) {
        if (ofNode[n].empty()) continue;
        for (std::uint32_t i : ofNode[n])
            for (std::size_t a = 0; a < 4; ++a)
                if (point_[i].node[a] == n) share_.push_back({i, point_[i].weight[a]});
        node_.push_back(n);
        start_.push_back(std::uint32_t(share_.size()));
    }
}

void TouchingSurface::addForces(std::span<const Vec3> force, std::span<Vec3> gradient) const
{
    parallelChunks(node_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) {
            Vec3 sum = Vec3::Zero();
            for (std::uint32_t s = start_[n]; s < start_[n + 1]; ++s) sum += share_[s].weight * force[share_[s].sample];
            gradient[node_[n]] -= sum;
        }
    });
}

void TouchingSurface::save(const std::string& name, core::Archive& archive) const
{
    std::vector<double> allowance;
    std::vector<Vec3> stretch;
    for (const TouchMemory& m : memory_) allowance.push_back(m.allowance), stretch.push_back(m.stretch);
    archive.put(name + ".allowance", allowance);
    archive.put(name + ".stretch", stretch);
}

void TouchingSurface::restoreFrom(const std::string& name, const core::Archive& archive)
{
    isSettled_ = false;
    point_.clear();
    for (std::size_t b = 0, first = 0; b < bodies_.size(); first += own_[b++].key.size()) {
        own_[b] = samplesOf(bodies_[b]);
        own_[b].first = first;
    }
    memory_.assign(own_.empty() ? 0 : own_.back().first + own_.back().key.size(), {});
    const auto allowance = archive.get<double>(name + ".allowance", memory_.size());
    const auto stretch = archive.get<Vec3>(name + ".stretch", memory_.size());
    for (std::size_t i = 0; i < memory_.size(); ++i) {
        if (!(allowance[i] >= 0 || allowance[i] == TouchMemory::kUnseen) || !std::isfinite(allowance[i]) ||
            !stretch[i].allFinite())
            archive.complain("what a sample of the surface keeps for " + name + " is out of range");
        memory_[i] = {allowance[i], stretch[i]};
    }
}

std::size_t TouchingSurface::bytes() const
{
    std::size_t own = 0;
    for (const Own& o : own_)
        own += o.point.capacity() * sizeof(EmbeddedPoint) + (o.area.capacity() + o.reach.capacity()) * sizeof(double) +
               o.key.capacity() * sizeof(std::uint64_t);
    return 2 * own + memory_.capacity() * sizeof(TouchMemory) + point_.capacity() * sizeof(EmbeddedPoint) +
           (area_.capacity() + reach_.capacity()) * sizeof(double) + body_.capacity() * sizeof(std::uint16_t) +
           (node_.capacity() + start_.capacity()) * sizeof(std::uint32_t) + share_.capacity() * sizeof(Share);
}

}  // namespace vdbfrac::contact
