#include "patches.h"

#include "local_nodes.h"

#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <array>
#include <type_traits>

namespace vdbfrac::solver {

namespace {

using tetmesh::CellElement;
using tetmesh::CellShape;
using tetmesh::kCorners;

struct Built {
    std::uint32_t nodes = 0;
    std::vector<NodeRun> runs;
    std::vector<Batch> batches;  // entries of corners and volumes count from 0 in each patch
    std::vector<LaneCorners> corners;
    std::vector<LaneVolumes> volumes;
    std::vector<LaneTets> laneTets;
    std::vector<LaneCells> laneCells;
    bool means = false;
    std::uint32_t tangents = 0;
    std::vector<std::uint32_t> laneOfElement;  // in the patch
    std::int64_t tets = 0;
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
        const auto tets = std::uint32_t(tetmesh::cellTets(batch.shape).count);
        built_.tangents += tets + (built_.means && tets > 1);
        if (batch.shape == CellShape::tet)
            batch.cut = ownTets(elements);
        else {
            if (!row) batch.gathered = gather(elements);
            batch.flowed = std::any_of(elements.begin(), elements.end(), [&](std::size_t e) { return flowed(e); });
            if (batch.flowed)
                batch.cut = cells(elements);
            else if (elements.size() < kLanes ||
                     !std::all_of(elements.begin(), elements.end(), [&](std::size_t e) { return whole(e); }))
                batch.cut = shares(elements);
        }
        for (std::size_t l = 0; l < elements.size(); ++l)
            built_.laneOfElement[elements[l]] = std::uint32_t(kLanes * built_.batches.size() + l);
        built_.batches.push_back(batch);
    }

private:
    const CellElement& element(std::size_t e) const { return range_.set->elements[range_.begin + e]; }
    const tetmesh::CellTets& tetsOf(std::size_t e) const { return tetmesh::cellTets(element(e).shape); }
    /// Volume over h^3 times stiffness.
    double share(std::size_t e, std::size_t t) const
    {
        return tetsOf(e).volume[t] * element(e).fraction[t] * stiffness(*range_.set, range_.begin + e, t);
    }
    bool whole(std::size_t e) const
    {
        for (std::size_t t = 0; t < std::size_t(tetsOf(e).count); ++t)
            if (share(e, t) != tetsOf(e).volume[t]) return false;
        return true;
    }
    bool flowed(std::size_t e) const
    {
        for (std::size_t t = 0; t < std::size_t(tetsOf(e).count) && range_.set->inverseFlow; ++t)
            if (element(e).fraction[t] > 0 && inverseFlow(*range_.set, range_.begin + e, t)) return true;
        return false;
    }
    /// Puts h Fp^-T grad N of a tet into a lane.
    void writeGradients(std::size_t e, std::size_t t, std::size_t l, double (&gradient)[3][3][kLanes]) const
    {
        const tetmesh::TetGradients own = restGradients(*range_.set, range_.begin + e, t);
        for (std::size_t a = 0; a < 3; ++a)
            for (std::size_t d = 0; d < 3; ++d) gradient[a][d][l] = own[a][d];
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
        for (std::size_t l = 0; l < elements.size(); ++l)
            for (std::size_t t = 0; t < std::size_t(tetsOf(elements[l]).count); ++t)
                volumes.share[t][l] = share(elements[l], t);
        built_.volumes.push_back(volumes);
        return std::int32_t(built_.volumes.size()) - 1;
    }

