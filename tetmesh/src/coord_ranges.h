// Loops over boxes of coordinates, as the cut needs them. Not installed.
#pragma once

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/tetmesh/stencil.h>

#include <algorithm>
#include <vector>

namespace vdbfrac::tetmesh {

inline int ceilDiv(int a, int m) { return -floorDiv(-a, m); }

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

inline Coord cornerOf(Coord cell, int c) { return cell + cornerOffset(c); }

/// Sorts and drops what is there twice. Where the box of all is well filled, it is swept instead.
inline void sortUniqueCoords(std::vector<Coord>& coords)
{
    if (coords.empty()) return;
    Coord lower = coords[0], upper = coords[0];
    for (const Coord& c : coords) {
        lower = {std::min(lower.x, c.x), std::min(lower.y, c.y), std::min(lower.z, c.z)};
        upper = {std::max(upper.x, c.x), std::max(upper.y, c.y), std::max(upper.z, c.z)};
    }
    const Coord size = upper - lower + Coord{1, 1, 1};
    constexpr double kSparse = 32;  // places to sweep for each coordinate that would have to be sorted
    if (double(size.x) * size.y * size.z > kSparse * double(coords.size())) {
        sortUnique(coords);
        return;
    }
    std::vector<std::uint8_t> marks(std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z));
    for (const Coord& c : coords) {
        const Coord d = c - lower;
        marks[(std::size_t(d.z) * std::size_t(size.y) + std::size_t(d.y)) * std::size_t(size.x) + std::size_t(d.x)] = 1;
    }
    coords.clear();
    auto mark = marks.begin();
    for (int z = lower.z; z <= upper.z; ++z)
        for (int y = lower.y; y <= upper.y; ++y)
            for (int x = lower.x; x <= upper.x; ++x)
                if (*mark++) coords.push_back({x, y, z});
}

}  // namespace vdbfrac::tetmesh
