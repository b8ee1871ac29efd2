#include <vdbfrac/contact/contact_surface.h>

#include "near_points.h"
#include "sharp_edges.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/phi_sampler.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

namespace vdbfrac::contact {

namespace {

using tetmesh::EmbeddedPoint;

/// Makes a name of those of three corners.
constexpr std::uint64_t kOnEdge = 0x9E3779B97F4A7C15;
/// Voxels that the cut may be off the surface.
constexpr double kOffSurface = 0.1;

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

Vec3 atRest(const EmbeddedPoint& point, const tetmesh::BodyMesh& mesh)
{
    Vec3 X = Vec3::Zero();
    for (std::size_t a = 0; a < 4; ++a) X += point.weight[a] * mesh.restPosition(point.node[a]);
    return X;
}

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
    gap_ = gap, closesLips_ = closesLips;
    takeSamples();
}

/// Of the bodies as they are; nobody has looked at any of them.
void ContactSurface::takeSamples()
{
    isSettled_ = false;
    all_ = {};
    own_.clear();
    for (const core::Body& body : bodies_) own_.push_back(samplesOf(body));
    memory_.assign(firstOf(own_.size()), {});
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

ContactSurface::Samples ContactSurface::samplesOf(const core::Body& body) const
{
    const tetmesh::BodyMesh& mesh = *body.mesh;
    tetmesh::EmbeddedSurface surface = mesh.surface();
    const std::size_t ofCut = surface.points.size();
    Samples own;
    own.point = std::move(surface.points);
    own.key = std::move(surface.key);
    std::vector<Vec3> X(ofCut), normal(ofCut, Vec3::Zero()), area(ofCut, Vec3::Zero());  // six times
    parallelChunks(ofCut, kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) X[i] = atRest(own.point[i], mesh);
    });
    own.isTorn.assign(ofCut, 0);
    for (std::size_t f = 0; f < surface.triangles.size(); ++f)
        for (std::uint32_t p : surface.triangles[f]) own.isTorn[p] |= surface.torn[f];
    const std::vector<EdgePoint> onEdges =
        keepsEdges_ ? edgePoints(surface, X, own.isTorn, body.phi) : std::vector<EdgePoint>();
    own.isTorn.resize(ofCut + onEdges.size(), 0);
    auto onEdge = onEdges.begin();
    for (std::size_t f = 0; f < surface.triangles.size(); ++f) {
        const auto& t = surface.triangles[f];
        const Vec3 twice = (X[t[1]] - X[t[0]]).cross(X[t[2]] - X[t[0]]);
        const bool isSharp = onEdge != onEdges.end() && onEdge->triangle == f;
        if (isSharp) {
            own.sharp.push_back({std::uint32_t(X.size()), t});
            own.point.push_back(inTetOf(t, own.point, onEdge->at, mesh));
            own.key.push_back(kOnEdge * (own.key[t[0]] + own.key[t[1]] + own.key[t[2]]));
            X.push_back(onEdge->at), normal.push_back(3 * twice), area.push_back(3 * twice);
            ++onEdge;
        }
        for (std::uint32_t p : t) normal[p] += twice, area[p] += isSharp ? Vec3(Vec3::Zero()) : twice;
        // Closed and wound one way, the surface has each edge once from its lesser end.
        for (std::size_t k : {0, 1, 2})
            if (const Edge edge{t[k], t[(k + 1) % 3]}; keepsEdges_ && edge[0] < edge[1]) own.edge.push_back(edge);
    }
    if (closesLips_) {
        std::vector<Vec3> out(normal);
        for (Vec3& n : out) n.stableNormalize();
        own.lip = lipsOf(body, X, out);
    }
    for (const Vec3& six : area) own.area.push_back(six.norm() / 6);
    findReach(body, ofCut, std::move(X), normal, own);
    for (std::size_t i = 0; i < own.lip.size(); ++i)
        if (own.lip[i].gap > 0) own.reach[i] = 0;  // a gap is from cut to cut
    return own;
}

