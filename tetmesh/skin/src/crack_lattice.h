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
#include <vdbfrac/tetmesh/parts.h>
#include <vdbfrac/tetmesh/stencil.h>

#include <algorithm>
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

using tetmesh::forNeighbours;

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

/// The voxels that a triangle meets, and a few beside it. Row by row along x: long triangles pass few of the voxels in
/// the box round them, or of those in their plane.
class VoxelsOfTriangle {
public:
    /// The corners [voxels].
    explicit VoxelsOfTriangle(const std::array<Vec3, 3>& p) : from_(p[0])
    {
        constexpr double kLarge = 4;  // voxels along an axis: below this edges are not worth a look
        const Vec3 low = p[0].cwiseMin(p[1]).cwiseMin(p[2]), high = p[0].cwiseMax(p[1]).cwiseMax(p[2]);
        first_ = low - Vec3::Constant(kMargin), last_ = high + Vec3::Constant(kMargin);
        addSlab((p[1] - p[0]).cross(p[2] - p[0]), p);
        // Boxes and triangles that do not meet are apart along one of these (Akenine-Moeller 2001).
        for (int k = 0; k < 3 && (high - low).maxCoeff() > kLarge; ++k)
            for (int axis = 0; axis < 3; ++axis)
                addSlab((p[std::size_t(k + 1) % 3] - p[std::size_t(k)]).cross(Vec3::Unit(axis)), p);
    }

    /// x fastest.
    template <class Visit>
    void visit(const Visit& visit) const
    {
        for (int z = floor(first_.z()); z <= floor(last_.z()); ++z)
            for (int y = floor(first_.y()); y <= floor(last_.y()); ++y) {
                double from = std::floor(first_.x()), to = std::floor(last_.x());
                for (int s = 0; s < slabs_ && from <= to; ++s) slab_[std::size_t(s)].cut(y, z, from, to);
                for (int x = int(from); x <= int(to) && from <= to; ++x) visit(Coord{x, y, z});
            }
    }

private:
    static constexpr double kMargin = 1e-5;  // voxels: more than the nodes of a lattice were moved

    /// Middles of voxels that what lies between two planes can meet.
    struct Slab {
        Vec3 normal;
        double low, high;  // of normal . middle
        /// Leaves the numbers of the voxels of a row that are in it.
        void cut(int y, int z, double& from, double& to) const
        {
            const double beside = normal.y() * (y + .5) + normal.z() * (z + .5);
            if (normal.x() == 0) {
                if (beside < low || beside > high) to = from - 1;
                return;
            }
            const double a = (low - beside) / normal.x() - .5, b = (high - beside) / normal.x() - .5;
            from = std::max(from, std::ceil(std::min(a, b))), to = std::min(to, std::floor(std::max(a, b)));
        }
    };
    static int floor(double v) { return int(std::floor(v)); }
    void addSlab(const Vec3& normal, const std::array<Vec3, 3>& p)
    {
        const double room = (0.5 + kMargin) * normal.lpNorm<1>(), start = normal.dot(from_);
        const double b = normal.dot(p[1] - from_), c = normal.dot(p[2] - from_);
        slab_[std::size_t(slabs_++)] = {normal, start + std::min({0., b, c}) - room,
                                        start + std::max({0., b, c}) + room};
    }

    Vec3 from_, first_, last_;
    std::array<Slab, 10> slab_;
    int slabs_ = 0;
};

/// Calls visit(voxel) for these.
template <class Visit>
void forVoxels(const SkinTopology& skin, std::uint32_t triangle, const CrackLattice& lattice, const Visit& visit)
{
    const auto& t = skin.triangles[triangle];
    const double dx = lattice.voxelSize();
    VoxelsOfTriangle({skin.points[t[0]] / dx, skin.points[t[1]] / dx, skin.points[t[2]] / dx}).visit(visit);
}

}  // namespace vdbfrac::skin
