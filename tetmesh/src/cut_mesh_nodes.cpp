// Copies of lattice nodes: which there are, and their ids.
#include "coord_ranges.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/cut_mesh.h>

#include <numeric>

namespace vdbfrac::tetmesh {

namespace {

constexpr std::size_t kNodeChunk = 64;

/// Vertices of a star that are material, and which of them hang together: the least of each class is its root.
class Roots {
public:
    explicit Roots(std::size_t vertices) : root_(vertices, -1) {}
    bool has(std::size_t v) const { return root_[v] >= 0; }
    void add(std::int32_t v)
    {
        if (!has(std::size_t(v))) root_[std::size_t(v)] = v;
    }
    std::int32_t find(std::int32_t v)
    {
        while (root_[std::size_t(v)] != v) v = root_[std::size_t(v)] = root_[std::size_t(root_[std::size_t(v)])];
        return v;
    }
    std::int32_t join(std::int32_t v, std::int32_t w)
    {
        v = find(v), w = find(w);
        return root_[std::size_t(std::max(v, w))] = std::min(v, w);
    }

private:
    std::vector<std::int32_t> root_;
};

/// Attached sub-tets hang together with those beside them by faces with material and no vertex inside.
void joinAttached(const StarStencil& star, std::span<const AttachedTet> attached, Roots& roots)
{
    struct Face {
        std::array<std::uint16_t, 3> vertex;
        std::int32_t material;  // a vertex that the sub-tet hangs together with
        bool attached;
        bool operator<(const Face& other) const { return vertex < other.vertex; }
    };
    std::vector<Face> faces;
    for (std::size_t i = 0; i < attached.size(); ++i) {
        const auto& tet = star.subTets[i].vertex;
        const auto isMaterial = [&](std::uint16_t v) { return roots.has(v); };
        const auto inside = std::find_if(tet.begin(), tet.end(), isMaterial);
        const bool cut = inside != tet.end();
        if (cut ? std::find_if(inside + 1, tet.end(), isMaterial) != tet.end() : attached[i].anchor < 0) continue;
        for (std::size_t a = 0; a < 4; ++a) {
            if (cut ? tet[a] != *inside : !(attached[i].faces >> a & 1)) continue;
            std::array<std::uint16_t, 3> face{tet[(a + 1) % 4], tet[(a + 2) % 4], tet[(a + 3) % 4]};
            std::sort(face.begin(), face.end());
            faces.push_back({face, cut ? *inside : attached[i].anchor, !cut});
        }
    }
    std::sort(faces.begin(), faces.end());
    for (std::size_t i = 1; i < faces.size(); ++i)
        if (faces[i].vertex == faces[i - 1].vertex && (faces[i].attached || faces[i - 1].attached))
            roots.join(faces[i].material, faces[i - 1].material);
}

}  // namespace

CutMesh::NodeClasses CutMesh::classify(Coord node) const
{
    const StarStencil& star = this->star(node);
    const Coord base = lattice_.coarsening * node;
    const std::vector<AttachedTet> attached = attachedTets(node);
    Roots roots(star.vertices.size());
    for (std::size_t v = 0; v < star.ofTets; ++v)
        if (seenPhi(base + star.vertices[v]) < 0) roots.add(std::int32_t(v));
    // Two sub-tets that share a face with material share one of its inside vertices, and all sub-tets round an inside
    // vertex hang together by such faces: joining the inside vertices of each sub-tet joins exactly those sub-tets.
    for (const auto& tet : star.subTets) {
        std::int32_t first = -1;
        for (std::uint16_t v : tet.vertex)
            if (roots.has(v)) first = first < 0 ? roots.find(v) : roots.join(first, v);
    }
    for (const AttachedTet& tet : attached)
        if (tet.anchor >= 0) roots.add(tet.anchor);
    if (!attached.empty()) joinAttached(star, attached, roots);
    NodeClasses classes;
    classes.label.assign(star.vertices.size(), -1);
    for (std::size_t v = 0; v < classes.label.size(); ++v) {
        if (!roots.has(v)) continue;
        const std::size_t r = std::size_t(roots.find(std::int32_t(v)));
        if (r == v) classes.label[v] = std::int32_t(classes.count++);  // roots are the least of their class
        classes.label[v] = classes.label[r];
    }
    return classes;
}

std::vector<CutMesh::Reclassified> CutMesh::reclassify(const std::vector<std::uint32_t>& latticeNodes)
{
    std::vector<Reclassified> found(latticeNodes.size());
    parallelChunks(latticeNodes.size(), kNodeChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Coord node = latticeNodes_[latticeNodes[i]];
            found[i].latticeNode = latticeNodes[i];
            if (lattice_.coarsening == 1 && seenPhi(node) < 0)
                found[i].now.count = 1;  // every sub-tet of the star meets the node itself
            else
                found[i].now = classify(node);
        }
    });
    for (Reclassified& f : found) {
        std::uint16_t& copies = copies_[f.latticeNode];
        if (copies > 1) {
            const auto it = classes_.find(f.latticeNode);
            f.before = std::move(it->second);
            classes_.erase(it);
        } else
            f.before.count = copies;
        copies = std::uint16_t(f.now.count);
        if (copies > 1) classes_.emplace(f.latticeNode, f.now);
    }
    return found;
}

