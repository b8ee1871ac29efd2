#include <vdbfrac/tetmesh/nodes_around.h>

#include <algorithm>
#include <compare>
#include <iterator>

namespace vdbfrac::tetmesh {

namespace {

/// Nodes in a row along x.
struct Row {
    int z, y, first, last;
    auto operator<=>(const Row&) const = default;
};

/// Joins sorted rows that touch.
void joinRows(std::vector<Row>& rows)
{
    std::size_t count = 0;
    for (const Row& row : rows) {
        Row* before = count > 0 ? &rows[count - 1] : nullptr;
        if (before && before->z == row.z && before->y == row.y && row.first <= before->last + 1)
            before->last = std::max(before->last, row.last);
        else
            rows[count++] = row;
    }
    rows.resize(count);
}

/// Sorted rows, and their copies up to `reach` away along an axis. Copies are sorted as they are: twice as many of them
/// are had each time by merging.
void widen(int Row::*axis, int reach, std::vector<Row>& rows)
{
    for (Row& row : rows) row.*axis -= reach;
    std::vector<Row> copy, merged;
    for (int width = 1; width < 2 * reach + 1;) {
        const int move = std::min(width, 2 * reach + 1 - width);
        copy = rows, merged.clear();
        for (Row& row : copy) row.*axis += move;
        std::merge(rows.begin(), rows.end(), copy.begin(), copy.end(), std::back_inserter(merged));
        joinRows(merged);
        rows.swap(merged);
        width += move;
    }
}

}  // namespace

std::vector<Coord> nodesAround(std::span<const Coord> nodes, int reach)
{
    // Axis by axis, on rows of nodes: as many rows as the result has, not as many nodes as all the boxes hold.
    std::vector<Row> rows;
    for (const Coord& c : nodes) rows.push_back({c.z, c.y, c.x - reach, c.x + reach});
    std::sort(rows.begin(), rows.end());
    joinRows(rows);
    widen(&Row::y, reach, rows);
    widen(&Row::z, reach, rows);
    std::vector<Coord> all;
    for (const Row& row : rows)
        for (int x = row.first; x <= row.last; ++x) all.push_back({x, row.y, row.z});
    return all;
}

}  // namespace vdbfrac::tetmesh
