#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/fragments.h>

#include <algorithm>
#include <map>

namespace vdbfrac::tetmesh {

namespace {

/// Connected sets of nodes: `component` of each node (numbered by least node) and the material volume of each.
struct Components {
    std::vector<std::uint32_t> component;
    std::vector<std::uint32_t> minNode;
    std::vector<double> volume;
};

bool holdsAllTets(const CellElement& e)
{
    return std::all_of(e.fraction.begin(), e.fraction.begin() + cellTets(e.shape).count,
                       [](double f) { return f != 0; });
}

void joinTets(DisjointSets& sets, const CellElement& e)
{
    const CellTets& tets = cellTets(e.shape);
    for (int t = 0; t < tets.count; ++t) {
        if (e.fraction[std::size_t(t)] == 0) continue;
        const auto& corner = tets.corner[std::size_t(t)];
        std::uint32_t r = sets.find(e.node[std::size_t(corner[0])]);
        for (std::size_t k = 1; k < 4; ++k) r = sets.joinTo(r, e.node[std::size_t(corner[k])]);
    }
}

/// Nodes of one tet hang together. Copies of lattice nodes are shared exactly where material is, so components of
/// nodes are components of material.
std::vector<std::uint32_t> joinNodes(const BodyMesh& mesh)
{
    DisjointSets sets(mesh.nodeCount());
    for (const CellElement& e : mesh.elements()) {
        if (!holdsAllTets(e)) {
            joinTets(sets, e);
            continue;
        }
        std::uint32_t r = sets.find(e.node[0]);
        for (std::size_t c = 1; c < kCorners; ++c) r = sets.joinTo(r, e.node[c]);
    }
    return std::move(sets).names();
}

/// Material volumes [m^3] of the components, each added up by rising element.
std::vector<double> volumes(const BodyMesh& mesh, const std::vector<std::uint32_t>& component, std::size_t count)
{
    const auto& elements = mesh.elements();
    std::vector<double> ofElement(elements.size());
    parallelChunks(elements.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t e = begin; e < end; ++e) ofElement[e] = mesh.volume(elements[e]);
    });
    std::vector<double> sum(count, 0);
    if (count == 1) {  // no need to ask
        for (double v : ofElement) sum[0] += v;
        return sum;
    }
    for (std::size_t e = 0; e < elements.size(); ++e) sum[component[elements[e].node[0]]] += ofElement[e];
    return sum;
}

Components components(const BodyMesh& mesh)
{
    const std::vector<std::uint32_t> root = joinNodes(mesh);
    Components c;
    c.component.resize(root.size());
    for (std::size_t v = 0; v < root.size(); ++v) {
        if (root[v] == v) {
            c.component[v] = std::uint32_t(c.minNode.size());
            c.minNode.push_back(std::uint32_t(v));
        } else
            c.component[v] = c.component[root[v]];
    }
    c.volume = volumes(mesh, c.component, c.minNode.size());
    return c;
}

/// Component numbers by falling volume; equal ones by least node.
std::vector<std::uint32_t> bySize(const Components& c)
{
    std::vector<std::uint32_t> order(c.volume.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return c.volume[a] > c.volume[b]; });
    return order;
}

}  // namespace

FragmentTracker::FragmentTracker(const BodyMesh& mesh, std::uint32_t& nextId)
{
    const Components found = components(mesh);
    std::vector<std::uint32_t> id(found.volume.size());
    for (std::uint32_t c : bySize(found)) {
        id[c] = nextId++;
        fragments_.push_back({id[c], -1, 0, found.volume[c]});
    }
    ofNode_.reserve(found.component.size());
    for (std::uint32_t c : found.component) ofNode_.push_back(id[c]);
}

void FragmentTracker::update(const BodyMesh& mesh, std::span<const std::uint32_t> previousNode, double time,
                             std::uint32_t& nextId)
{
    const Components found = components(mesh);
    std::map<std::uint32_t, std::size_t> index;  // of a fragment by id
    for (std::size_t i = 0; i < fragments_.size(); ++i) index[fragments_[i].id] = i;
    for (Fragment& f : fragments_) f.restVolume = 0;

    std::vector<bool> taken(fragments_.size());
    std::vector<std::uint32_t> id(found.volume.size());
    for (std::uint32_t c : bySize(found)) {
        const std::uint32_t old = ofNode_[previousNode[found.minNode[c]]];
        const std::size_t parent = index.at(old);
        if (!taken[parent]) {  // the largest part keeps the id
            taken[parent] = true;
            id[c] = old;
            fragments_[parent].restVolume = found.volume[c];
        } else {
            id[c] = nextId++;
            fragments_.push_back({id[c], std::int64_t(old), time, found.volume[c]});
        }
    }
    ofNode_.clear();
    ofNode_.reserve(found.component.size());
    for (std::uint32_t c : found.component) ofNode_.push_back(id[c]);
}

std::size_t FragmentTracker::alive() const
{
    return std::size_t(
        std::count_if(fragments_.begin(), fragments_.end(), [](const Fragment& f) { return f.restVolume > 0; }));
}

}  // namespace vdbfrac::tetmesh
