// Pieces of cut cells, put together to elements.
#include "coord_ranges.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/cut_mesh.h>

#include <cassert>
#include <cmath>
#include <numeric>

namespace vdbfrac::tetmesh {

namespace {

constexpr std::size_t kGroupChunk = 64;
constexpr std::uint32_t kAbsent = ~0u;

/// Does an element share a corner of a tet, and have no other copy of any?
bool agrees(const CellElement& element, const std::array<int, 4>& corner, const std::array<std::uint32_t, 4>& id)
{
    bool shares = false;
    for (std::size_t a = 0; a < 4; ++a) {
        const std::uint32_t have = element.node[std::size_t(corner[a])];
        if (have != kAbsent && have != id[a]) return false;
        shares = shares || have == id[a];
    }
    return shares;
}

/// The old elements of a cell, numbered from `first` on, that the tets of a new element were in.
std::array<std::uint32_t, kMaxTets> oldElements(const CellElement& element, std::span<const std::uint32_t> previousNode,
                                                std::span<const CellElement> before, std::uint32_t first)
{
    std::array<std::uint32_t, kMaxTets> old{};
    const CellTets& tets = cellTets(element.shape);
    for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
        if (element.fraction[t] == 0) continue;
        const auto had = std::find_if(before.begin(), before.end(), [&](const CellElement& e) {
            return e.fraction[t] > 0 && std::all_of(tets.corner[t].begin(), tets.corner[t].end(), [&](int c) {
                       return e.node[std::size_t(c)] == previousNode[element.node[std::size_t(c)]];
                   });
        });
        assert(had != before.end() && "material only goes");
        old[t] = first + std::uint32_t(had - before.begin());
    }
    return old;
}

}  // namespace

/// Adds the cells that have one of the lattice nodes as a corner; each is listed once then, in order.
void CutMesh::addCellsRound(const std::vector<std::uint32_t>& latticeNodes, std::vector<std::uint32_t>& cells) const
{
    for (std::uint32_t node : latticeNodes)
        forCellsRound(latticeNodes_[node], 1, [&](Coord cell) {
            if (const std::int32_t i = cellIndex_(cell); i >= 0) cells.push_back(std::uint32_t(i));
        });
    sortUnique(cells);
}

CellElement CutMesh::wholeElement(const Cell& cell) const
{
    CellElement element;
    element.shape = lattice_.shapeOf(cell.coord);
    element.patch = cell.patch;
    for (int t = 0; t < cellTets(element.shape).count; ++t) element.fraction[std::size_t(t)] = 1;
    for (int c = 0; c < kCorners; ++c) {
        const Coord node = cornerOf(cell.coord, c);
        const std::size_t i = std::size_t(latticeIndex_(node));
        const int copy =
            copies_[i] > 1 ? classes_.at(std::uint32_t(i)).label[std::size_t(star(node).find({0, 0, 0}))] : 0;
        element.node[std::size_t(c)] = firstNode_[i] + std::uint32_t(copy);
    }
    return element;
}

std::vector<std::uint32_t> CutMesh::elementsRound(const Vec3& X) const
{
    constexpr double kOnFace = 1e-6;  // of a cell
    const Vec3 low = X / spacing() - Vec3::Constant(kOnFace), high = X / spacing() + Vec3::Constant(kOnFace);
    const auto cellOf = [](const Vec3& p) {
        return Coord{int(std::floor(p.x())), int(std::floor(p.y())), int(std::floor(p.z()))};
    };
    std::vector<std::uint32_t> found;
    forBox(cellOf(low), cellOf(high), [&](Coord c) {
        if (const std::int32_t i = cellIndex_(c); i >= 0)
            for (std::uint32_t e = 0; e < cells_[std::size_t(i)].elements; ++e)
                found.push_back(cells_[std::size_t(i)].firstElement + e);
    });
    std::sort(found.begin(), found.end());
    return found;
}

