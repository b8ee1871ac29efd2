#include "patches.h"

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <type_traits>

namespace vdbfrac::solver {

namespace {

using tetmesh::CellElement;
using tetmesh::CellShape;
using tetmesh::kCorners;

/// A run of consecutive elements of one set that share a patch.
struct Range {
    const ElementSet* set;
    std::size_t begin, end;  // in the set
};

struct Built {
    std::uint32_t nodes = 0;
    std::vector<NodeRun> runs;
    std::vector<Batch> batches;  // entries of corners and volumes count from 0 in each patch
    std::vector<LaneCorners> corners;
    std::vector<LaneVolumes> volumes;
    std::vector<LaneTets> laneTets;
    std::uint32_t tangents = 0;
    std::vector<std::uint32_t> laneOfElement;  // in the patch
    std::int64_t tets = 0;
};

/// The box of lattice nodes that a range touches, with a place for each.
class Box {
public:
    explicit Box(const Range& range) : nodes_(range.set->nodes)
    {
        const auto& elements = range.set->elements;
        low_ = nodes_[elements[range.begin].node[0]];
        Coord high = low_;
        for (std::size_t e = range.begin; e < range.end; ++e)
            for (std::uint32_t node : elements[e].node) {
                const Coord c = nodes_[node];
                low_ = {std::min(low_.x, c.x), std::min(low_.y, c.y), std::min(low_.z, c.z)};
                high = {std::max(high.x, c.x), std::max(high.y, c.y), std::max(high.z, c.z)};
            }
        size_ = high - low_ + Coord{1, 1, 1};
    }
    std::size_t places() const { return std::size_t(size_.x) * std::size_t(size_.y) * std::size_t(size_.z); }
    std::size_t placeOf(std::uint32_t node) const
    {
        const Coord c = nodes_[node] - low_;
        return (std::size_t(c.z) * std::size_t(size_.y) + std::size_t(c.y)) * std::size_t(size_.x) + std::size_t(c.x);
    }

private:
    std::span<const Coord> nodes_;
    Coord low_, size_;
};

/// Local numbers of the nodes of a range of tets that are on no lattice: by rising number.
class SortedNodes {
public:
    explicit SortedNodes(const Range& range)
    {
        for (std::size_t e = range.begin; e < range.end; ++e) {
            const auto& node = range.set->elements[e].node;
            nodes.insert(nodes.end(), node.begin(), node.end());
        }
        std::sort(nodes.begin(), nodes.end());
        nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    }
    std::uint16_t operator[](std::uint32_t node) const
    {
        return std::uint16_t(std::lower_bound(nodes.begin(), nodes.end(), node) - nodes.begin());
    }

    std::vector<std::uint32_t> nodes;
};

/// Local numbers of the nodes of a range: along rows of the lattice, so that cells in a row read and write consecutive
/// values; copies of a node follow each other by rising system number.
class LocalNodes {
public:
    explicit LocalNodes(const Range& range) : box_(range), first_(box_.places(), kNone)
    {
        for (std::size_t e = range.begin; e < range.end; ++e)
            for (std::uint32_t node : range.set->elements[e].node) note(node);
        number();
    }
    std::uint16_t operator[](std::uint32_t node) const
    {
        const std::size_t place = box_.placeOf(node);
        std::uint32_t local = start_[place];
        while (nodes[local] != node) ++local;
        return std::uint16_t(local);
    }

    std::vector<std::uint32_t> nodes;

private:
    static constexpr std::uint32_t kNone = 0xffffffff;

    void note(std::uint32_t node)
    {
        const std::size_t place = box_.placeOf(node);
        if (first_[place] == kNone)
            first_[place] = node;
        else if (first_[place] != node)
            copies_.push_back({std::uint32_t(place), node});
    }
    void number()
    {
        std::sort(copies_.begin(), copies_.end());
        copies_.erase(std::unique(copies_.begin(), copies_.end()), copies_.end());
        start_.resize(first_.size());
        auto copy = copies_.begin();
        for (std::size_t place = 0; place < first_.size(); ++place) {
            start_[place] = std::uint32_t(nodes.size());
            if (first_[place] == kNone) continue;
            nodes.push_back(first_[place]);
            for (; copy != copies_.end() && copy->first == place; ++copy) nodes.push_back(copy->second);
            std::sort(nodes.begin() + start_[place], nodes.end());
        }
    }

