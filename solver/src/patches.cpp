#include "patches.h"

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <array>
#include <cassert>

namespace vdbfrac::solver {

namespace {

using tetmesh::CellElement;
using tetmesh::CellShape;
using tetmesh::kCorners;

/// A run of consecutive elements of one set that share a patch.
struct Range {
    const ElementSet* set;
    std::size_t begin, end;    // in the set
    std::size_t firstElement;  // number of the set's first element in the system
};

struct Built {
    std::vector<std::uint32_t> nodes;  // of the body, in local order
    std::vector<Batch> batches;
    std::vector<std::int32_t> elementOfLane;
};

/// Nodes of a range along rows of the lattice, so that cells in a row read and write consecutive values.
std::vector<std::uint32_t> localNodes(const Range& range)
{
    std::vector<std::uint32_t> nodes;
    for (std::size_t e = range.begin; e < range.end; ++e) {
        const auto& n = range.set->elements[e].node;
        nodes.insert(nodes.end(), n.begin(), n.end());
    }
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    std::sort(nodes.begin(), nodes.end(), [&](std::uint32_t a, std::uint32_t b) {
        const Coord ca = range.set->nodes[a], cb = range.set->nodes[b];
        return ca != cb ? ca < cb : a < b;
    });
    return nodes;
}

using Local = std::array<std::uint16_t, kCorners>;

std::vector<Local> localCorners(const Range& range, const std::vector<std::uint32_t>& nodes)
{
    std::vector<std::pair<std::uint32_t, std::uint16_t>> byId(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) byId[i] = {nodes[i], std::uint16_t(i)};
    std::sort(byId.begin(), byId.end());
    std::vector<Local> corners(range.end - range.begin);
    for (std::size_t e = 0; e < corners.size(); ++e)
        for (std::size_t c = 0; c < kCorners; ++c) {
            const std::uint32_t node = range.set->elements[range.begin + e].node[c];
            const auto at = std::lower_bound(byId.begin(), byId.end(), std::pair<std::uint32_t, std::uint16_t>{node, 0});
            corners[e][c] = at->second;
        }
    return corners;
}

bool follows(const Local& a, const Local& b)
{
    for (std::size_t c = 0; c < kCorners; ++c)
        if (b[c] != a[c] + 1) return false;
    return true;
}

class BatchWriter {
public:
    BatchWriter(const Range& range, const std::vector<Local>& corners, double h)
        : range_(range), corners_(corners), cellVolume_(h * h * h)
    {
    }

    /// Puts the elements (numbers within the range) into one batch.
    void add(std::span<const std::size_t> elements, bool contiguous)
    {
        const CellElement& first = element(elements[0]);
        Batch batch{};
        batch.shape = first.shape;
        batch.contiguous = contiguous;
        std::array<std::int32_t, kLanes> number;
        number.fill(-1);
        for (std::size_t l = 0; l < elements.size(); ++l) {
            fillLane(batch, l, elements[l]);
            number[l] = std::int32_t(range_.firstElement + range_.begin + elements[l]);
        }
        for (std::size_t l = elements.size(); l < kLanes && contiguous; ++l)
            for (std::size_t c = 0; c < kCorners; ++c) batch.corner[c][l] = std::uint16_t(batch.corner[c][0] + l);
        built.batches.push_back(batch);
        built.elementOfLane.insert(built.elementOfLane.end(), number.begin(), number.end());
    }

    Built built;

private:
    const CellElement& element(std::size_t e) const { return range_.set->elements[range_.begin + e]; }

    void fillLane(Batch& batch, std::size_t l, std::size_t e)
    {
        const tetmesh::CellTets& tets = tetmesh::cellTets(batch.shape);
        for (int t = 0; t < tets.count; ++t)
            batch.volume[t][l] = cellVolume_ * tets.volume[std::size_t(t)] * element(e).fraction[std::size_t(t)];
        batch.mu[l] = range_.set->material.mu;
        batch.lambda[l] = range_.set->material.lambda;
        for (std::size_t c = 0; c < kCorners; ++c) batch.corner[c][l] = corners_[e][c];
    }

