#include "crack_lattice.h"

#include <vdbfrac/tetmesh/cell.h>
#include <vdbfrac/tetmesh/noise.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <algorithm>
#include <bit>

namespace vdbfrac::skin {

namespace {

constexpr int kBits = tetmesh::kPlaceBits;

/// Corners of Kuhn's tets along their chains.
std::array<std::array<std::uint8_t, 4>, 6> chains()
{
    std::array<std::array<std::uint8_t, 4>, 6> all{};
    const tetmesh::CellTets& cell = tetmesh::cellTets(tetmesh::CellShape::six);
    for (std::size_t t = 0; t < 6; ++t) {
        for (std::size_t a = 0; a < 4; ++a) all[t][a] = std::uint8_t(cell.corner[t][a]);
        std::sort(all[t].begin(), all[t].end(), [](std::uint8_t a, std::uint8_t b) {
            return std::popcount(unsigned(a)) < std::popcount(unsigned(b));
        });
    }
    return all;
}

}  // namespace

CrackLattice::CrackLattice(const tetmesh::NodeField<float>& c, const tetmesh::NodeField<float>& now, double dx)
    : c_(c), now_(now), dx_(dx), lower_(c.lower() - Coord{1, 1, 1}), isMixed_(c.lower(), c.upper(), 0, 0)
{
    const auto addIfMixed = [&](Coord v) {
        int open = 0;
        for (int k = 0; k < 8; ++k) open += c_(v + tetmesh::cornerOffset(k)) > 0;
        if (open == 0 || open == 8 || !isMixed_.contains(v) || isMixed_(v)) return;
        mixed_.push_back(v);
        isMixed_.set(v, 1);
    };
    using Field = tetmesh::NodeField<float>;
    c.forEachBlock([&](Coord low) { Field::forEachNode(low, addIfMixed); });
    // A voxel may have its upper corners in a block, and its lowest where there is none.
    c.forEachBlock([&](Coord low) {
        for (int z = -1; z < Field::kEdge; ++z)
            for (int y = -1; y < Field::kEdge; ++y)
                for (int x = -1; x < (z < 0 || y < 0 ? Field::kEdge : 0); ++x) addIfMixed(low + Coord{x, y, z});
    });
}

Vec3 CrackLattice::position(Coord n) const
{
    constexpr double kMoved = 1e-6, kUnit = 1. / double(1 << 20);  // voxels; of 20 bits
    const std::uint64_t bits = tetmesh::mixedBits(nodeKey(n));
    const auto part = [&](int k) { return kMoved * (kUnit * double(bits >> (20 * k) & 0xfffff) - 0.5); };
    return dx_ * (n.toVec() + Vec3(part(0), part(1), part(2)));
}

double CrackLattice::smoothC(const Vec3& X) const { return tetmesh::trilinear(c_, X / dx_); }

bool CrackLattice::isMixed(const LatticeTet& tet) const
{
    const bool first = isOpen(tet.node[0]);
    return isOpen(tet.node[1]) != first || isOpen(tet.node[2]) != first || isOpen(tet.node[3]) != first;
}

LatticeTet CrackLattice::tet(Coord voxel, int k)
{
    static const auto kChains = chains();
    LatticeTet t;
    t.mask = kChains[std::size_t(k)];
    for (std::size_t a = 0; a < 4; ++a) t.node[a] = voxel + tetmesh::cornerOffset(t.mask[a]);
    return t;
}

SimplexKey CrackLattice::nodeKey(Coord n) const
{
    const Coord d = n - lower_;
    return (SimplexKey(d.z) << 2 * kBits | SimplexKey(d.y) << kBits | SimplexKey(d.x)) << 9;
}

SimplexKey CrackLattice::keyOf(const LatticeTet& tet, std::array<int, 4> nodes, int count) const
{
    const std::size_t first = std::size_t(nodes[0]);
    SimplexKey key = nodeKey(tet.node[first]);
    for (int k = 1; k < count; ++k)
        key |= SimplexKey(tet.mask[std::size_t(nodes[std::size_t(k)])] ^ tet.mask[first]) << (9 - 3 * k);
    return key;
}

Coord CrackLattice::anchor(std::span<const Coord> nodes) const
{
    const Coord* best = nullptr;
    for (const Coord& n : nodes)
        if (!isOpen(n) && (!best || now_(n) < now_(*best))) best = &n;
    return best ? *best : nodes[0];
}

}  // namespace vdbfrac::skin