    Box box_;
    std::vector<std::uint32_t> first_, start_;                     // of each place
    std::vector<std::pair<std::uint32_t, std::uint32_t>> copies_;  // place, node
};

using Local = std::array<std::uint16_t, kCorners>;

/// Whether cell b continues the row of cell a.
bool follows(const Local& a, const Local& b)
{
    for (std::size_t c = 0; c < kCorners; ++c)
        if (b[c] != a[c] + 1) return false;
    for (std::size_t c = 0; c < kCorners; c += 2)
        if (a[c + 1] != b[c]) return false;
    return true;
}

class BatchWriter {
public:
    BatchWriter(const Range& range, const std::vector<Local>& corners, Built& built)
        : range_(range), corners_(corners), built_(built)
    {
    }

    /// Puts the elements (numbers within the range) into one batch.
    void add(std::span<const std::size_t> elements, bool row)
    {
        Batch batch;
        batch.shape = element(elements[0]).shape;
        batch.corner = corners_[elements[0]];
        batch.tangent = built_.tangents;
        built_.tangents += std::uint32_t(tetmesh::cellTets(batch.shape).count);
        if (batch.shape == CellShape::tet)
            batch.cut = tets(elements);
        else {
            if (!row) batch.gathered = gather(elements);
            if (elements.size() < kLanes ||
                !std::all_of(elements.begin(), elements.end(), [&](std::size_t e) { return whole(e); }))
                batch.cut = shares(elements);
        }
        for (std::size_t l = 0; l < elements.size(); ++l)
            built_.laneOfElement[elements[l]] = std::uint32_t(kLanes * built_.batches.size() + l);
        built_.batches.push_back(batch);
    }

private:
    const CellElement& element(std::size_t e) const { return range_.set->elements[range_.begin + e]; }
    bool whole(std::size_t e) const
    {
        const auto& f = element(e).fraction;
        return std::all_of(f.begin(), f.begin() + tetmesh::cellTets(element(e).shape).count,
                           [](double v) { return v == 1; });
    }
    std::int32_t gather(std::span<const std::size_t> elements)
    {
        LaneCorners lanes{};
        for (std::size_t l = 0; l < elements.size(); ++l)
            for (std::size_t c = 0; c < kCorners; ++c) lanes.corner[c][l] = corners_[elements[l]][c];
        built_.corners.push_back(lanes);
        return std::int32_t(built_.corners.size()) - 1;
    }
    std::int32_t shares(std::span<const std::size_t> elements)
    {
        LaneVolumes volumes{};
        for (std::size_t l = 0; l < elements.size(); ++l) {
            const CellElement& e = element(elements[l]);
            const tetmesh::CellTets& tets = tetmesh::cellTets(e.shape);
            for (std::size_t t = 0; t < std::size_t(tets.count); ++t)
                volumes.share[t][l] = tets.volume[t] * e.fraction[t];
        }
        built_.volumes.push_back(volumes);
        return std::int32_t(built_.volumes.size()) - 1;
    }

    std::int32_t tets(std::span<const std::size_t> elements)
    {
        LaneTets lanes{};
        for (std::size_t l = 0; l < elements.size(); ++l) {
            for (std::size_t c = 0; c < 4; ++c) lanes.corner[c][l] = corners_[elements[l]][c];
            lanes.share[0][l] = element(elements[l]).fraction[0];
            const tetmesh::TetGradients& own = range_.set->gradients[range_.begin + elements[l]];
            for (std::size_t a = 0; a < 3; ++a)
                for (std::size_t d = 0; d < 3; ++d) lanes.gradient[a][d][l] = own[a][d];
        }
        built_.laneTets.push_back(lanes);
        return std::int32_t(built_.laneTets.size()) - 1;
    }

