#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/cut_mesh.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace vdbfrac::tetmesh {

namespace {

constexpr std::size_t kCellChunk = 256;

int floorDiv(int a, int m) { return a >= 0 ? a / m : -((m - 1 - a) / m); }
int ceilDiv(int a, int m) { return -floorDiv(-a, m); }

/// Calls visit(c) for every integer coordinate of the box.
template <class Visit>
void forBox(Coord lower, Coord upper, const Visit& visit)
{
    for (int z = lower.z; z <= upper.z; ++z)
        for (int y = lower.y; y <= upper.y; ++y)
            for (int x = lower.x; x <= upper.x; ++x) visit(Coord{x, y, z});
}

/// Calls visit(cell) for each lattice cell whose closed box holds the voxel node.
template <class Visit>
void forCellsRound(Coord voxel, int m, const Visit& visit)
{
    forBox({ceilDiv(voxel.x, m) - 1, ceilDiv(voxel.y, m) - 1, ceilDiv(voxel.z, m) - 1},
           {floorDiv(voxel.x, m), floorDiv(voxel.y, m), floorDiv(voxel.z, m)}, visit);
}

Coord cornerOf(Coord cell, int c) { return cell + Coord{c & 1, c >> 1 & 1, c >> 2 & 1}; }

/// All coordinates that were set in a mark field, in the field's fixed order.
std::vector<Coord> markedCoords(const NodeField<std::int32_t>& marks)
{
    std::vector<Coord> coords;
    marks.forEachBlock([&](Coord low) {
        forBox(low, low + Coord{7, 7, 7}, [&](Coord c) {
            if (marks(c) >= 0) coords.push_back(c);
        });
    });
    return coords;
}

template <class T>
void sortUnique(std::vector<T>& v)
{
    std::sort(v.begin(), v.end());
    v.erase(std::unique(v.begin(), v.end()), v.end());
}

}  // namespace

CutMesh::CutMesh(Lattice lattice, NodeField<float> phi) : lattice_(lattice), phi_(std::move(phi)), rest_(phi_)
{
    assert(lattice_.coarsening >= 1 && (lattice_.kind == Lattice::Kind::six || lattice_.coarsening == 1));
    for (CellShape shape : {CellShape::six, CellShape::fiveEven, CellShape::fiveOdd})
        if ((shape == CellShape::six) == (lattice_.kind == Lattice::Kind::six))
            cellStencil_[std::size_t(shape)] = makeCellStencil(lattice_, shape);
    starStencil_ = {makeStarStencil(lattice_, false), makeStarStencil(lattice_, true)};
    findCells();
    findLatticeNodes();
    parallelChunks(cells_.size(), kCellChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) cutCell(cells_[i]);
    });
    std::vector<std::uint32_t> all(latticeNodes_.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = std::uint32_t(i);
    reclassify(all);
    numberNodes();
    gatherElements();
}

double CutMesh::seenPhi(Coord voxel) const
{
    const double value = phi_(voxel);
    return std::abs(value) < kSnap * lattice_.voxelSize ? 0. : value;
}

void CutMesh::findCells()
{
    const int m = lattice_.coarsening;
    const Coord lower = phi_.lower(), upper = phi_.upper();
    const Coord first{floorDiv(lower.x, m) - 1, floorDiv(lower.y, m) - 1, floorDiv(lower.z, m) - 1};
    const Coord last{floorDiv(upper.x, m) + 1, floorDiv(upper.y, m) + 1, floorDiv(upper.z, m) + 1};
    cellIndex_ = NodeField<std::int32_t>(first, last, -1, 0);
    phi_.forEachBlock([&](Coord low) {
        forBox(low, low + Coord{7, 7, 7}, [&](Coord voxel) {
            if (seenPhi(voxel) < 0) forCellsRound(voxel, m, [&](Coord cell) { cellIndex_.set(cell, 0); });
        });
    });
    std::vector<Coord> found = markedCoords(cellIndex_);
    sortByPatch(found);
    const Coord size = patchOf(last) + Coord{1, 1, 1};
    for (std::size_t i = 0; i < found.size(); ++i) {
        const Coord p = patchOf(found[i]);
        cellIndex_.set(found[i], std::int32_t(i));
        cells_.push_back(Cell{found[i], std::uint32_t((p.z * size.y + p.y) * size.x + p.x), true, 0, 0, {}});
    }
}

/// Blocks of 8^3 cells, counted from the box of phi: its place does not change while material goes.
Coord CutMesh::patchOf(Coord cell) const
{
    const int m = lattice_.coarsening;
    const Coord low = phi_.lower() + Coord{1, 1, 1};  // a layer below the lowest material voxel
    return {(cell.x - floorDiv(low.x, m)) >> 3, (cell.y - floorDiv(low.y, m)) >> 3, (cell.z - floorDiv(low.z, m)) >> 3};
}

