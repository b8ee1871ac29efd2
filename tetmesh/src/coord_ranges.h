// Loops over boxes of coordinates, as the cut needs them. Not installed.
#pragma once

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

template <class T>
void sortUnique(std::vector<T>& v)
{
    std::sort(v.begin(), v.end());
    v.erase(std::unique(v.begin(), v.end()), v.end());
}

}  // namespace vdbfrac::tetmesh
