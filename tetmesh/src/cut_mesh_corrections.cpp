// A cut lattice and the true shape of the body at rest.
#include "coord_ranges.h"
#include "true_share.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/cut_mesh.h>

#include <algorithm>

namespace vdbfrac::tetmesh {

/// After the first cut, which is linear: finds how it differs from the shape, and cuts again where it does.
void CutMesh::correct(const RestShape& shape)
{
    constexpr std::size_t kCorrectChunk = 64;
    std::vector<std::uint32_t> cut, corrected;
    for (std::size_t i = 0; i < cells_.size(); ++i)
        if (!cells_[i].whole) cut.push_back(std::uint32_t(i));
    std::vector<Corrections> found(cut.size());
    parallelChunks(cut.size(), kCorrectChunk, [&](std::size_t begin, std::size_t end) {
        TrueShare share(shape, lattice_.voxelSize);
        for (std::size_t i = begin; i < end; ++i) found[i] = correctionsOf(cells_[cut[i]], share);
    });
    for (std::size_t i = 0; i < cut.size(); ++i) {
        if (found[i].factor.empty()) continue;
        cells_[cut[i]].corrections = std::uint32_t(corrections_.size());
        corrections_.push_back(std::move(found[i]));
        corrected.push_back(cut[i]);
    }
    cutCells(corrected);
}

/// No factors where the linear cut is true.
CutMesh::Corrections CutMesh::correctionsOf(const Cell& cell, TrueShare& share) const
{
    const CellStencil& stencil = cellStencil_[std::size_t(lattice_.shapeOf(cell.coord))];
    const Coord base = lattice_.coarsening * cell.coord;
    Corrections all{std::vector<double>(stencil.subTets.size(), 0), {}};
    bool isTrue = true;
    auto piece = cell.pieces.begin();
    for (std::size_t s = 0; s < stencil.subTets.size(); ++s) {
        const SubTet& sub = stencil.subTets[s];
        const bool hasPiece = piece != cell.pieces.end() && piece->subTet == s;
        if (!hasPiece && anchorOf(base + sub.voxel) < 0) continue;
        std::array<Vec3, 4> X;
        for (std::size_t a = 0; a < 4; ++a)
            X[a] = lattice_.voxelSize * (base + stencil.vertices[sub.vertex[a]]).toVec();
        const double part = share.of(X);
        double& factor = all.factor[s];
        if (hasPiece)
            factor = correction(part, piece++->cut.fraction);
        else if (part >= kMinShare && share.faces() != 0) {
            factor = part;
            all.attached.resize(all.factor.size());
            all.attached[s] = share.faces();
        }
        isTrue = isTrue && factor == (hasPiece ? 1 : 0);
    }
    if (isTrue) all.factor.clear();
    return all;
}

/// The corner of a voxel that its attached sub-tets hang on: the deepest at rest. -1 without any, or when any corner
/// that was inside has failed: so a crack one voxel wide parts them, too.
int CutMesh::anchorOf(Coord voxel) const
{
    int anchor = -1;
    double deepest = 0;
    for (int c = 0; c < kCorners; ++c) {
        const Coord corner = voxel + cornerOffset(c);
        const double phi = seen(rest_(corner));
        if (!(phi < 0)) continue;
        if (!(seenPhi(corner) < 0)) return -1;
        if (phi < deepest) anchor = c, deepest = phi;
    }
    return anchor;
}

/// Of a sub-tet without a vertex inside: is it material?
bool CutMesh::isAttached(const Cell& cell, std::size_t subTet) const
{
    const Corrections& own = corrections_[cell.corrections];
    if (own.attached.empty() || own.attached[subTet] == 0) return false;
    const CellStencil& stencil = cellStencil_[std::size_t(lattice_.shapeOf(cell.coord))];
    const SubTet& sub = stencil.subTets[subTet];
    const Coord base = lattice_.coarsening * cell.coord;
    for (std::uint16_t v : sub.vertex)
        if (seen(rest_(base + stencil.vertices[v])) < 0) return false;  // it was cut, and has failed
    return anchorOf(base + sub.voxel) >= 0;
}

bool CutMesh::hasAttached(Coord cell) const
{
    const std::int32_t i = corrections_.size() > 1 ? cellIndex_(cell) : -1;
    return i >= 0 && !corrections_[cells_[std::size_t(i)].corrections].attached.empty();
}

/// Of each sub-tet of a star; empty when none is attached.
std::vector<AttachedTet> CutMesh::attachedTets(Coord node) const
{
    bool any = false;
    forCellsRound(node, 1, [&](Coord cell) { any = any || hasAttached(cell); });
    if (!any) return {};
    const StarStencil& star = this->star(node);
    std::vector<AttachedTet> attached(star.subTets.size());
    for (std::size_t i = 0; i < attached.size(); ++i) {
        const StarStencil::Tet& tet = star.subTets[i];
        const Coord offset = -1 * cornerOffset(tet.corner);
        const std::int32_t index = cellIndex_(node + offset);
        if (index < 0 || !isAttached(cells_[std::size_t(index)], tet.subTet)) continue;
        const Coord voxel = stencil(lattice_.shapeOf(node + offset)).subTets[tet.subTet].voxel;
        const int corner = anchorOf(lattice_.coarsening * (node + offset) + voxel);
        attached[i] = {star.find(lattice_.coarsening * offset + voxel + cornerOffset(corner)),
                       corrections_[cells_[std::size_t(index)].corrections].attached[tet.subTet]};
    }
    return attached;
}

}  // namespace vdbfrac::tetmesh
