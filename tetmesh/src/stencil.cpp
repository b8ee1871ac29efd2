#include <vdbfrac/tetmesh/stencil.h>

#include <algorithm>
#include <cassert>

namespace vdbfrac::tetmesh {

std::uint8_t kuhnTetOf(const Vec3& p)
{
    std::array<int, 3> axis{0, 1, 2};
    std::stable_sort(axis.begin(), axis.end(), [&](int a, int b) { return p[a] > p[b]; });
    const CellTets& cell = cellTets(CellShape::six);
    for (int t = 0; t < cell.count; ++t) {
        const auto& corner = cell.corner[std::size_t(t)];
        const auto has = [&](int c) { return std::find(corner.begin(), corner.end(), c) != corner.end(); };
        if (has(1 << axis[0]) && has(1 << axis[0] | 1 << axis[1])) return std::uint8_t(t);
    }
    assert(false);
    return 0;
}

CellStencil makeCellStencil(const Lattice& lattice, CellShape shape)
{
    const int m = lattice.coarsening, n = m + 1;
    CellStencil stencil;
    for (int z = 0; z < n; ++z)
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < n; ++x) stencil.vertices.push_back({x, y, z});

    const CellTets& tets = cellTets(shape);
    for (int z = 0; z < m; ++z)
        for (int y = 0; y < m; ++y)
            for (int x = 0; x < m; ++x)
                for (int t = 0; t < tets.count; ++t) {
                    SubTet sub{};
                    sub.voxel = {x, y, z};
                    Vec3 center = Vec3::Zero();
                    for (std::size_t a = 0; a < 4; ++a) {
                        const Coord v = Coord{x, y, z} + cornerOffset(tets.corner[std::size_t(t)][a]);
                        sub.vertex[a] = std::uint16_t((v.z * n + v.y) * n + v.x);
                        center += 0.25 * v.toVec();
                    }
                    sub.parent = m == 1 ? std::uint8_t(t) : kuhnTetOf(center / m);
                    stencil.subTets.push_back(sub);
                }
    return stencil;
}

StarStencil makeStarStencil(const Lattice& lattice, bool odd)
{
    const int m = lattice.coarsening, n = 2 * m + 1;
    StarStencil star;
    star.reach = m;
    star.index.assign(std::size_t(n * n * n), -1);
    std::vector<Coord> voxels;
    const auto vertexAt = [&](Coord offset) {
        const Coord at = offset + Coord{m, m, m};
        std::int32_t& index = star.index[std::size_t((at.z * n + at.y) * n + at.x)];
        if (index < 0) {
            index = std::int32_t(star.vertices.size());
            star.vertices.push_back(offset);
        }
        return std::uint16_t(index);
    };
    for (int c = 0; c < kCorners; ++c) {  // the node is corner c of this cell
        const Coord cell = -1 * cornerOffset(c);
        const CellShape shape = lattice.shapeOf(cell + Coord{odd, 0, 0});
        const CellStencil stencil = makeCellStencil(lattice, shape);
        for (std::uint32_t s = 0; s < stencil.subTets.size(); ++s) {
            const SubTet& sub = stencil.subTets[s];
            const auto& corner = cellTets(shape).corner[sub.parent];
            if (std::find(corner.begin(), corner.end(), c) == corner.end()) continue;
            StarStencil::Tet tet{{}, std::uint8_t(c), s};
            for (std::size_t a = 0; a < 4; ++a) tet.vertex[a] = vertexAt(m * cell + stencil.vertices[sub.vertex[a]]);
            star.subTets.push_back(tet);
            voxels.push_back(m * cell + sub.voxel);
        }
    }
    star.ofTets = star.vertices.size();
    for (Coord voxel : voxels)
        for (int c = 0; c < kCorners; ++c) vertexAt(voxel + cornerOffset(c));
    return star;
}

}  // namespace vdbfrac::tetmesh
