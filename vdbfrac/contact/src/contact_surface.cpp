#include <vdbfrac/contact/contact_surface.h>

#include "near_points.h"

#include <vdbfrac/base/key_table.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/phi_sampler.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>

namespace vdbfrac::contact {

namespace {

using tetmesh::EmbeddedPoint;

/// By their first node: the tets of a cell of the lattice share it.
Groups clustersOf(std::span<const EmbeddedPoint> points)
{
    std::uint32_t last = 0;
    for (const EmbeddedPoint& p : points) last = std::max(last, p.node[0]);
    const Groups byNode = groupItems(last + 1, [&](const auto& add) {
        for (std::uint32_t i = 0; i < points.size(); ++i) add(points[i].node[0], i);
    });
    Groups clusters{{0}, byNode.item};
    for (std::size_t n = 0; n <= last; ++n)
        if (byNode.start[n + 1] > clusters.start.back()) clusters.start.push_back(byNode.start[n + 1]);
    return clusters;
}

}  // namespace

void ContactSurface::start(std::span<const core::Body> bodies, double gap, bool closesLips)
{
    bodies_ = bodies;
    sampling_.gap = gap, sampling_.closesLips = closesLips;
    findPlaces(), takeSamples();
}

void ContactSurface::findPlaces()
{
    places_.assign(bodies_.size(), {});
    if (!sampling_.keepsEdges) return;
    for (std::size_t b = 0; b < bodies_.size(); ++b) places_[b] = sharpPlaces(bodies_[b]);
}

/// Of the bodies as they are; nobody has looked at any of them.
void ContactSurface::takeSamples()
{
    isSettled_ = false;
    all_ = {};
    own_.clear();
    for (std::size_t b = 0; b < bodies_.size(); ++b)
        own_.push_back(resample(bodies_[b], sampling_, places_[b], {}).samples);
    memory_.assign(firstOf(own_.size()), {});
}

void ContactSurface::leave()
{
    isSettled_ = false;
    all_ = {};
    own_.clear(), memory_.clear();
}

void ContactSurface::bury(double depth)
{
    if (bodies_.size() < 2) return;
    settle();
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        const auto phi = grid::phiSampler(bodies_[b].phi);
        for (std::size_t i = 0; i < size(); ++i)
            if (body(i) != b && phi(restPosition(i)) < -depth) memory_[i].allowance = SampleMemory::kBuried;
    }
}

std::size_t ContactSurface::firstOf(std::size_t body) const
{
    std::size_t first = 0;
    for (std::size_t b = 0; b < body; ++b) first += own_[b].point.size();
    return first;
}

void ContactSurface::recut(const core::Body& body)
{
    if (own_.empty()) return;
    isSettled_ = false;
    all_ = {};  // nodes are numbered anew
    const std::size_t b = std::size_t(&body - bodies_.data());
    const auto first = memory_.begin() + std::ptrdiff_t(firstOf(b)),
               last = first + std::ptrdiff_t(own_[b].point.size());
    Resampled now = resample(body, sampling_, places_[b], own_[b]);
    std::vector<SampleMemory> memory(now.before.size());
    for (std::size_t i = 0; i < memory.size(); ++i)
        if (now.before[i] != KeyTable::kNone) memory[i] = first[now.before[i]];
    memory_.insert(memory_.erase(first, last), memory.begin(), memory.end());
    own_[b] = std::move(now.samples);
}

