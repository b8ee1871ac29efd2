#include "coarsening.h"

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/tetmesh/stencil.h>

#include <algorithm>

namespace vdbfrac::solver {

namespace {

using tetmesh::CellElement;
using tetmesh::CellShape;
using tetmesh::kCorners;
using tetmesh::kMaxTets;

constexpr std::uint32_t kNone = 0xffffffff;

Coord halved(Coord c) { return {c.x >> 1, c.y >> 1, c.z >> 1}; }
int cornerAt(Coord c) { return c.x | c.y << 1 | c.z << 2; }

/// For a finer cell at `offset` (0 or 1 an axis) in the coarse one: the coarse tet round the middle of each of its
/// tets.
std::array<std::uint8_t, kMaxTets> coarseTets(CellShape shape, Coord offset)
{
    const tetmesh::CellTets& tets = tetmesh::cellTets(shape);
    std::array<std::uint8_t, kMaxTets> result{};
    for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
        Coord sum{};
        for (int c : tets.corner[t]) sum = sum + offset + tetmesh::cornerOffset(c);
        result[t] = tetmesh::kuhnTetOf(sum.toVec() / 8);  // four corners, in a cell of two
    }
    return result;
}

struct CoarseTetTable {
    std::array<std::uint8_t, kMaxTets> of[3][kCorners];  // [shape][offset]
    CoarseTetTable()
    {
        for (int shape = 0; shape < 3; ++shape)
            for (int c = 0; c < kCorners; ++c) of[shape][c] = coarseTets(CellShape(shape), tetmesh::cornerOffset(c));
    }
};

/// Which corners the tets of an element use; the others name any node.
std::array<bool, kCorners> usedCorners(const CellElement& e)
{
    std::array<bool, kCorners> used{};
    const tetmesh::CellTets& tets = tetmesh::cellTets(e.shape);
    for (std::size_t t = 0; t < std::size_t(tets.count); ++t)
        for (int c : tets.corner[t]) used[std::size_t(c)] = used[std::size_t(c)] || e.fraction[t] > 0;
    return used;
}

Coord cellOf(const CellElement& e, std::span<const Coord> nodes)
{
    const auto used = usedCorners(e);
    const std::size_t c = std::size_t(std::find(used.begin(), used.end(), true) - used.begin()) % kCorners;
    return nodes[e.node[c]] - tetmesh::cornerOffset(int(c));
}

/// Finer element with the coarse cell it lies in; ordered by blocks of 8^3 coarse cells, then by cell.
struct Placed {
    Coord block, cell, at;  // of 8^3 coarse cells; coarse; finer
    std::uint32_t element;
    friend bool operator<(const Placed& a, const Placed& b)
    {
        if (a.block != b.block) return a.block < b.block;
        if (a.cell != b.cell) return a.cell < b.cell;
        return a.element < b.element;
    }
};

class Coarsener {
public:
    Coarsener(std::size_t nodeCount) : copies_(nodeCount, {kNone, kNone}) { out_.finer.start.push_back(0); }

    void add(const ElementSet& set, std::uint32_t firstElement)
    {
        out_.sets.push_back({{}, {}, 0, set.material});
        firstElementOfSet_.push_back(std::uint32_t(coarse_.size()));
        const std::vector<Placed> order = placed(set);
        for (std::size_t begin = 0, end; begin < order.size(); begin = end) {
            end = begin + 1;
            while (end < order.size() && order[end].cell == order[begin].cell) ++end;
            addCell(set, std::span(order).subspan(begin, end - begin), firstElement);
        }
    }

    CoarseLattice finish();

private:
    struct Element {
        Coord cell;
        std::uint32_t patch;
        std::array<double, kMaxTets> share{};  // material volume over that of a finer cell, by coarse tet
    };

    std::vector<Placed> placed(const ElementSet& set) const
    {
        std::vector<Placed> order;
        order.reserve(set.elements.size());
        for (std::uint32_t e = 0; e < set.elements.size(); ++e) {
            const Coord at = cellOf(set.elements[e], set.nodes), cell = halved(at);
            order.push_back({{cell.x >> 3, cell.y >> 3, cell.z >> 3}, cell, at, e});
        }
        std::sort(order.begin(), order.end());
        return order;
    }

    /// The elements of one coarse cell: those that share nodes become one element.
    void addCell(const ElementSet& set, std::span<const Placed> members, std::uint32_t firstElement)
    {
        component_ = DisjointSets(members.size());
        seen_.clear();
        for (std::uint32_t m = 0; m < members.size(); ++m)
            for (std::uint32_t node : set.elements[members[m].element].node) seen_.push_back({node, m});
        std::sort(seen_.begin(), seen_.end());
        for (std::size_t i = 1; i < seen_.size(); ++i)
            if (seen_[i].first == seen_[i - 1].first) component_.join(seen_[i].second, seen_[i - 1].second);
        for (std::uint32_t root = 0; root < members.size(); ++root)
            if (component_.find(root) == root) addElement(set, members, root, firstElement);
    }