    const Range& range_;
    const std::vector<Local>& corners_;
    double cellVolume_;
};

Built buildPatch(const Range& range, double h)
{
    constexpr std::size_t kShortestRow = 5;  // shorter rows fill lanes better when gathered from anywhere
    const std::vector<std::uint32_t> nodes = localNodes(range);
    assert(nodes.size() + 2 * kLanes < 65536);
    const std::vector<Local> corners = localCorners(range, nodes);
    BatchWriter writer(range, corners, h);
    std::array<std::vector<std::size_t>, 3> loose;  // by shape
    for (std::size_t e = 0; e < corners.size();) {
        const CellShape shape = range.set->elements[range.begin + e].shape;
        std::vector<std::size_t> row{e};
        while (row.size() < kLanes && row.back() + 1 < corners.size() &&
               range.set->elements[range.begin + row.back() + 1].shape == shape &&
               follows(corners[row.back()], corners[row.back() + 1]))
            row.push_back(row.back() + 1);
        e = row.back() + 1;
        if (row.size() >= kShortestRow)
            writer.add(row, true);
        else
            loose[std::size_t(shape)].insert(loose[std::size_t(shape)].end(), row.begin(), row.end());
    }
    for (const auto& elements : loose)
        for (std::size_t i = 0; i < elements.size(); i += kLanes)
            writer.add(std::span(elements).subspan(i, std::min<std::size_t>(kLanes, elements.size() - i)), false);
    writer.built.nodes = nodes;
    return std::move(writer.built);
}

std::vector<Range> findRanges(std::span<const ElementSet> sets)
{
    std::vector<Range> ranges;
    std::size_t firstElement = 0;
    for (const ElementSet& set : sets) {
        for (std::size_t e = 0; e < set.elements.size(); ++e) {
            if (e == 0 || set.elements[e].patch != set.elements[e - 1].patch) ranges.push_back({&set, e, e, firstElement});
            ranges.back().end = e + 1;
        }
        firstElement += set.elements.size();
    }
    return ranges;
}

void linkSlots(Patches& p, std::size_t nodeCount)
{
    p.slotStart.assign(nodeCount + 1, 0);
    for (std::uint32_t node : p.nodeOfSlot) ++p.slotStart[node + 1];
    for (std::size_t i = 0; i < nodeCount; ++i) p.slotStart[i + 1] += p.slotStart[i];
    std::vector<std::uint32_t> next(p.slotStart.begin(), p.slotStart.end() - 1);
    p.slots.resize(p.nodeOfSlot.size());
    for (std::size_t s = 0; s < p.nodeOfSlot.size(); ++s) p.slots[next[p.nodeOfSlot[s]]++] = std::uint32_t(s);
}

}  // namespace

Patches makePatches(std::span<const ElementSet> sets, std::size_t nodeCount, double h)
{
    const std::vector<Range> ranges = findRanges(sets);
    std::vector<Built> built(ranges.size());
    parallelChunks(ranges.size(), 1, [&](std::size_t begin, std::size_t) { built[begin] = buildPatch(ranges[begin], h); });

    Patches p;
    for (std::size_t i = 0; i < ranges.size(); ++i) {
        const Built& b = built[i];
        p.patches.push_back({std::uint32_t(p.batches.size()), std::uint32_t(b.batches.size()),
                             std::uint32_t(p.nodeOfSlot.size()), std::uint32_t(b.nodes.size())});
        p.batches.insert(p.batches.end(), b.batches.begin(), b.batches.end());
        p.elementOfLane.insert(p.elementOfLane.end(), b.elementOfLane.begin(), b.elementOfLane.end());
        for (std::uint32_t node : b.nodes) p.nodeOfSlot.push_back(ranges[i].set->firstNode + node);
    }
    for (const ElementSet& set : sets)
        for (const CellElement& e : set.elements) p.tets += std::count_if(e.fraction.begin(), e.fraction.end(), [](double f) { return f > 0; });
    linkSlots(p, nodeCount);
    return p;
}

}  // namespace vdbfrac::solver