/// Adds the elements of a cell that is not whole. `phi`: scratch.
void CutMesh::groupPieces(Cell& cell, std::vector<double>& phi, std::vector<CellElement>& elements) const
{
    const CellShape shape = lattice_.shapeOf(cell.coord);
    const CellStencil& stencil = cellStencil_[std::size_t(shape)];
    const int m = lattice_.coarsening;
    const double share = 1. / (m * m * m);
    struct Copies {
        std::uint32_t first;
        const NodeClasses* classes;  // null: one copy
        const StarStencil* star;
        Coord offset;  // of the cell's lowest voxel from the node
    };
    std::array<Copies, kCorners> copies;
    for (int c = 0; c < kCorners; ++c) {
        const Coord node = cornerOf(cell.coord, c);
        const std::uint32_t i = std::uint32_t(latticeIndex_(node));
        copies[std::size_t(c)] = {firstNode_[i], copies_[i] > 1 ? &classes_.at(i) : nullptr, &star(node),
                                  m * (cell.coord - node)};
    }
    seenPhi(m * cell.coord, stencil.vertices, phi);
    const std::size_t first = elements.size();
    for (Piece& piece : cell.pieces) {
        const SubTet& sub = stencil.subTets[piece.subTet];
        const auto in = std::find_if(sub.vertex.begin(), sub.vertex.end(), [&](std::uint16_t v) { return phi[v] < 0; });
        const Coord inside = in != sub.vertex.end() ? stencil.vertices[*in]
                                                    : sub.voxel + cornerOffset(anchorOf(m * cell.coord + sub.voxel));
        const auto& corner = cellTets(shape).corner[sub.parent];
        std::array<std::uint32_t, 4> id{};
        for (std::size_t a = 0; a < 4; ++a) {
            const Copies& c = copies[std::size_t(corner[a])];
            id[a] = c.first +
                    (c.classes ? std::uint32_t(c.classes->label[std::size_t(c.star->find(c.offset + inside))]) : 0u);
        }
        auto group = std::find_if(elements.begin() + std::ptrdiff_t(first), elements.end(),
                                  [&](const CellElement& e) { return agrees(e, corner, id); });
        if (group == elements.end()) {
            group = elements.insert(elements.end(), CellElement{});
            group->node.fill(kAbsent);
            group->shape = shape;
            group->patch = cell.patch;
        }
        for (std::size_t a = 0; a < 4; ++a) group->node[std::size_t(corner[a])] = id[a];
        group->fraction[sub.parent] += share * piece.cut.fraction;
        piece.element = std::uint16_t(group - elements.begin() - std::ptrdiff_t(first));
    }
    for (CellElement& e : std::span(elements).subspan(first)) {
        const std::uint32_t some = *std::min_element(e.node.begin(), e.node.end());
        std::replace(e.node.begin(), e.node.end(), kAbsent, some);
        for (double& f : e.fraction) f = std::min(1., f);
    }
}

CutMesh::Regrouped CutMesh::regroup(std::vector<std::uint32_t> cells)
{
    std::vector<std::vector<CellElement>> part((cells.size() + kGroupChunk - 1) / kGroupChunk);
    Regrouped all;
    all.first.resize(cells.size() + 1);
    parallelChunks(cells.size(), kGroupChunk, [&](std::size_t begin, std::size_t end) {
        std::vector<CellElement>& elements = part[begin / kGroupChunk];
        std::vector<double> phi;
        for (std::size_t i = begin; i < end; ++i) {
            const std::size_t before = elements.size();
            Cell& cell = cells_[cells[i]];
            if (cell.whole)
                elements.push_back(wholeElement(cell));
            else
                groupPieces(cell, phi, elements);
            all.first[i + 1] = std::uint32_t(elements.size() - before);
        }
    });
    std::partial_sum(all.first.begin(), all.first.end(), all.first.begin());
    all.elements.reserve(all.first.back());
    for (const auto& p : part) all.elements.insert(all.elements.end(), p.begin(), p.end());
    all.cells = std::move(cells);
    return all;
}

