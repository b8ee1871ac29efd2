// Reads the corners of eight cells from the rows of a patch, and adds to them. Only for the parts of a kernel.
#pragma once

#include "kernel_packs.h"

namespace vdbfrac::solver {

namespace {

template <class P, int rows = 3>
using CornersOf = P[tetmesh::kCorners][rows];
using Corners = CornersOf<Pack>;

/// Corner c of lane l is node corner[c][l].
template <int corners, class Real>
VDBFRAC_INLINE_WIDE void gatherLanes(const std::uint16_t (*corner)[kLanes], int stride, const Real* in,
                                     CornersOf<PackT<Real>>& u)
{
    for (int c = 0; c < corners; ++c)
        for (int i = 0; i < 3; ++i)
            for (int l = 0; l < kLanes; ++l) u[c][i][l] = in[i * stride + corner[c][l]];
}

template <int corners, class Real, int rows>
VDBFRAC_INLINE_WIDE void scatterLanes(const std::uint16_t (*corner)[kLanes], int stride,
                                      const PackT<Real> (&f)[tetmesh::kCorners][rows], Real* out)
{
    for (int c = 0; c < corners; ++c)
        for (int i = 0; i < rows; ++i)
            for (int l = 0; l < kLanes; ++l) out[i * stride + corner[c][l]] += f[c][i][l];
}

template <class Real>
VDBFRAC_INLINE void gatherCells(const PatchData& patch, const Batch& batch, const Real* in, CornersOf<PackT<Real>>& u)
{
    if (batch.gathered < 0) {
        for (int c = 0; c < tetmesh::kCorners; ++c)
            for (int i = 0; i < 3; ++i) u[c][i] = loadLoose(in + i * patch.stride + batch.corner[c]);
        return;
    }
    gatherLanes<tetmesh::kCorners>(patch.corners[batch.gathered].corner, patch.stride, in, u);
}

/// Adds f to the rows of `out`. In a row of cells the corners at x + 1 are those at x of the next cell: both are added
/// up in registers, and memory sees one addition for each line of nodes.
template <int rows, class Real>
VDBFRAC_INLINE void scatterCells(const PatchData& patch, const Batch& batch, const CornersOf<PackT<Real>, rows>& f,
                                 Real* out)
{
    if (batch.gathered >= 0)
        return scatterLanes<tetmesh::kCorners>(patch.corners[batch.gathered].corner, patch.stride, f, out);
    for (int c = 0; c < tetmesh::kCorners; c += 2)
        for (int i = 0; i < rows; ++i) {
            Real* at = out + i * patch.stride + batch.corner[c];
            const PackT<Real> next = __builtin_shufflevector(f[c + 1][i], PackT<Real>{}, 8, 0, 1, 2, 3, 4, 5, 6);
            storeLoose(at, loadLoose(at) + (f[c][i] + next));
            at[kLanes] += f[c + 1][i][kLanes - 1];
        }
}

}  // namespace

}  // namespace vdbfrac::solver
