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

Eigen::Matrix3f matrixOf(const SymmetricBlock& q)
{
    Eigen::Matrix3f m;
    m << q[0], q[5], q[4], q[5], q[1], q[3], q[4], q[3], q[2];
    return m;
}

/// Its symmetric part.
SymmetricBlock packed(const Eigen::Matrix3f& m)
{
    return {m(0, 0), m(1, 1), m(2, 2), .5f * (m(1, 2) + m(2, 1)), .5f * (m(2, 0) + m(0, 2)), .5f * (m(0, 1) + m(1, 0))};
}

/// The entries of a row, added up by column.
class RowSums {
public:
    void add(std::uint32_t column, const Eigen::Matrix3f& block)
    {
        if (2 * entries_.size() >= table_.size()) grow();
        std::uint32_t& place = table_[find(column)];
        if (place == kNoRow)
            place = std::uint32_t(entries_.size()), entries_.push_back({column, Eigen::Matrix3f::Zero()});
        entries_[place].block += block;
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

double highestFrequency(const CouplingsOf& couplings, std::span<const double> mass)
{
    std::vector<double> row(mass.size(), 0);
    for (const ScalarCoupling& c : couplings.scalars) {
        double size = 0;
        for (const auto& g : c.gradient) size += double(g.norm());
        for (std::size_t a = 0; a < ScalarCoupling::kNodes; ++a) row[c.node[a]] += double(c.gradient[a].norm()) * size;
    }
    for (const Coupling& c : couplings.points) {
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

/// Calls emit(row, add) for each row; add(column, block) adds up to the row's entries.
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
            emit(r, [&](std::uint32_t column, const Eigen::Matrix3f& block) { sums.add(column, block); });
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

NodeBlocks::NodeBlocks(const CouplingsOf& couplings, std::size_t nodes)
{
    constexpr std::size_t kNodes = Coupling::kNodes;
    const auto [points, scalars] = couplings;
    Rows rows(nodes, [&](const auto& mark) {
        for (const Coupling& c : points)
            for (std::size_t a = 0; a < kNodes; ++a)
                if (c.weight[a] != 0) mark(c.node[a]);
        for (const ScalarCoupling& c : scalars)
            for (std::size_t a = 0; a < kNodes; ++a)
                if (!c.gradient[a].isZero(0)) mark(c.node[a]);
    });
    // Items are corners: 8 coupling + place in it, scalars after points.
    const Groups corners = groupItems(rows.node.size(), [&](const auto& add) {
        for (std::size_t c = 0; c < points.size(); ++c)
            for (std::size_t a = 0; a < kNodes; ++a)
                if (points[c].weight[a] != 0) add(rows.of[points[c].node[a]], std::uint32_t(c * kNodes + a));
        for (std::size_t c = 0; c < scalars.size(); ++c)
            for (std::size_t a = 0; a < kNodes; ++a)
                if (!scalars[c].gradient[a].isZero(0))
                    add(rows.of[scalars[c].node[a]], std::uint32_t((points.size() + c) * kNodes + a));
    });
    assemble(std::move(rows.node), [&](std::size_t row, const auto& add) {
        for (std::uint32_t corner : corners[row]) {
            const std::size_t place = corner % kNodes;
            if (corner / kNodes < points.size()) {
                const Coupling& c = points[corner / kNodes];
                const Eigen::Matrix3f Q = matrixOf(c.Q);
                for (std::size_t b = 0; b < kNodes; ++b)
                    if (c.weight[b] != 0) add(c.node[b], (c.weight[place] * c.weight[b]) * Q);
            } else {
                const ScalarCoupling& c = scalars[corner / kNodes - points.size()];
                for (std::size_t b = 0; b < kNodes; ++b)
                    if (!c.gradient[b].isZero(0)) add(c.node[b], c.gradient[place] * c.gradient[b].transpose());
            }
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
                eachParent(e.node, [&](std::uint32_t parent) { add(parent, .25f * e.block); });
    });
    return coarse;
}

SymmetricBlock NodeBlocks::diagonal(std::size_t row) const
{
    const auto own = entries(row);
    const auto at = std::lower_bound(own.begin(), own.end(), row_[row],
                                     [](const Entry& e, std::uint32_t node) { return e.node < node; });
    assert(at != own.end() && at->node == row_[row]);
    return packed(at->block);
}

SymmetricBlock NodeBlocks::damping(std::size_t row) const
{
    constexpr float kOthers = 0.25f;
    Eigen::Matrix3f sum = Eigen::Matrix3f::Zero();
    for (const Entry& e : entries(row)) {
        const float sign = e.block.trace() < 0 ? -1.f : 1.f;
        sum += (e.node == row_[row] ? 1.f : sign * kOthers) * e.block;
    }
    return packed(sum);
}

std::size_t NodeBlocks::bytes() const
{
    return row_.capacity() * sizeof(row_[0]) + start_.capacity() * sizeof(start_[0]) +
           entry_.capacity() * sizeof(Entry);
}

}  // namespace vdbfrac::solver
