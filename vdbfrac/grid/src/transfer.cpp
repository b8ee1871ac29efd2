#include <vdbfrac/grid/transfer.h>

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::grid {

namespace {

using tetmesh::Cell;
using tetmesh::CellShape;
using tetmesh::CutMesh;
using tetmesh::kMostTets;
using tetmesh::Piece;

int floorDiv(int a, int m) { return a >= 0 ? a / m : -((m - 1 - a) / m); }

/// Material round a voxel node: sum of the integrals of N_p, and of those times the energy, in units of a voxel.
struct Share {
    double volume = 0, energy = 0;
};

const Piece* pieceOf(const Cell& cell, std::size_t subTet)
{
    const auto it = std::lower_bound(cell.pieces.begin(), cell.pieces.end(), subTet,
                                     [](const Piece& p, std::size_t s) { return p.subTet < s; });
    return it != cell.pieces.end() && it->subTet == subTet ? &*it : nullptr;
}

/// Adds the sub-tets of one voxel cell that have its corner k as a vertex.
void addVoxelCell(const CutMesh& mesh, Coord voxelCell, int k, const TetEnergy& energy, Share& share)
{
    const int m = mesh.lattice().coarsening;
    const Coord coarse{floorDiv(voxelCell.x, m), floorDiv(voxelCell.y, m), floorDiv(voxelCell.z, m)};
    const std::int32_t index = mesh.cellAt(coarse);
    if (index < 0) return;
    const Cell& cell = mesh.cells()[std::size_t(index)];
    const CellShape shape = mesh.lattice().shapeOf(coarse);
    const auto& tets = tetmesh::cellTets(shape);
    const Coord local = voxelCell - m * coarse;
    const std::size_t first = std::size_t(((local.z * m + local.y) * m + local.x) * tets.count);
    for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
        const auto& corner = tets.corner[t];
        const auto a = std::find(corner.begin(), corner.end(), k) - corner.begin();
        if (a == 4) continue;
        const Piece* piece = cell.whole ? nullptr : pieceOf(cell, first + t);
        if (!cell.whole && !piece) continue;
        const double part = tets.volume[t] * (piece ? piece->cut.moment[std::size_t(a)] : 0.25);
        const int parent = mesh.stencil(shape).subTets[first + t].parent;
        share.volume += part;
        share.energy += part * energy(cell.firstElement + (piece ? piece->element : 0u), parent);
    }
}

Share shareOf(const CutMesh& mesh, Coord voxel, const TetEnergy& energy)
{
    Share share;
    for (int k = 0; k < tetmesh::kCorners; ++k)
        addVoxelCell(mesh, voxel - Coord{k & 1, k >> 1 & 1, k >> 2 & 1}, k, energy, share);
    return share;
}

const Cell& cellOf(const CutMesh& mesh, std::size_t element)
{
    const auto after = std::upper_bound(mesh.cells().begin(), mesh.cells().end(), element,
                                        [](std::size_t e, const Cell& cell) { return e < cell.firstElement; });
    return after[-1];
}

/// Adds the voxel nodes of a cell's sub-tets above the threshold. `density`: of the cell's tets; `marks`: scratch.
void addVoxelsAbove(const CutMesh& mesh, const Cell& cell, std::span<const double> density, double threshold,
                    std::vector<std::uint8_t>& marks, std::vector<Coord>& voxels)
{
    const auto& stencil = mesh.stencil(mesh.lattice().shapeOf(cell.coord));
    marks.assign(stencil.vertices.size(), 0);
    const auto add = [&](const tetmesh::SubTet& sub, std::size_t element) {
        if (!(density[element * kMostTets + sub.parent] > threshold)) return;
        for (std::uint16_t v : sub.vertex) marks[v] = 1;
    };
    if (cell.whole)
        for (const auto& sub : stencil.subTets) add(sub, 0);
    else
        for (const Piece& piece : cell.pieces) add(stencil.subTets[piece.subTet], piece.element);
    for (std::size_t v = 0; v < marks.size(); ++v)
        if (marks[v]) voxels.push_back(mesh.lattice().coarsening * cell.coord + stencil.vertices[v]);
}

}  // namespace

std::vector<Coord> voxelsAbove(const CutMesh& mesh, std::span<const double> density, double threshold)
{
    constexpr std::size_t kElements = 4096, kRow = 8;
    const std::size_t elements = mesh.elements().size();
    std::vector<std::vector<Coord>> part((elements + kElements - 1) / kElements);
    const auto anyAbove = [&](std::size_t begin, std::size_t end) {
        std::int64_t above = 0;  // no early way out: this runs through all tets of a body, and a plain loop is fastest
        for (std::size_t i = begin * kMostTets; i < end * kMostTets; ++i) above += density[i] > threshold;
        return above > 0;
    };
    parallelChunks(elements, kElements, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint8_t> marks;
        for (std::size_t row = begin; row < end; row += kRow) {
            const std::size_t rowEnd = std::min(end, row + kRow);
            if (!anyAbove(row, rowEnd)) continue;
            for (std::size_t e = row; e < rowEnd;) {
                const Cell& cell = cellOf(mesh, e);
                const auto own = density.subspan(cell.firstElement * kMostTets, cell.elements * kMostTets);
                if (anyAbove(cell.firstElement, cell.firstElement + cell.elements))
                    addVoxelsAbove(mesh, cell, own, threshold, marks, part[begin / kElements]);
                e = cell.firstElement + cell.elements;
            }
        }
    });
    std::vector<Coord> voxels;
    for (const auto& p : part) voxels.insert(voxels.end(), p.begin(), p.end());
    std::sort(voxels.begin(), voxels.end());
    voxels.erase(std::unique(voxels.begin(), voxels.end()), voxels.end());
    return voxels;
}

std::vector<double> nodalEnergy(const CutMesh& mesh, const TetEnergy& energy, std::span<const Coord> voxels)
{
    std::vector<double> psi(voxels.size());
    parallelChunks(voxels.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Share share = shareOf(mesh, voxels[i], energy);
            psi[i] = share.volume > 0 ? share.energy / share.volume : 0;
        }
    });
    return psi;
}

std::vector<double> averagedEnergy(const CutMesh& mesh, const TetEnergy& energy, std::span<const Coord> voxels, double radius)
{
    const double dx = mesh.lattice().voxelSize;
    const int reach = int(std::floor(radius / dx));
    std::vector<double> psi(voxels.size());
    parallelChunks(voxels.size(), 4, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Share sum;
            for (int z = -reach; z <= reach; ++z)
                for (int y = -reach; y <= reach; ++y)
                    for (int x = -reach; x <= reach; ++x) {
                        const double r2 = dx * dx * (x * x + y * y + z * z) / (radius * radius);
                        if (r2 >= 1) continue;
                        const Share share = shareOf(mesh, voxels[i] + Coord{x, y, z}, energy);
                        const double weight = (1 - r2) * (1 - r2);
                        sum.volume += weight * share.volume;
                        sum.energy += weight * share.energy;
                    }
            psi[i] = sum.volume > 0 ? sum.energy / sum.volume : 0;
        }
    });
    return psi;
}

double nodalVolume(const CutMesh& mesh, Coord voxel)
{
    return shareOf(mesh, voxel, [](std::uint32_t, int) { return 0.; }).volume;
}

}  // namespace vdbfrac::grid