void CutMesh::sortByPatch(std::vector<Coord>& coords) const
{
    std::sort(coords.begin(), coords.end(), [&](Coord a, Coord b) {
        const Coord pa = patchOf(a), pb = patchOf(b);
        return pa != pb ? pa < pb : a < b;
    });
}

void CutMesh::findLatticeNodes()
{
    latticeIndex_ = NodeField<std::int32_t>(cellIndex_.lower(), cellIndex_.upper() + Coord{1, 1, 1}, -1, 0);
    for (const Cell& cell : cells_)
        for (int c = 0; c < kCorners; ++c) latticeIndex_.set(cornerOf(cell.coord, c), 0);
    latticeNodes_ = markedCoords(latticeIndex_);
    sortByPatch(latticeNodes_);
    for (std::size_t i = 0; i < latticeNodes_.size(); ++i) latticeIndex_.set(latticeNodes_[i], std::int32_t(i));
    copies_.assign(latticeNodes_.size(), 0);
}

void CutMesh::cutCell(Cell& cell) const
{
    const CellStencil& stencil = cellStencil_[std::size_t(lattice_.shapeOf(cell.coord))];
    const Coord base = lattice_.coarsening * cell.coord;
    std::vector<double> phi(stencil.vertices.size());
    for (std::size_t v = 0; v < phi.size(); ++v) phi[v] = seenPhi(base + stencil.vertices[v]);

    cell.pieces.clear();
    cell.whole = std::all_of(phi.begin(), phi.end(), [](double p) { return p < 0; });
    if (cell.whole) return;
    for (std::size_t s = 0; s < stencil.subTets.size(); ++s) {
        std::array<Vec3, 4> vertex;
        std::array<double, 4> value{};
        for (std::size_t a = 0; a < 4; ++a) {
            vertex[a] = stencil.vertices[stencil.subTets[s].vertex[a]].toVec();
            value[a] = phi[stencil.subTets[s].vertex[a]];
        }
        const TetCut cut = cutTet(vertex, value);
        if (*std::min_element(value.begin(), value.end()) < 0) cell.pieces.push_back({std::uint16_t(s), 0, cut});
    }
}

CutMesh::NodeClasses CutMesh::classify(Coord node) const
{
    const StarStencil& star = starStencil_[std::size_t((node.x + node.y + node.z) & 1)];
    const Coord base = lattice_.coarsening * node;
    std::vector<std::int16_t> root(star.vertices.size(), -1);
    for (std::size_t v = 0; v < root.size(); ++v)
        if (seenPhi(base + star.vertices[v]) < 0) root[v] = std::int16_t(v);
    const auto find = [&](std::int16_t v) {
        while (root[std::size_t(v)] != v) v = root[std::size_t(v)] = root[std::size_t(root[std::size_t(v)])];
        return v;
    };
    // Two sub-tets that share a face with material share one of its inside vertices, and all sub-tets round an inside
    // vertex hang together by such faces: joining the inside vertices of each sub-tet joins exactly those sub-tets.
    for (const auto& tet : star.subTets) {
        std::int16_t first = -1;
        for (std::uint16_t v : tet) {
            if (root[v] < 0) continue;
            const std::int16_t r = find(std::int16_t(v));
            if (first < 0)
                first = r;
            else if (r != first) {
                root[std::size_t(std::max(r, first))] = std::min(r, first);
                first = std::min(r, first);
            }
        }
    }
    NodeClasses classes;
    classes.label.assign(root.size(), -1);
    for (std::size_t v = 0; v < root.size(); ++v) {
        if (root[v] < 0) continue;
        const std::size_t r = std::size_t(find(std::int16_t(v)));
        if (r == v) classes.label[v] = std::int16_t(classes.count++);  // roots are the least of their class
        classes.label[v] = classes.label[r];
    }
    return classes;
}

int CutMesh::classOf(Coord node, Coord voxel) const
{
    if (copies_[std::size_t(latticeIndex_(node))] < 2) return 0;
    const StarStencil& star = starStencil_[std::size_t((node.x + node.y + node.z) & 1)];
    return classes_.at(node).label[std::size_t(star.find(voxel - lattice_.coarsening * node))];
}