    void addElement(const ElementSet& set, std::span<const Placed> members, std::uint32_t root,
                    std::uint32_t firstElement)
    {
        static const CoarseTetTable kCoarseTets;
        const std::uint32_t number = std::uint32_t(coarse_.size());
        const bool newBlock = number == firstElementOfSet_.back() || members[0].block != block_;
        block_ = members[0].block;
        Element coarse{members[0].cell, newBlock ? ++patch_ : patch_, {}};
        joints_.grow((number + 1) * kCorners);
        for (std::uint32_t m = root; m < members.size(); ++m) {
            if (component_.find(m) != root) continue;
            const CellElement& fine = set.elements[members[m].element];
            const Coord offset = members[m].at - 2 * coarse.cell;
            const auto& tets = kCoarseTets.of[int(fine.shape)][cornerAt(offset)];
            out_.finer.children.push_back(firstElement + members[m].element);
            const tetmesh::CellTets& shape = tetmesh::cellTets(fine.shape);
            for (std::size_t t = 0; t < std::size_t(shape.count); ++t)
                coarse.share[tets[t]] += 6 * shape.volume[t] * fine.fraction[t];
            const auto used = usedCorners(fine);
            for (int c = 0; c < kCorners; ++c)
                if (used[std::size_t(c)])
                    link(set.firstNode + fine.node[std::size_t(c)], number, offset + tetmesh::cornerOffset(c));
        }
        out_.finer.start.push_back(std::uint32_t(out_.finer.children.size()));
        coarse_.push_back(coarse);
    }

    /// Finer node at `p` in coarse element `number` takes its value from two corners of it; all elements agree on
    /// which.
    void link(std::uint32_t node, std::uint32_t number, Coord p)
    {
        const std::uint32_t low = number * kCorners + std::uint32_t(cornerAt(halved(p)));
        const std::uint32_t high = number * kCorners + std::uint32_t(cornerAt(halved(p + Coord{1, 1, 1})));
        auto& copies = copies_[node];
        if (copies[0] == kNone) {
            copies = {low, high};
            return;
        }
        if (copies[0] / kCorners == number) return;  // the element has had it
        joints_.join(copies[0], low);
        joints_.join(copies[1], high);
    }

    CoarseLattice out_;
    std::vector<Element> coarse_;
    std::vector<std::uint32_t> firstElementOfSet_;
    // Of each finer node: corners 8 element + corner of the first element that has it.
    std::vector<std::array<std::uint32_t, 2>> copies_;
    DisjointSets joints_, component_;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> seen_;
    Coord block_;
    std::uint32_t patch_ = 0;
};

CoarseLattice Coarsener::finish()
{
    std::vector<std::uint32_t> number(joints_.size(), kNone);
    firstElementOfSet_.push_back(std::uint32_t(coarse_.size()));
    for (std::size_t s = 0; s < out_.sets.size(); ++s) {
        CoarseLattice::Set& set = out_.sets[s];
        set.firstNode = std::uint32_t(out_.nodeCount);
        for (std::uint32_t e = firstElementOfSet_[s]; e < firstElementOfSet_[s + 1]; ++e) {
            CellElement element{};
            element.shape = CellShape::six;
            element.patch = coarse_[e].patch;
            for (std::size_t t = 0; t < kMaxTets; ++t) element.fraction[t] = coarse_[e].share[t] / 8;
            for (std::uint32_t c = 0; c < kCorners; ++c) {
                const std::uint32_t joint = joints_.find(e * kCorners + c);
                if (number[joint] == kNone) {
                    number[joint] = std::uint32_t(out_.nodeCount++);
                    set.nodes.push_back(coarse_[e].cell + tetmesh::cornerOffset(int(c)));
                }
                element.node[c] = number[joint] - set.firstNode;
            }
            set.elements.push_back(element);
        }
    }
    out_.parents.reserve(copies_.size());
    for (const auto& c : copies_)
        out_.parents.push_back(c[0] == kNone ? c : std::array{number[joints_.find(c[0])], number[joints_.find(c[1])]});
    return std::move(out_);
}

}  // namespace

std::vector<ElementSet> CoarseLattice::elementSets() const
{
    std::vector<ElementSet> result;
    for (const Set& set : sets) result.push_back({set.elements, set.nodes, set.firstNode, set.material});
    return result;
}

CoarseLattice coarsen(std::span<const ElementSet> sets, std::size_t nodeCount)
{
    Coarsener coarsener(nodeCount);
    std::uint32_t element = 0;
    for (const ElementSet& set : sets) {
        coarsener.add(set, element);
        element += std::uint32_t(set.elements.size());
    }
    return coarsener.finish();
}

}  // namespace vdbfrac::solver
