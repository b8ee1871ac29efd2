// Corners, rest shapes and volumes of the tets of eight cells, and what is summed up over them. Part of
// kernel_impl.cpp.
#pragma once

#include "kernel.h"
#include "kernel_polar.h"

namespace vdbfrac::solver {

namespace {

using tetmesh::CellShape;
using tetmesh::kCellTets;

template <class P>
using CornersOf = P[tetmesh::kCorners][3];
using Corners = CornersOf<Pack>;

/// Volume shares of the tets of a batch: its own if it is cut, else those of a whole cell.
template <CellShape shape>
struct WholeVolumes {
    alignas(64) double share[tetmesh::kMostTets][kLanes];
    constexpr WholeVolumes() : share{}
    {
        for (int t = 0; t < tetmesh::kMostTets; ++t)
            for (int l = 0; l < kLanes; ++l) share[t][l] = kCellTets<shape>.volume[std::size_t(t)];
    }
};
template <CellShape shape>
constexpr WholeVolumes<shape> kWhole;

/// Rest shape of eight tets, for elements that are tets.
template <CellShape shape>
VDBFRAC_INLINE const LaneTets* ownTets(const PatchData& patch, const Batch& batch)
{
    return shape == CellShape::tet ? patch.tets + batch.cut : nullptr;
}

template <CellShape shape>
VDBFRAC_INLINE const double (*volumeShares(const PatchData& patch, const Batch& batch))[kLanes]
{
    if constexpr (shape == CellShape::tet) return patch.tets[batch.cut].share;
    return batch.cut < 0 ? kWhole<shape>.share : patch.volumes[batch.cut].share;
}

template <CellShape shape, class Real>
VDBFRAC_INLINE void gather(const PatchData& patch, const Batch& batch, const Real* in, CornersOf<PackT<Real>>& u)
{
    if constexpr (shape == CellShape::tet) {
        for (int c = 0; c < 4; ++c)
            for (int i = 0; i < 3; ++i)
                for (int l = 0; l < kLanes; ++l) u[c][i][l] = in[i * patch.stride + patch.tets[batch.cut].corner[c][l]];
        return;
    }
    if (batch.gathered < 0) {
        for (int c = 0; c < tetmesh::kCorners; ++c)
            for (int i = 0; i < 3; ++i) u[c][i] = loadLoose(in + i * patch.stride + batch.corner[c]);
        return;
    }
    const LaneCorners& lanes = patch.corners[batch.gathered];
    for (int c = 0; c < tetmesh::kCorners; ++c)
        for (int i = 0; i < 3; ++i)
            for (int l = 0; l < kLanes; ++l) u[c][i][l] = in[i * patch.stride + lanes.corner[c][l]];
}

/// Adds f to the rows of `out`. In a row of cells the corners at x + 1 are those at x of the next cell: both are added
/// up in registers, and memory sees one addition for each line of nodes.
template <CellShape shape, int rows, class Real>
VDBFRAC_INLINE void scatter(const PatchData& patch, const Batch& batch, const PackT<Real> (&f)[tetmesh::kCorners][rows],
                            Real* out)
{
    if constexpr (shape == CellShape::tet) {
        for (int c = 0; c < 4; ++c)
            for (int i = 0; i < rows; ++i)
                for (int l = 0; l < kLanes; ++l)
                    out[i * patch.stride + patch.tets[batch.cut].corner[c][l]] += f[c][i][l];
        return;
    }
    if (batch.gathered < 0) {
        for (int c = 0; c < tetmesh::kCorners; c += 2)
            for (int i = 0; i < rows; ++i) {
                Real* at = out + i * patch.stride + batch.corner[c];
                const PackT<Real> next = __builtin_shufflevector(f[c + 1][i], PackT<Real>{}, 8, 0, 1, 2, 3, 4, 5, 6);
                storeLoose(at, loadLoose(at) + (f[c][i] + next));
                at[kLanes] += f[c + 1][i][kLanes - 1];
            }
        return;
    }
    const LaneCorners& lanes = patch.corners[batch.gathered];
    for (int c = 0; c < tetmesh::kCorners; ++c)
        for (int i = 0; i < rows; ++i)
            for (int l = 0; l < kLanes; ++l) out[i * patch.stride + lanes.corner[c][l]] += f[c][i][l];
}

/// a = g b on the first term of a sum, a += g b later; g is known at compile time, and mostly 1 or -1.
template <bool first, class P>
VDBFRAC_INLINE void addScaled(P& a, double g, P b)
{
    using Real = std::remove_cvref_t<decltype(a[0])>;
    if (first)
        a = g == 1 ? b : Real(g) * b;
    else if (g == 1)
        a += b;
    else if (g == -1)
        a -= b;
    else
        a += Real(g) * b;
}

/// Component d of h grad N_(a + 1).
template <class P>
VDBFRAC_INLINE P gradientOf(const LaneTets* own, int a, int d)
{
    return load<std::remove_cvref_t<decltype(P{}[0])>>(own->gradient[a][d]);
}

/// First tet vertex whose gradient has a positive component d: the sum starts there.
constexpr int firstVertex(CellShape shape, int t, int d)
{
    const tetmesh::CellTets cell = tetmesh::makeCellTets(shape);
    for (int a = 0; a < 4; ++a)
        if (cell.gradient[std::size_t(t)][std::size_t(a)][std::size_t(d)] > 0) return a;
    return 0;
}

/// E = sum_a u_a (x) (h grad N_a): differences of corner values, where the rest shape is that of the lattice.
template <CellShape shape, int t, class P>
VDBFRAC_INLINE void differences(const LaneTets* own, const CornersOf<P>& u, MatrixOf<P>& E)
{
    if constexpr (shape == CellShape::tet) {
        for (int i = 0; i < 3; ++i) {
            const P edge[3] = {u[1][i] - u[0][i], u[2][i] - u[0][i], u[3][i] - u[0][i]};
            for (int d = 0; d < 3; ++d)
                E[i][d] = gradientOf<P>(own, 0, d) * edge[0] + gradientOf<P>(own, 1, d) * edge[1] +
                          gradientOf<P>(own, 2, d) * edge[2];
        }
        return;
    }
    unroll<3>([&](auto d) __attribute__((always_inline)) {
        constexpr int first = firstVertex(shape, t, d);
        constexpr auto& tets = kCellTets<shape>;
        for (int i = 0; i < 3; ++i) addScaled<true>(E[i][d], tets.gradient[t][first][d], u[tets.corner[t][first]][i]);
        unroll<4>([&](auto a) __attribute__((always_inline)) {
            constexpr double g = tets.gradient[t][a][d];
            if constexpr (g != 0 && a != first)
                for (int i = 0; i < 3; ++i) addScaled<false>(E[i][d], g, u[tets.corner[t][a]][i]);
        });
    });
}

/// f_a += P (h grad N_a).
template <CellShape shape, int t, class P>
VDBFRAC_INLINE void spread(const LaneTets* own, const MatrixOf<P>& stress, CornersOf<P>& f)
{
    if constexpr (shape == CellShape::tet) {
        for (int a = 0; a < 3; ++a)
            for (int i = 0; i < 3; ++i) {
                const P force = stress[i][0] * gradientOf<P>(own, a, 0) + stress[i][1] * gradientOf<P>(own, a, 1) +
                                stress[i][2] * gradientOf<P>(own, a, 2);
                f[a + 1][i] += force;
                f[0][i] -= force;
            }
        return;
    }
    constexpr auto& tets = kCellTets<shape>;
    unroll<4>([&](auto a) __attribute__((always_inline)) {
        unroll<3>([&](auto d) __attribute__((always_inline)) {
            constexpr double g = tets.gradient[t][a][d];
            if constexpr (g != 0)
                for (int i = 0; i < 3; ++i) addScaled<false>(f[tets.corner[t][a]][i], g, stress[i][d]);
        });
    });
}

/// Mean over the tets of a cell weighted by volume; 0 in a cell without material.
template <int tets, class P>
VDBFRAC_INLINE P cellMean(const double (*share)[kLanes], const P (&value)[tetmesh::kMostTets])
{
    using Real = std::remove_cvref_t<decltype(P{}[0])>;
    P sum = {}, volume = {};
    for (int t = 0; t < tets; ++t) {
        const P V = load<Real>(share[t]);
        sum += V * value[t];
        volume += V;
    }
    return volume > 0 ? sum / volume : P{};
}

}  // namespace

}  // namespace vdbfrac::solver