void ContactSurface::settle()
{
    if (isSettled_) return;
    if (own_.empty()) takeSamples();
    isSettled_ = true;
    all_ = {};
    probe_.clear(), body_.clear(), fragment_.clear(), ofNode_.clear();
    const auto append = [](auto& all, const auto& own) { all.insert(all.end(), own.begin(), own.end()); };
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        append(ofNode_, bodies_[b].fragments.ofNode());
        for (EmbeddedPoint p : own_[b].point) {
            fragment_.push_back(bodies_[b].fragments.ofNode()[p.node[0]]);
            for (std::uint32_t& n : p.node) n += bodies_[b].firstNode;
            all_.point.push_back(p);
        }
        const auto first = std::uint32_t(all_.area.size());
        for (const Samples::Edge& e : own_[b].edge) all_.edge.push_back({first + e[0], first + e[1]});
        for (Sharp s : own_[b].sharp) {
            s.sample += first;
            for (std::uint32_t& c : s.corner) c += first;
            s.point = all_.point[s.sample];
            all_.sharp.push_back(s);
        }
        append(all_.area, own_[b].area);
        append(all_.reach, own_[b].reach);
        append(all_.rest, own_[b].rest);
        append(all_.isTorn, own_[b].isTorn);
        append(all_.lip, own_[b].lip);
        for (std::size_t i = all_.lip.size() - own_[b].lip.size(); i < all_.lip.size(); ++i)
            for (std::uint32_t& n : all_.lip[i].below.node) n += bodies_[b].firstNode;
        body_.resize(size(), std::uint16_t(b));
    }
    isOneFragment_ = std::ranges::adjacent_find(ofNode_, std::ranges::not_equal_to()) == ofNode_.end();
    cluster_ = clustersOf(all_.point);
}

void ContactSurface::placeOnEdges(std::span<const Vec3> x)
{
    constexpr double kStrained = 1.5;  // times as far from its triangle as at rest, beyond what that is stretched by
    const auto middle = [](const auto& corner) { return Vec3((corner(0) + corner(1) + corner(2)) / 3); };
    const auto size = [&](const auto& corner) {
        double most = 0;
        for (int k : {0, 1, 2}) most = std::max(most, (corner(k) - corner((k + 1) % 3)).norm());
        return most;
    };
    for (Sharp& s : all_.sharp) {
        const auto rest = [&](int k) { return restPosition(s.corner[std::size_t(k)]); };
        const auto now = [&](int k) { return at(s.corner[std::size_t(k)], x); };
        const double far = (restPosition(s.sample) - middle(rest)).norm(),
                     stretch = std::max(1., size(now) / size(rest));
        s.isStrained = !((s.point.at(x) - middle(now)).norm() <= kStrained * stretch * far);
        all_.point[s.sample] = s.isStrained ? all_.point[s.corner[0]] : s.point;
        if (s.isStrained) memory_[s.sample] = {};
    }
}

void ContactSurface::forgetStrained()
{
    for (const Sharp& s : all_.sharp)
        if (s.isStrained) memory_[s.sample] = {};
}

double ContactSurface::farthestProbe() const
{
    double most = 0;
    for (std::size_t i = 0; i < all_.lip.size(); ++i) most = std::max(most, lipGap(i));
    return most;
}

void ContactSurface::aimProbes(std::span<const Vec3> x)
{
    probe_.resize(all_.lip.size());
    parallelChunks(probe_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            probe_[i] = all_.lip[i].gap * (at(i, x) - all_.lip[i].below.at(x)).stableNormalized();
    });
}

void ContactSurface::save(const std::string& name, core::Archive& archive) const
{
    std::vector<double> allowance, depth, reach;
    std::vector<Vec3> stretch, place;
    std::vector<std::uint64_t> key;
    std::vector<std::int64_t> places;
    for (const SampleMemory& m : memory_)
        allowance.push_back(m.allowance), stretch.push_back(m.stretch), depth.push_back(m.depth);
    for (const Samples& own : own_) reach.insert(reach.end(), own.reach.begin(), own.reach.end());
    for (const SharpPlaces& p : places_) {
        places.push_back(std::int64_t(p.key.size()));
        key.insert(key.end(), p.key.begin(), p.key.end());
        place.insert(place.end(), p.at.begin(), p.at.end());
    }
    archive.put(name + ".allowance", allowance);
    archive.put(name + ".depth", depth);
    archive.put(name + ".stretch", stretch);
    archive.put(name + ".reach", reach);
    archive.put(name + ".sharp_places", places);
    archive.put(name + ".sharp_key", key);
    archive.put(name + ".sharp_at", place);
}