void CutMesh::reclassify(const std::vector<std::uint32_t>& latticeNodes)
{
    std::vector<NodeClasses> found(latticeNodes.size());
    parallelChunks(latticeNodes.size(), kCellChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Coord node = latticeNodes_[latticeNodes[i]];
            if (lattice_.coarsening == 1 && seenPhi(node) < 0)
                found[i].count = 1;  // every sub-tet of the star meets the node itself
            else
                found[i] = classify(node);
        }
    });
    for (std::size_t i = 0; i < latticeNodes.size(); ++i) {
        copies_[latticeNodes[i]] = std::uint16_t(found[i].count);
        const Coord node = latticeNodes_[latticeNodes[i]];
        if (found[i].count > 1)
            classes_[node] = std::move(found[i]);
        else
            classes_.erase(node);
    }
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

CellElement CutMesh::wholeElement(const Cell& cell) const
{
    CellElement element;
    element.shape = lattice_.shapeOf(cell.coord);
    element.patch = cell.patch;
    for (int t = 0; t < cellTets(element.shape).count; ++t) element.fraction[std::size_t(t)] = 1;
    for (int c = 0; c < kCorners; ++c) {
        const Coord node = cornerOf(cell.coord, c);
        element.node[std::size_t(c)] = nodeId(node, classOf(node, lattice_.coarsening * node));
    }
    return element;
}

std::vector<CellElement> CutMesh::groupPieces(Cell& cell) const
{
    constexpr std::uint32_t kAbsent = ~0u;
    const CellShape shape = lattice_.shapeOf(cell.coord);
    const CellStencil& stencil = cellStencil_[std::size_t(shape)];
    const int m = lattice_.coarsening;
    const double share = 1. / (m * m * m);

    std::vector<CellElement> groups;
    for (Piece& piece : cell.pieces) {
        const SubTet& sub = stencil.subTets[piece.subTet];
        Coord inside{};
        for (std::uint16_t v : sub.vertex)
            if (const Coord c = m * cell.coord + stencil.vertices[v]; seenPhi(c) < 0) inside = c;
        const auto& corner = cellTets(shape).corner[sub.parent];
        std::array<std::uint32_t, 4> id{};
        for (std::size_t a = 0; a < 4; ++a) {
            const Coord node = cornerOf(cell.coord, corner[a]);
            id[a] = nodeId(node, classOf(node, inside));
        }
        const auto agrees = [&](const CellElement& g) {
            bool shares = false;
            for (std::size_t a = 0; a < 4; ++a) {
                const std::uint32_t have = g.node[std::size_t(corner[a])];
                if (have != kAbsent && have != id[a]) return false;
                shares = shares || have == id[a];
            }
            return shares;
        };
        auto group = std::find_if(groups.begin(), groups.end(), agrees);
        if (group == groups.end()) {
            group = groups.insert(groups.end(), CellElement{});
            group->node.fill(kAbsent);
            group->shape = shape;
            group->patch = cell.patch;
        }
        for (std::size_t a = 0; a < 4; ++a) group->node[std::size_t(corner[a])] = id[a];
        group->fraction[sub.parent] += share * piece.cut.fraction;
        piece.element = std::uint16_t(group - groups.begin());
    }
    for (CellElement& g : groups) {
        const std::uint32_t some = *std::min_element(g.node.begin(), g.node.end());
        std::replace(g.node.begin(), g.node.end(), kAbsent, some);
        for (double& f : g.fraction) f = std::min(1., f);
    }
    return groups;
}

void CutMesh::gatherElements()
{
    std::vector<std::vector<CellElement>> grouped(cells_.size());
    parallelChunks(cells_.size(), kCellChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (!cells_[i].whole) grouped[i] = groupPieces(cells_[i]);
            cells_[i].elements = cells_[i].whole ? 1 : std::uint32_t(grouped[i].size());
        }
    });
    std::size_t count = 0;
    for (Cell& cell : cells_) {
        cell.firstElement = std::uint32_t(count);
        count += cell.elements;
    }
    elements_.resize(count);
    parallelChunks(cells_.size(), kCellChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (cells_[i].whole)
                elements_[cells_[i].firstElement] = wholeElement(cells_[i]);
            else
                std::copy(grouped[i].begin(), grouped[i].end(), elements_.begin() + cells_[i].firstElement);
        }
    });
}

std::vector<std::uint32_t> CutMesh::cellsTouching(const std::vector<Coord>& voxels) const
{
    std::vector<std::uint32_t> touched;
    for (Coord voxel : voxels)
        forCellsRound(voxel, lattice_.coarsening, [&](Coord cell) {
            if (const std::int32_t i = cellIndex_(cell); i >= 0) touched.push_back(std::uint32_t(i));
        });
    sortUnique(touched);
    return touched;
}