    const Range& range_;
    const std::vector<Local>& corners_;
    Built& built_;
};

/// Runs of consecutive numbers among the nodes of a patch; the system counts them from `first`.
std::vector<NodeRun> runsOf(const std::vector<std::uint32_t>& nodes, std::uint32_t first)
{
    std::vector<NodeRun> runs;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (i == 0 || nodes[i] != nodes[i - 1] + 1) runs.push_back({first + nodes[i], std::uint16_t(i), 0});
        ++runs.back().count;
    }
    return runs;
}

/// Batches of a range of cells: rows first, then what is left of each shape.
void addCells(std::span<const CellElement> elements, const std::vector<Local>& corners, BatchWriter& writer)
{
    constexpr std::size_t kShortestRow = 5;         // shorter rows fill lanes better when gathered from anywhere
    std::array<std::vector<std::size_t>, 3> loose;  // by shape
    std::vector<std::size_t> row;
    for (std::size_t e = 0; e < corners.size();) {
        row.assign(1, e);
        while (row.size() < kLanes && ++e < corners.size() && elements[e].shape == elements[row[0]].shape &&
               follows(corners[e - 1], corners[e]))
            row.push_back(e);
        e = row.back() + 1;
        if (row.size() >= kShortestRow)
            writer.add(row, true);
        else
            loose[std::size_t(elements[row[0]].shape)].insert(loose[std::size_t(elements[row[0]].shape)].end(),
                                                              row.begin(), row.end());
    }
    for (const auto& some : loose)
        for (std::size_t i = 0; i < some.size(); i += kLanes)
            writer.add(std::span(some).subspan(i, std::min<std::size_t>(kLanes, some.size() - i)), false);
}

/// Batches of a range of tets, in their order.
void addTets(std::size_t count, BatchWriter& writer)
{
    std::vector<std::size_t> lanes;
    for (std::size_t e = 0; e < count; ++e) {
        lanes.push_back(e);
        if (lanes.size() < kLanes && e + 1 < count) continue;
        writer.add(lanes, false);
        lanes.clear();
    }
}

template <class Nodes>
Built buildPatch(const Range& range)
{
    Nodes local(range);
    assert(local.nodes.size() + 2 * kLanes < 65536);
    const auto elements = range.set->elements.subspan(range.begin, range.end - range.begin);
    std::vector<Local> corners(elements.size());
    for (std::size_t e = 0; e < elements.size(); ++e)
        for (std::size_t c = 0; c < kCorners; ++c) corners[e][c] = local[elements[e].node[c]];
    Built built;
    built.laneOfElement.resize(elements.size());
    BatchWriter writer(range, corners, built);
    if (std::is_same_v<Nodes, SortedNodes>)
        addTets(elements.size(), writer);
    else
        addCells(elements, corners, writer);
    built.nodes = std::uint32_t(local.nodes.size());
    built.runs = runsOf(local.nodes, range.set->firstNode);
    for (const CellElement& e : elements)
        built.tets += std::count_if(e.fraction.begin(), e.fraction.end(), [](double f) { return f > 0; });
    return built;
}

std::vector<Range> findRanges(std::span<const ElementSet> sets)
{
    std::vector<Range> ranges;
    for (const ElementSet& set : sets) {
        for (std::size_t e = 0; e < set.elements.size(); ++e) {
            if (e == 0 || set.elements[e].patch != set.elements[e - 1].patch) ranges.push_back({&set, e, e});
            ranges.back().end = e + 1;
        }
    }
    return ranges;
}

void linkSlots(Patches& p, std::size_t nodeCount)
{
    const auto eachSlot = [&](const auto& f) {
        for (const Patch& patch : p.patches)
            for (std::size_t r = patch.firstRun; r < patch.firstRun + patch.runs; ++r)
                for (std::uint32_t i = 0; i < p.runs[r].count; ++i)
                    f(p.runs[r].node + i, patch.firstSlot + p.runs[r].local + i);
    };
    p.slotStart.assign(nodeCount + 1, 0);
    eachSlot([&](std::uint32_t node, std::uint32_t) { ++p.slotStart[node + 1]; });
    for (std::size_t i = 0; i < nodeCount; ++i) p.slotStart[i + 1] += p.slotStart[i];
    std::vector<std::uint32_t> next(p.slotStart.begin(), p.slotStart.end() - 1);
    p.slots.resize(p.slotStart.back());
    eachSlot([&](std::uint32_t node, std::uint32_t slot) { p.slots[next[node]++] = slot; });
}

/// The first slot of each eight nodes that have one each, in a row.
void findStraight(Patches& p, std::size_t nodeCount)
{
    p.straight.assign((nodeCount + kLanes - 1) / kLanes, kNoSlot);
    parallelChunks(nodeCount / kLanes, kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t g = begin; g < end; ++g) {
            const std::uint32_t *const start = p.slotStart.data() + kLanes * g, *const slot = p.slots.data() + start[0];
            bool straight = true;
            for (std::uint32_t l = 0; l < kLanes && straight; ++l)
                straight = start[l + 1] == start[0] + l + 1 && slot[l] == slot[0] + l;
            if (straight) p.straight[g] = slot[0];
        }
    });
}