void ContactSurface::restorePlaces(const std::string& name, const core::Archive& archive)
{
    const auto places = archive.get<std::int64_t>(name + ".sharp_places", bodies_.size());
    const auto key = archive.get<std::uint64_t>(name + ".sharp_key");
    const auto at = archive.get<Vec3>(name + ".sharp_at", key.size());
    places_.assign(bodies_.size(), {});
    std::size_t first = 0;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        const auto count = std::size_t(places[b]);
        if (count > key.size() - first) archive.complain("places of sharp edges for " + name + " are missing");
        for (std::size_t i = first; i < first + count; ++i) {
            if (!at[i].allFinite()) archive.complain("a sharp edge for " + name + " is out of range");
            places_[b].key.push_back(key[i]), places_[b].at.push_back(at[i]);
        }
        first += count;
    }
    if (first != key.size()) archive.complain("sharp edges for " + name + " are of no body");
}

void ContactSurface::restoreFrom(const std::string& name, const core::Archive& archive, bool keepsReaches)
{
    restorePlaces(name, archive);
    const bool wasAway = sampling_.keepsEdges && archive.get<double>(name + ".allowance").empty();
    wasAway ? leave() : takeSamples();
    const auto allowance = archive.get<double>(name + ".allowance", memory_.size());
    const auto depth = archive.get<double>(name + ".depth", memory_.size());
    const auto stretch = archive.get<Vec3>(name + ".stretch", memory_.size());
    const auto reach = archive.get<double>(name + ".reach", memory_.size());
    std::size_t i = 0;
    for (Samples& own : own_)
        for (double& r : own.reach) {
            if (!(allowance[i] >= 0 || allowance[i] == SampleMemory::kUnseen) || !(depth[i] >= 0) ||
                !stretch[i].allFinite() || !std::isfinite(reach[i]))
                archive.complain("what a sample of the surface keeps for " + name + " is out of range");
            memory_[i] = {allowance[i], stretch[i], depth[i]};
            if (keepsReaches) r = reach[i];
            ++i;
        }
}

void ContactSurface::refineFrom(const std::string& name, const core::Refinement& wide)
{
    constexpr double kFaces = 0.5;  // cosine between normals of one and the same surface
    ContactSurface before;
    before.sampling_ = sampling_, before.sampling_.closesLips = false;
    before.bodies_ = wide.bodies;
    before.restoreFrom(name, wide.archive);
    before.settle();
    findPlaces(), takeSamples();
    settle();
    const double near = 2 * wide.bodies[0].phi.voxelSize();  // m; samples of the wide surface lie a voxel apart
    // Of k = beta E / h.
    const auto stiffer = [&](std::uint16_t b) {
        const core::Body &then = wide.bodies[b], &now = bodies_[b];
        return now.material.youngsModulus() / then.material.youngsModulus() * then.mesh->spacing() /
               now.mesh->spacing();
    };
    NearPoints<std::uint32_t> samples(near);
    for (std::uint32_t i = 0; i < before.size(); ++i) samples.add(before.restPosition(i), i);
    for (std::size_t i = 0; i < size(); ++i) {
        double least = near;
        samples.visitNear(restPosition(i), [&](std::uint32_t j) {
            const double distance = (before.restPosition(j) - restPosition(i)).norm();
            if (before.body(j) != body(i) || before.restNormal(j).dot(restNormal(i)) < kFaces || !(distance < least))
                return;
            least = distance, memory_[i] = before.memory(j);
        });
        memory_[i].stiffen(stiffer(body(i)));
    }
}

std::size_t ContactSurface::bytes() const
{
    std::size_t sum = all_.bytes() + cluster_.bytes() + memory_.capacity() * sizeof(SampleMemory) +
                      body_.capacity() * sizeof(std::uint16_t) +
                      (fragment_.capacity() + ofNode_.capacity()) * sizeof(std::uint32_t) +
                      probe_.capacity() * sizeof(Vec3);
    for (const Samples& own : own_) sum += own.bytes();
    for (const SharpPlaces& p : places_)
        sum += p.key.capacity() * sizeof(std::uint64_t) + p.at.capacity() * sizeof(Vec3);
    return sum;
}

}  // namespace vdbfrac::contact