void CutMesh::numberNodes()
{
    nodes_.clear();
    firstNode_.resize(latticeNodes_.size());
    for (std::size_t i = 0; i < latticeNodes_.size(); ++i) {
        firstNode_[i] = std::uint32_t(nodes_.size());
        nodes_.insert(nodes_.end(), copies_[i], latticeNodes_[i]);
    }
}

/// Between lattice nodes that were classified again, ids only shift: everything is done in runs.
CutMesh::Renumbering CutMesh::renumber(const std::vector<Reclassified>& changed)
{
    const std::size_t oldCount = nodes_.size();
    std::size_t newCount = oldCount;
    bool shifts = false;
    for (const Reclassified& c : changed) {
        newCount = newCount + std::size_t(c.now.count) - std::size_t(c.before.count);
        shifts = shifts || c.now.count != c.before.count;
    }
    Renumbering ids;
    ids.previous.resize(newCount);
    ids.now.resize(shifts ? oldCount : 0);
    std::vector<Coord> nodes;
    nodes.reserve(shifts ? newCount : 0);
    std::uint32_t oldNode = 0, newNode = 0;
    std::size_t next = 0;  // lattice node
    const auto shiftUpTo = [&](std::size_t end) {
        const std::uint32_t oldEnd = end < firstNode_.size() ? firstNode_[end] : std::uint32_t(oldCount);
        const std::uint32_t count = oldEnd - oldNode;
        std::iota(ids.previous.begin() + newNode, ids.previous.begin() + newNode + count, oldNode);
        if (shifts) {
            std::iota(ids.now.begin() + oldNode, ids.now.begin() + oldEnd, newNode);
            nodes.insert(nodes.end(), nodes_.begin() + oldNode, nodes_.begin() + oldEnd);
            for (; next < end; ++next) firstNode_[next] += newNode - oldNode;
        }
        oldNode = oldEnd, newNode += count, next = end;
    };
    for (const Reclassified& c : changed) {
        shiftUpTo(c.latticeNode);
        const auto own = ids.previous.begin() + newNode;
        if (c.before.label.empty())  // there was one copy: all come from it
            std::fill(own, own + c.now.count, oldNode);
        else
            for (std::size_t v = 0; v < c.now.label.size(); ++v)
                if (c.now.label[v] >= 0) own[c.now.label[v]] = oldNode + std::uint32_t(c.before.label[v]);
        if (shifts) nodes.insert(nodes.end(), std::size_t(c.now.count), latticeNodes_[c.latticeNode]);
        firstNode_[next++] = newNode;
        oldNode += std::uint32_t(c.before.count), newNode += std::uint32_t(c.now.count);
    }
    shiftUpTo(latticeNodes_.size());
    if (shifts) nodes_ = std::move(nodes);
    return ids;
}

}  // namespace vdbfrac::tetmesh
