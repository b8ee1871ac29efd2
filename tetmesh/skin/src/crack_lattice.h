// The voxels round cracks as tets on which c is linear. Not installed.
//
// Each voxel is divided into Kuhn's six tets (tetmesh/cell.h, `six`). A simplex is a chain of nodes: the lowest, and
// the corners above it as masks (bit 0: x + 1 and so on), each a part of the next. The nodes are moved by 1e-6 voxel in
// a direction that depends on their coordinates alone: nothing of a mesh lies exactly on a plane of the lattice then,
// so crossings need no special cases.
#pragma once

#include "skin_topology.h"

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/node_field.h>
#include <vdbfrac/tetmesh/stencil.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::skin {

/// Names a node, an edge, a face or a tet: the lowest node, then three bits for each node above it.
using SimplexKey = std::uint64_t;

/// A tet with its nodes along the chain. Node 0 is the voxel's lowest corner, node 3 its highest.
struct LatticeTet {
    std::array<Coord, 4> node;
    std::array<std::uint8_t, 4> mask{};
};

/// Calls visit(node) for the ends of the edges at a node.
template <class Visit>
void forNeighbours(Coord n, const Visit& visit)
{
    for (int mask = 1; mask < 8; ++mask)
        for (const int sign : {1, -1}) visit(n + sign * tetmesh::cornerOffset(mask));
}

/// Well mixed bits of a number (the finalizer of SplitMix64: Steele et al. 2014).
std::uint64_t mixedBits(std::uint64_t z);

class CrackLattice {
public:
    /// c [m]; `now`: phi [m] at present; dx: voxel size [m].
    CrackLattice(const tetmesh::NodeField<float>& c, const tetmesh::NodeField<float>& now, double dx);

    double voxelSize() const { return dx_; }
    double c(Coord node) const { return c_(node); }
    bool isOpen(Coord node) const { return c_(node) > 0; }  ///< in a crack
    double smoothC(const Vec3& X) const;                    ///< trilinear between the nodes; X [m]
    Vec3 position(Coord node) const;
    /// Voxels, by their lowest corner, with nodes on both sides of c = 0; in a fixed order.
    const std::vector<Coord>& mixedVoxels() const { return mixed_; }
    bool isMixed(Coord voxel) const { return isMixed_(voxel) != 0; }
    bool isMixed(const LatticeTet& tet) const;

    static LatticeTet tet(Coord voxel, int k);  ///< k in [0, 6)
    SimplexKey key(const LatticeTet& tet) const { return keyOf(tet, {0, 1, 2, 3}, 4); }
    /// Of nodes a < b, and a < b < c, of a tet.
    SimplexKey edgeKey(const LatticeTet& tet, int a, int b) const { return keyOf(tet, {a, b, 0, 0}, 2); }
    SimplexKey faceKey(const LatticeTet& tet, int a, int b, int c) const { return keyOf(tet, {a, b, c, 0}, 3); }
    SimplexKey nodeKey(Coord node) const;

    /// Of the nodes that are not open, the one deepest in the material at present.
    Coord anchor(std::span<const Coord> nodes) const;

private:
    SimplexKey keyOf(const LatticeTet& tet, std::array<int, 4> nodes, int count) const;

    const tetmesh::NodeField<float>&c_, &now_;
    double dx_;
    Coord lower_;
    std::vector<Coord> mixed_;
    tetmesh::NodeField<std::uint8_t> isMixed_;
};

/// Calls visit(voxel) for the voxels that a triangle meets, and a few beside it.
template <class Visit>
void forVoxels(const SkinTopology& skin, std::uint32_t triangle, const CrackLattice& lattice, const Visit& visit)
{
    constexpr double kMargin = 1e-5;  // voxels: more than the nodes were moved
    const auto& t = skin.triangles[triangle];
    const Vec3 &a = skin.points[t[0]], &b = skin.points[t[1]], &c = skin.points[t[2]];
    const double dx = lattice.voxelSize();
    const Vec3 low = a.cwiseMin(b).cwiseMin(c) / dx - Vec3::Constant(kMargin);
    const Vec3 high = a.cwiseMax(b).cwiseMax(c) / dx + Vec3::Constant(kMargin);
    const Vec3 normal = (b - a).cross(c - a) / dx;
    const auto floor = [](double v) { return int(std::floor(v)); };
    for (int z = floor(low.z()); z <= floor(high.z()); ++z)
        for (int y = floor(low.y()); y <= floor(high.y()); ++y)
            for (int x = floor(low.x()); x <= floor(high.x()); ++x) {
                // The plane of the triangle against the voxel.
                const Vec3 middle = Vec3(x + .5, y + .5, z + .5) - a / dx;
                if (std::abs(normal.dot(middle)) <= (0.5 + kMargin) * normal.lpNorm<1>()) visit(Coord{x, y, z});
            }
}

}  // namespace vdbfrac::skin