    std::int32_t cells(std::span<const std::size_t> elements)
    {
        LaneCells lanes{};
        for (std::size_t l = 0; l < elements.size(); ++l)
            for (std::size_t t = 0; t < std::size_t(tetsOf(elements[l]).count); ++t) {
                lanes.share[t][l] = share(elements[l], t);
                writeGradients(elements[l], t, l, lanes.gradient[t]);
            }
        built_.laneCells.push_back(lanes);
        return std::int32_t(built_.laneCells.size()) - 1;
    }
    std::int32_t ownTets(std::span<const std::size_t> elements)
    {
        LaneTets lanes{};
        for (std::size_t l = 0; l < elements.size(); ++l) {
            for (std::size_t c = 0; c < 4; ++c) lanes.corner[c][l] = corners_[elements[l]][c];
            lanes.share[0][l] = share(elements[l], 0);
            writeGradients(elements[l], 0, l, lanes.gradient);
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
Built buildPatch(const Range& range, bool means)
{
    Nodes local(range);
    const auto elements = range.set->elements.subspan(range.begin, range.end - range.begin);
    std::vector<Local> corners(elements.size());
    for (std::size_t e = 0; e < elements.size(); ++e)
        for (std::size_t c = 0; c < kCorners; ++c) corners[e][c] = local[elements[e].node[c]];
    Built built;
    built.means = means;
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

/// The elements of each patch; split where crumbs, which have nodes of their own, could need more than 16 bits.
std::vector<Range> findRanges(std::span<const ElementSet> sets)
{
    constexpr std::size_t kMost = (65536 - 2 * kLanes) / kCorners - 1;
    std::vector<Range> ranges;
    for (const ElementSet& set : sets) {
        for (std::size_t e = 0; e < set.elements.size(); ++e) {
            if (e == 0 || set.elements[e].patch != set.elements[e - 1].patch || e - ranges.back().begin == kMost)
                ranges.push_back({&set, e, e});
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
void findContiguous(Patches& p, std::size_t nodeCount)
{
    p.contiguous.assign((nodeCount + kLanes - 1) / kLanes, kNoSlot);
    parallelChunks(nodeCount / kLanes, kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t g = begin; g < end; ++g) {
            const std::uint32_t *const start = p.slotStart.data() + kLanes * g, *const slot = p.slots.data() + start[0];
            bool contiguous = true;
            for (std::uint32_t l = 0; l < kLanes && contiguous; ++l)
                contiguous = start[l + 1] == start[0] + l + 1 && slot[l] == slot[0] + l;
            if (contiguous) p.contiguous[g] = slot[0];
        }
    });
}

/// The yields of the elements of each batch.
void layOutYields(const std::vector<Range>& ranges, Patches& p)
{
    if (std::none_of(ranges.begin(), ranges.end(), [](const Range& range) { return range.set->yield; })) return;
    LaneYields never;
    std::fill_n(never.strain, kLanes, kInfinity);
    p.yields.assign(p.batches.size(), never);
    for (std::size_t i = 0; i < ranges.size(); ++i) {
        if (!ranges[i].set->yield) continue;
        for (std::size_t e = 0; e < p.patches[i].elements; ++e) {
            const std::uint32_t at = p.laneOfElement[p.patches[i].firstElement + e];
            p.yields[at / kLanes].strain[at % kLanes] = ranges[i].set->yield->of(ranges[i].begin + e);
        }
    }
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
                             std::uint32_t(elements), std::uint32_t(built[i].laneOfElement.size()), m.mu, m.lambda,
                             built[i].tets, ranges[i].set->yield});
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

tetmesh::TetGradients restGradients(const ElementSet& set, std::size_t e, std::size_t t)
{
    using Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    const auto& lattice = tetmesh::cellTets(set.elements[e].shape).gradient[t];
    tetmesh::TetGradients g =
        set.gradients.empty() ? tetmesh::TetGradients{lattice[1], lattice[2], lattice[3]} : set.gradients[e];
    if (const Mat3* const flow = inverseFlow(set, e, t)) {
        Eigen::Map<Rows> rows(g[0].data());
        rows = (rows * *flow).eval();
    }
    return g;
}

Patches makePatches(std::span<const ElementSet> sets, std::size_t nodeCount, bool means)
{
    const std::vector<Range> ranges = findRanges(sets);
    std::vector<Built> built(ranges.size());
    parallelChunks(ranges.size(), 1, [&](std::size_t begin, std::size_t) {
        built[begin] = ranges[begin].set->gradients.empty() ? buildPatch<LocalNodes>(ranges[begin], means)
                                                            : buildPatch<SortedNodes>(ranges[begin], means);
    });

    Patches p = layOut(ranges, built);
    p.means = means;
    for (std::size_t i = 0; i < built.size(); ++i) {
        Built& b = built[i];
        for (Batch& batch : b.batches) {
            batch.tangent += std::uint32_t(p.tangentCount);
            if (batch.gathered >= 0) batch.gathered += std::int32_t(p.corners.size());
            if (batch.cut >= 0)
                batch.cut += std::int32_t(batch.shape == CellShape::tet ? p.laneTets.size()
                                          : batch.flowed                ? p.laneCells.size()
                                                                        : p.volumes.size());
        }
        p.corners.insert(p.corners.end(), b.corners.begin(), b.corners.end());
        p.volumes.insert(p.volumes.end(), b.volumes.begin(), b.volumes.end());
        p.laneTets.insert(p.laneTets.end(), b.laneTets.begin(), b.laneTets.end());
        p.laneCells.insert(p.laneCells.end(), b.laneCells.begin(), b.laneCells.end());
        p.tangentCount += b.tangents;
    }
    parallelChunks(built.size(), 1, [&](std::size_t i, std::size_t) {
        const Patch& patch = p.patches[i];
        std::copy(built[i].batches.begin(), built[i].batches.end(), p.batches.begin() + patch.firstBatch);
        for (std::size_t e = 0; e < patch.elements; ++e)
            p.laneOfElement[patch.firstElement + e] = patch.firstBatch * kLanes + built[i].laneOfElement[e];
        std::copy(built[i].runs.begin(), built[i].runs.end(), p.runs.begin() + patch.firstRun);
    });
    layOutYields(ranges, p);
    linkSlots(p, nodeCount);
    findContiguous(p, nodeCount);
    return p;
}

std::size_t Patches::bytes() const
{
    const auto of = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return of(patches) + of(batches) + of(corners) + of(volumes) + of(laneTets) + of(laneCells) + of(yields) +
           of(laneOfElement) + of(runs) + of(slotStart) + of(slots) + of(contiguous);
}

}  // namespace vdbfrac::solver
