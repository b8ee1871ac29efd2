#include <vdbfrac/solver/coupling.h>

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace vdbfrac::solver {

namespace {

constexpr std::size_t kRowChunk = 256;
constexpr std::uint32_t kNoRow = 0xffffffff;

/// Rows for some nodes of a system, in their order.
struct Rows {
    std::vector<std::uint32_t> node;  // rising
    std::vector<std::uint32_t> of;    // of each node of the system; kNoRow

    /// forEach(mark) calls mark(node) for all that get one, also several times.
    template <class ForEach>
    Rows(std::size_t nodes, const ForEach& forEach) : of(nodes, kNoRow)
    {
        forEach([this](std::uint32_t n) { of[n] = 0; });
        for (std::uint32_t n = 0; n < nodes; ++n)
            if (of[n] != kNoRow) of[n] = std::uint32_t(node.size()), node.push_back(n);
    }
};

void addTo(SymmetricBlock& sum, float factor, const SymmetricBlock& block)
{
    for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += factor * block[k];
}

/// The entries of a row, added up by column.
class RowSums {
public:
    void add(std::uint32_t column, float factor, const SymmetricBlock& block)
    {
        if (2 * entries_.size() >= table_.size()) grow();
        std::uint32_t& place = table_[find(column)];
        if (place == kNoRow) place = std::uint32_t(entries_.size()), entries_.push_back({column, {}});
        addTo(entries_[place].block, factor, block);
    }
    /// Appends them to `list`, columns rising, and starts a new row.
    void moveTo(std::vector<NodeBlocks::Entry>& list)
    {
        std::fill(table_.begin(), table_.end(), kNoRow);
        std::sort(entries_.begin(), entries_.end(), [](const auto& a, const auto& b) { return a.node < b.node; });
        list.insert(list.end(), entries_.begin(), entries_.end());
        entries_.clear();
    }

private:
    /// Where a column is in the table, or would be.
    std::size_t find(std::uint32_t column) const
    {
        constexpr std::uint32_t kSpread = 2654435761u;  // 2^32 over the golden ratio (Knuth)
        std::size_t at = (column * kSpread) & (table_.size() - 1);
        while (table_[at] != kNoRow && entries_[table_[at]].node != column) at = (at + 1) & (table_.size() - 1);
        return at;
    }
    void grow()
    {
        table_.assign(std::max<std::size_t>(256, 2 * table_.size()), kNoRow);
        for (std::uint32_t i = 0; i < entries_.size(); ++i) table_[find(entries_[i].node)] = i;
    }

    std::vector<NodeBlocks::Entry> entries_;
    std::vector<std::uint32_t> table_;  // places in entries_; a power of two, at most half full
};

}  // namespace

bool Coupling::isExternal() const
{
    constexpr double kRounding = 1e-5;  // of the weights, which are floats
    double sum = 0, size = 0;
    for (float w : weight) sum += w, size += std::abs(w);
    return std::abs(sum) > kRounding * size;
}

double highestFrequency(std::span<const Coupling> couplings, std::span<const double> mass)
{
    std::vector<double> row(mass.size(), 0);
    for (const Coupling& c : couplings) {
        double size = 0;
        for (float w : c.weight) size += std::abs(w);
        for (std::size_t a = 0; a < Coupling::kNodes; ++a)
            if (c.weight[a] != 0) row[c.node[a]] += std::abs(double(c.weight[a])) * size * c.trace();
    }
    double highest = 0;
    for (std::size_t n = 0; n < row.size(); ++n)
        if (row[n] > 0) highest = std::max(highest, row[n] / mass[n]);
    return std::sqrt(highest);
}

/// Calls emit(row, add) for each row; add(column, factor, block) adds up to the row's entries.
template <class Emit>
void NodeBlocks::assemble(std::vector<std::uint32_t> rows, const Emit& emit)
{
    row_ = std::move(rows);
    std::vector<std::vector<Entry>> part((row_.size() + kRowChunk - 1) / kRowChunk);
    std::vector<std::size_t> size(row_.size());
    parallelChunks(row_.size(), kRowChunk, [&](std::size_t begin, std::size_t end) {
        std::vector<Entry>& all = part[begin / kRowChunk];
        RowSums sums;
        for (std::size_t r = begin; r < end; ++r) {
            emit(r, [&](std::uint32_t column, float factor, const SymmetricBlock& block) {
                sums.add(column, factor, block);
            });
            const std::size_t first = all.size();
            sums.moveTo(all);
            size[r] = all.size() - first;
        }
    });
    start_.assign(1, 0);
    for (std::size_t s : size) start_.push_back(start_.back() + s);
    entry_.clear();
    entry_.reserve(start_.back());
    for (const auto& p : part) entry_.insert(entry_.end(), p.begin(), p.end());
}

NodeBlocks::NodeBlocks(std::span<const Coupling> couplings, std::size_t nodes)
{
    Rows rows(nodes, [&](const auto& mark) {
        for (const Coupling& c : couplings)
            for (std::size_t a = 0; a < Coupling::kNodes; ++a)
                if (c.weight[a] != 0) mark(c.node[a]);
    });
    // Items are corners: 8 coupling + place in it.
    const Groups corners = groupItems(rows.node.size(), [&](const auto& add) {
        for (std::size_t c = 0; c < couplings.size(); ++c)
            for (std::size_t a = 0; a < Coupling::kNodes; ++a)
                if (couplings[c].weight[a] != 0)
                    add(rows.of[couplings[c].node[a]], std::uint32_t(c * Coupling::kNodes + a));
    });
    assemble(std::move(rows.node), [&](std::size_t row, const auto& add) {
        for (std::uint32_t corner : corners[row]) {
            const Coupling& c = couplings[corner / Coupling::kNodes];
            const float own = c.weight[corner % Coupling::kNodes];
            for (std::size_t b = 0; b < Coupling::kNodes; ++b)
                if (c.weight[b] != 0) add(c.node[b], own * c.weight[b], c.Q);
        }
    });
}

NodeBlocks NodeBlocks::restricted(Parents parents, std::span<const std::uint8_t> fixed, std::size_t coarseNodes) const
{
    const auto eachParent = [&](std::uint32_t node, const auto& f) {
        if (fixed[node]) return;
        for (std::uint32_t parent : parents[node])
            if (parent < coarseNodes) f(parent);
    };
    Rows rows(coarseNodes, [&](const auto& mark) {
        for (std::uint32_t node : row_) eachParent(node, mark);
    });
    const Groups finer = groupItems(rows.node.size(), [&](const auto& add) {
        for (std::uint32_t r = 0; r < row_.size(); ++r)
            eachParent(row_[r], [&](std::uint32_t parent) { add(rows.of[parent], r); });
    });
    NodeBlocks coarse;
    coarse.assemble(std::move(rows.node), [&](std::size_t row, const auto& add) {
        for (std::uint32_t r : finer[row])
            for (const Entry& e : entries(r))
                eachParent(e.node, [&](std::uint32_t parent) { add(parent, .25f, e.block); });
    });
    return coarse;
}

const SymmetricBlock& NodeBlocks::diagonal(std::size_t row) const
{
    const auto own = entries(row);
    const auto at = std::lower_bound(own.begin(), own.end(), row_[row],
                                     [](const Entry& e, std::uint32_t node) { return e.node < node; });
    assert(at != own.end() && at->node == row_[row]);
    return at->block;
}

SymmetricBlock NodeBlocks::damping(std::size_t row) const
{
    constexpr float kOthers = 0.25f;
    SymmetricBlock sum{};
    for (const Entry& e : entries(row)) {
        const float sign = e.block[0] + e.block[1] + e.block[2] < 0 ? -1.f : 1.f;
        addTo(sum, e.node == row_[row] ? 1.f : sign * kOthers, e.block);
    }
    return sum;
}

std::size_t NodeBlocks::bytes() const
{
    return row_.capacity() * sizeof(row_[0]) + start_.capacity() * sizeof(start_[0]) +
           entry_.capacity() * sizeof(Entry);
}

}  // namespace vdbfrac::solver
