#include <vdbfrac/tetmesh/fragments.h>

#include <algorithm>
#include <map>
#include <numeric>

namespace vdbfrac::tetmesh {

namespace {

/// Connected sets of nodes: `component` of each node (numbered by least node) and the material volume of each.
struct Components {
    std::vector<std::uint32_t> component;
    std::vector<std::uint32_t> leastNode;
    std::vector<double> volume;
};

/// Nodes of one tet hang together. Copies of lattice nodes are shared exactly where material is, so components of
/// nodes are components of material.
std::vector<std::uint32_t> joinNodes(const CutMesh& mesh)
{
    std::vector<std::uint32_t> root(mesh.nodeCount());
    std::iota(root.begin(), root.end(), 0u);
    const auto find = [&](std::uint32_t v) {
        while (root[v] != v) v = root[v] = root[root[v]];
        return v;
    };
    for (const CellElement& e : mesh.elements()) {
        const CellTets& tets = cellTets(e.shape);
        for (int t = 0; t < tets.count; ++t) {
            if (e.fraction[std::size_t(t)] == 0) continue;
            const auto& corner = tets.corner[std::size_t(t)];
            std::uint32_t a = find(e.node[std::size_t(corner[0])]);
            for (std::size_t k = 1; k < 4; ++k) {
                const std::uint32_t b = find(e.node[std::size_t(corner[k])]);
                if (a != b) root[std::max(a, b)] = std::min(a, b);
                a = std::min(a, b);
            }
        }
    }
    for (std::uint32_t& r : root) r = find(r);
    return root;
}

Components components(const CutMesh& mesh)
{
    const std::vector<std::uint32_t> root = joinNodes(mesh);
    Components c;
    c.component.resize(root.size());
    for (std::size_t v = 0; v < root.size(); ++v) {
        if (root[v] == v) {
            c.component[v] = std::uint32_t(c.leastNode.size());
            c.leastNode.push_back(std::uint32_t(v));
        } else
            c.component[v] = c.component[root[v]];
    }
    c.volume.assign(c.leastNode.size(), 0);
    for (const CellElement& e : mesh.elements()) c.volume[c.component[e.node[0]]] += mesh.volume(e);
    return c;
}

/// Component numbers by falling volume; equal ones by least node.
std::vector<std::uint32_t> bySize(const Components& c)
{
    std::vector<std::uint32_t> order(c.volume.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return c.volume[a] > c.volume[b]; });
    return order;
}

}  // namespace

FragmentTracker::FragmentTracker(const CutMesh& mesh, std::uint32_t& nextId)
{
    const Components found = components(mesh);
    std::vector<std::uint32_t> id(found.volume.size());
    for (std::uint32_t c : bySize(found)) {
        id[c] = nextId++;
        fragments_.push_back({id[c], -1, 0, found.volume[c]});
    }
    for (std::uint32_t c : found.component) ofNode_.push_back(id[c]);
}

void FragmentTracker::update(const CutMesh& mesh, std::span<const std::uint32_t> previousNode, double time, std::uint32_t& nextId)
{
    const Components found = components(mesh);
    std::map<std::uint32_t, std::size_t> index;  // of a fragment by id
    for (std::size_t i = 0; i < fragments_.size(); ++i) index[fragments_[i].id] = i;
    for (Fragment& f : fragments_) f.restVolume = 0;

    std::vector<bool> taken(fragments_.size());
    std::vector<std::uint32_t> id(found.volume.size());
    for (std::uint32_t c : bySize(found)) {
        const std::uint32_t old = ofNode_[previousNode[found.leastNode[c]]];
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
    for (std::uint32_t c : found.component) ofNode_.push_back(id[c]);
}

std::size_t FragmentTracker::alive() const
{
    return std::size_t(std::count_if(fragments_.begin(), fragments_.end(), [](const Fragment& f) { return f.restVolume > 0; }));
}

}  // namespace vdbfrac::tetmesh