std::vector<std::uint32_t> CutMesh::latticeNodesTouching(const std::vector<Coord>& voxels) const
{
    const int m = lattice_.coarsening;
    std::vector<std::uint32_t> touched;
    for (Coord v : voxels)
        forBox({ceilDiv(v.x - m, m), ceilDiv(v.y - m, m), ceilDiv(v.z - m, m)},
               {floorDiv(v.x + m, m), floorDiv(v.y + m, m), floorDiv(v.z + m, m)}, [&](Coord node) {
                   const std::int32_t i = latticeIndex_(node);
                   if (i < 0) return;
                   const StarStencil& star = starStencil_[std::size_t((node.x + node.y + node.z) & 1)];
                   if (star.find(v - m * node) >= 0) touched.push_back(std::uint32_t(i));
               });
    sortUnique(touched);
    return touched;
}

std::vector<std::uint32_t> CutMesh::renumber(const std::vector<std::uint32_t>& dirty, const ClassMap& before)
{
    const std::vector<std::uint32_t> oldFirst = firstNode_;
    numberNodes();
    std::vector<std::uint32_t> previous(nodes_.size());
    for (std::size_t i = 0; i < latticeNodes_.size(); ++i)
        for (std::uint16_t k = 0; k < copies_[i]; ++k) previous[firstNode_[i] + k] = oldFirst[i] + k;
    for (std::uint32_t i : dirty) {
        const auto old = before.find(latticeNodes_[i]);
        if (old == before.end()) {  // there was one copy: all come from it
            for (std::uint16_t k = 0; k < copies_[i]; ++k) previous[firstNode_[i] + k] = oldFirst[i];
            continue;
        }
        const NodeClasses now = classify(latticeNodes_[i]);
        for (std::size_t v = 0; v < now.label.size(); ++v)
            if (now.label[v] >= 0)
                previous[firstNode_[i] + std::uint32_t(now.label[v])] = oldFirst[i] + std::uint32_t(old->second.label[v]);
    }
    return previous;
}

void CutMesh::dropEmptyCells()
{
    const auto empty = [](const Cell& cell) { return !cell.whole && cell.pieces.empty(); };
    if (std::none_of(cells_.begin(), cells_.end(), empty)) return;
    for (const Cell& cell : cells_)
        if (empty(cell)) cellIndex_.set(cell.coord, -1);
    std::erase_if(cells_, empty);
    for (std::size_t i = 0; i < cells_.size(); ++i) cellIndex_.set(cells_[i].coord, std::int32_t(i));
}

CutUpdate CutMesh::update(std::span<const std::pair<Coord, float>> newPhi)
{
    std::vector<Coord> changed, left;  // voxel nodes seen differently; those that are no longer material
    for (const auto& [voxel, value] : newPhi) {
        if (!phi_.contains(voxel)) continue;  // far outside: no cell of ours looks there
        const double before = seenPhi(voxel);
        phi_.set(voxel, value);
        const double now = seenPhi(voxel);
        assert(now >= before && "material never grows");
        if (now == before) continue;
        changed.push_back(voxel);
        if (before < 0 && now >= 0) left.push_back(voxel);
    }
    sortUnique(changed), sortUnique(left);  // a voxel may be listed twice
    CutUpdate update;
    update.changedVoxels = std::int64_t(changed.size());
    const std::vector<std::uint32_t> cells = cellsTouching(changed);
    const std::vector<std::uint32_t> dirty = latticeNodesTouching(left);
    update.cutCells = std::int64_t(cells.size());
    update.classifiedNodes = std::int64_t(dirty.size());
    update.topologyChanged = !left.empty();
    if (changed.empty()) {
        update.previousNode.resize(nodes_.size());
        std::iota(update.previousNode.begin(), update.previousNode.end(), 0u);
        return update;
    }

    parallelChunks(cells.size(), 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) cutCell(cells_[cells[i]]);
    });
    ClassMap before;
    for (std::uint32_t i : dirty)
        if (const auto it = classes_.find(latticeNodes_[i]); it != classes_.end()) before.insert(*it);
    reclassify(dirty);
    update.previousNode = renumber(dirty, before);
    dropEmptyCells();
    gatherElements();
    return update;
}

double CutMesh::volume(const CellElement& element) const
{
    const CellTets& tets = cellTets(element.shape);
    double sum = 0;
    for (int t = 0; t < tets.count; ++t) sum += tets.volume[std::size_t(t)] * element.fraction[std::size_t(t)];
    const double h = lattice_.spacing();
    return h * h * h * sum;
}

double CutMesh::volume() const
{
    return orderedSum(elements_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += volume(elements_[i]);
        return sum;
    });
}

}  // namespace vdbfrac::tetmesh