/// Before the new elements take their places.
PreviousElements CutMesh::previousElements(const Regrouped& regrouped,
                                           std::span<const std::uint32_t> previousNode) const
{
    PreviousElements result;
    std::uint32_t now = 0, old = 0;
    const auto keepUpTo = [&](std::uint32_t end) {
        if (end > old) result.kept.push_back({now, old, end - old});
        now += end - old, old = end;
    };
    for (std::size_t i = 0; i < regrouped.cells.size(); ++i) {
        const Cell& cell = cells_[regrouped.cells[i]];
        keepUpTo(cell.firstElement);
        const std::span before = std::span(elements_).subspan(old, cell.elements);
        for (std::uint32_t k = regrouped.first[i]; k < regrouped.first[i + 1]; ++k)
            result.recut.push_back({now++, oldElements(regrouped.elements[k], previousNode, before, old)});
        for (const CellElement& e : before) result.replaced.push_back({old++, e, {}});
    }
    keepUpTo(std::uint32_t(elements_.size()));
    return result;
}

/// Moves the elements of all other cells to where they belong now.
void CutMesh::makeRoom(const Regrouped& regrouped)
{
    struct Run {
        std::ptrdiff_t from, to, count;
    };
    std::vector<Run> runs;
    Run run{0, 0, 0};
    const auto close = [&](std::size_t end) {
        run.count = std::ptrdiff_t(end) - run.from;
        if (run.from != run.to && run.count > 0) runs.push_back(run);
        run.from += run.count, run.to += run.count;
    };
    for (std::size_t i = 0; i < regrouped.cells.size(); ++i) {
        const Cell& cell = cells_[regrouped.cells[i]];
        if (cell.elements == regrouped.first[i + 1] - regrouped.first[i]) continue;
        close(cell.firstElement);
        run.from += cell.elements, run.to += regrouped.first[i + 1] - regrouped.first[i];
    }
    close(elements_.size());
    const std::size_t count = std::size_t(run.to);
    elements_.resize(std::max(elements_.size(), count));
    // Runs keep their order, so those that move up are out of the way of all others when the last of them goes first.
    const auto begin = elements_.begin();
    for (auto r = runs.rbegin(); r != runs.rend(); ++r)
        if (r->to > r->from) std::move_backward(begin + r->from, begin + r->from + r->count, begin + r->to + r->count);
    for (const Run& r : runs)
        if (r.to < r.from) std::move(begin + r.from, begin + r.from + r.count, begin + r.to);
    elements_.resize(count);
}

/// From a cell on: drops those without elements, says where the elements of the others are.
void CutMesh::renumberCells(std::size_t begin)
{
    std::uint32_t element = begin > 0 ? cells_[begin - 1].firstElement + cells_[begin - 1].elements : 0;
    std::size_t to = begin;
    for (std::size_t from = begin; from < cells_.size(); ++from) {
        Cell& cell = cells_[from];
        if (cell.elements == 0) {
            cellIndex_.set(cell.coord, -1);
            continue;
        }
        cell.firstElement = element;
        element += cell.elements;
        if (to != from) {
            cellIndex_.set(cell.coord, std::int32_t(to));
            cells_[to] = std::move(cell);
        }
        ++to;
    }
    cells_.erase(cells_.begin() + std::ptrdiff_t(to), cells_.end());
}

void CutMesh::placeElements(const Regrouped& regrouped, const Renumbering& numbering)
{
    if (regrouped.cells.empty()) return;
    makeRoom(regrouped);
    if (!numbering.now.empty())
        parallelChunks(elements_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            for (std::size_t e = begin; e < end; ++e)
                for (std::uint32_t& node : elements_[e].node) node = numbering.now[node];
        });
    bool moved = false;
    std::uint32_t shift = 0;  // of elements, so far; wraps when it is below 0
    for (std::size_t i = 0; i < regrouped.cells.size(); ++i) {
        Cell& cell = cells_[regrouped.cells[i]];
        const auto first = regrouped.elements.begin() + regrouped.first[i],
                   last = regrouped.elements.begin() + regrouped.first[i + 1];
        std::copy(first, last, elements_.begin() + (cell.firstElement + shift));
        const std::uint32_t count = std::uint32_t(last - first);
        moved = moved || cell.elements != count;
        shift += count - cell.elements;
        cell.elements = count;
    }
    if (moved) renumberCells(regrouped.cells.front());
}

}  // namespace vdbfrac::tetmesh