/// Reaches of samples at X at rest [m], with normals of any length; the first are points of the cut.
void ContactSurface::findReach(const core::Body& body, std::size_t ofCut, std::vector<Vec3> X,
                               std::span<const Vec3> normal, Samples& own) const
{
    own.reach.resize(X.size()), own.rest.resize(X.size());
    // The cut takes phi for linear along edges, and so cuts corners off round surfaces.
    const double farthest = kOffSurface * body.phi.voxelSize();
    const auto phi = grid::cubicPhiSampler(body.phi);
    parallelChunks(X.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        const std::span<Vec3> at = std::span(X).subspan(begin, end - begin);
        const std::span<const Vec3> out = normal.subspan(begin, end - begin);
        std::vector<double> value(at.size());
        phi(at, value);
        for (std::size_t i = 0; i < at.size(); ++i) {
            const double off = begin + i < ofCut ? std::clamp(value[i], -farthest, farthest) : 0;
            own.reach[begin + i] = -off;
            own.rest[begin + i] = {at[i], out[i].stableNormalized()};
            at[i] += (gap_ - off) * own.rest[begin + i].normal;
        }
        if (gap_ == 0) return;
        phi(at, value);
        for (std::size_t i = 0; i < at.size(); ++i) own.reach[begin + i] += std::clamp(value[i], 0., gap_);
    });
}

void ContactSurface::recut(const core::Body& body)
{
    isSettled_ = false;
    all_ = {};  // nodes are numbered anew
    const std::size_t b = std::size_t(&body - bodies_.data());
    const std::vector<std::uint64_t> before = std::move(own_[b].key);
    own_[b] = samplesOf(body);
    std::unordered_map<std::uint64_t, std::uint32_t> numberOf;
    numberOf.reserve(before.size());
    for (std::uint32_t i = 0; i < before.size(); ++i) numberOf.emplace(before[i], i);
    const auto first = memory_.begin() + std::ptrdiff_t(firstOf(b));
    std::vector<SampleMemory> memory(own_[b].key.size());
    for (std::size_t i = 0; i < memory.size(); ++i)
        if (const auto it = numberOf.find(own_[b].key[i]); it != numberOf.end()) memory[i] = first[it->second];
    memory_.insert(memory_.erase(first, first + std::ptrdiff_t(before.size())), memory.begin(), memory.end());
}

void ContactSurface::settle()
{
    if (isSettled_) return;
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
        for (const Edge& e : own_[b].edge) all_.edge.push_back({first + e[0], first + e[1]});
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
    std::vector<double> allowance, depth;
    std::vector<Vec3> stretch;
    for (const SampleMemory& m : memory_) {
        allowance.push_back(m.allowance), stretch.push_back(m.stretch), depth.push_back(m.depth);
    }
    archive.put(name + ".allowance", allowance);
    archive.put(name + ".depth", depth);
    archive.put(name + ".stretch", stretch);
}

void ContactSurface::restoreFrom(const std::string& name, const core::Archive& archive)
{
    takeSamples();
    const auto allowance = archive.get<double>(name + ".allowance", memory_.size());
    const auto depth = archive.get<double>(name + ".depth", memory_.size());
    const auto stretch = archive.get<Vec3>(name + ".stretch", memory_.size());
    for (std::size_t i = 0; i < memory_.size(); ++i) {
        if (!(allowance[i] >= 0 || allowance[i] == SampleMemory::kUnseen) || !(depth[i] >= 0) ||
            !stretch[i].allFinite())
            archive.complain("what a sample of the surface keeps for " + name + " is out of range");
        memory_[i] = {allowance[i], stretch[i], depth[i]};
    }
}

void ContactSurface::refineFrom(const std::string& name, const core::Refinement& wide)
{
    constexpr double kFaces = 0.5;  // cosine between normals of one and the same surface
    ContactSurface before;
    before.keepsEdges_ = keepsEdges_;
    before.start(wide.bodies, gap_);
    before.restoreFrom(name, wide.archive);
    before.settle();
    takeSamples();
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

std::size_t ContactSurface::Samples::bytes() const
{
    return point.capacity() * sizeof(EmbeddedPoint) + (area.capacity() + reach.capacity()) * sizeof(double) +
           rest.capacity() * sizeof(AtRest) + isTorn.capacity() + key.capacity() * sizeof(std::uint64_t) +
           lip.capacity() * sizeof(Lip) + edge.capacity() * sizeof(Edge) + sharp.capacity() * sizeof(Sharp);
}

std::size_t ContactSurface::bytes() const
{
    std::size_t sum = all_.bytes() + cluster_.bytes() + memory_.capacity() * sizeof(SampleMemory) +
                      body_.capacity() * sizeof(std::uint16_t) +
                      (fragment_.capacity() + ofNode_.capacity()) * sizeof(std::uint32_t) +
                      probe_.capacity() * sizeof(Vec3);
    for (const Samples& own : own_) sum += own.bytes();
    return sum;
}

}  // namespace vdbfrac::contact