/// Where the parts of each patch go, before they are copied there side by side.
Patches layOut(const std::vector<Range>& ranges, const std::vector<Built>& built)
{
    Patches p;
    std::size_t batches = 0, runs = 0, elements = 0;
    for (std::size_t i = 0; i < ranges.size(); ++i) {
        const Material& m = ranges[i].set->material;
        p.patches.push_back({std::uint32_t(batches), std::uint32_t(built[i].batches.size()), std::uint32_t(p.slotCount),
                             built[i].nodes, std::uint32_t(runs), std::uint32_t(built[i].runs.size()),
                             std::uint32_t(elements), std::uint32_t(built[i].laneOfElement.size()), m.mu, m.lambda});
        elements += built[i].laneOfElement.size();
        batches += built[i].batches.size();
        runs += built[i].runs.size();
        p.slotCount += p.patches.back().slots();
        p.tets += built[i].tets;
        p.largestStride = std::max(p.largestStride, p.patches.back().stride());
    }
    p.batches.resize(batches);
    p.laneOfElement.resize(elements);
    p.runs.resize(runs);
    return p;
}

}  // namespace

Patches makePatches(std::span<const ElementSet> sets, std::size_t nodeCount)
{
    const std::vector<Range> ranges = findRanges(sets);
    std::vector<Built> built(ranges.size());
    parallelChunks(ranges.size(), 1, [&](std::size_t begin, std::size_t) {
        built[begin] = ranges[begin].set->gradients.empty() ? buildPatch<LocalNodes>(ranges[begin])
                                                            : buildPatch<SortedNodes>(ranges[begin]);
    });

    Patches p = layOut(ranges, built);
    for (std::size_t i = 0; i < built.size(); ++i) {
        Built& b = built[i];
        for (Batch& batch : b.batches) {
            batch.tangent += std::uint32_t(p.tangentCount);
            if (batch.gathered >= 0) batch.gathered += std::int32_t(p.corners.size());
            if (batch.cut >= 0)
                batch.cut += std::int32_t(batch.shape == CellShape::tet ? p.laneTets.size() : p.volumes.size());
        }
        p.corners.insert(p.corners.end(), b.corners.begin(), b.corners.end());
        p.volumes.insert(p.volumes.end(), b.volumes.begin(), b.volumes.end());
        p.laneTets.insert(p.laneTets.end(), b.laneTets.begin(), b.laneTets.end());
        p.tangentCount += b.tangents;
    }
    parallelChunks(built.size(), 1, [&](std::size_t i, std::size_t) {
        const Patch& patch = p.patches[i];
        std::copy(built[i].batches.begin(), built[i].batches.end(), p.batches.begin() + patch.firstBatch);
        for (std::size_t e = 0; e < patch.elements; ++e)
            p.laneOfElement[patch.firstElement + e] = patch.firstBatch * kLanes + built[i].laneOfElement[e];
        std::copy(built[i].runs.begin(), built[i].runs.end(), p.runs.begin() + patch.firstRun);
    });
    linkSlots(p, nodeCount);
    findStraight(p, nodeCount);
    return p;
}

std::size_t Patches::bytes() const
{
    const auto of = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return of(patches) + of(batches) + of(corners) + of(volumes) + of(laneTets) + of(laneOfElement) + of(runs) +
           of(slotStart) + of(slots) + of(straight);
}

}  // namespace vdbfrac::solver
