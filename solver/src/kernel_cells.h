// Eight cells at a time: their corners, the rest gradients and volumes of their tets, and sums over these. Only for
// the parts of a kernel.
//
// A type of cells says which rest gradients it has:
//   LatticeCells  those of the lattice, known at compile time: differences of corner values
//   TetCells      its own: one tet of any shape a lane
//   FlowedCells   its own: cells of the lattice that have flowed; one loop for all their shapes
#pragma once

#include "kernel_gather.h"
#include "kernel_polar.h"

namespace vdbfrac::solver {

namespace {

using tetmesh::CellShape;
using tetmesh::kCellTets;

/// h grad N of the last three vertices of a tet: TetGradients in eight lanes.
using LaneGradients = double[3][3][kLanes];
/// Volume shares of the tets of eight cells.
using Shares = const double (*)[kLanes];

/// Volume shares of whole cells.
template <CellShape shape>
struct WholeVolumes {
    alignas(64) double share[tetmesh::kMaxTets][kLanes];
    constexpr WholeVolumes() : share{}
    {
        for (int t = 0; t < tetmesh::kMaxTets; ++t)
            for (int l = 0; l < kLanes; ++l) share[t][l] = kCellTets<shape>.volume[std::size_t(t)];
    }
};
template <CellShape shape>
constexpr WholeVolumes<shape> kWhole;

/// As tetmesh::cellTets(), which would be shared with code for other units.
inline const tetmesh::CellTets& tetsOf(CellShape shape)
{
    switch (shape) {
    case CellShape::six: return kCellTets<CellShape::six>;
    case CellShape::fiveEven: return kCellTets<CellShape::fiveEven>;
    case CellShape::fiveOdd: return kCellTets<CellShape::fiveOdd>;
    case CellShape::tet: break;
    }
    return kCellTets<CellShape::tet>;
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

/// First tet vertex whose gradient has a positive component d: the sum starts there.
constexpr int firstVertex(CellShape shape, int t, int d)
{
    const tetmesh::CellTets cell = tetmesh::makeCellTets(shape);
    for (int a = 0; a < 4; ++a)
        if (cell.gradient[std::size_t(t)][std::size_t(a)][std::size_t(d)] > 0) return a;
    return 0;
}

template <CellShape shape>
class LatticeCells {
public:
    static constexpr int kTets = kCellTets<shape>.count, kCorners = tetmesh::kCorners;
    static constexpr int count() { return kTets; }
    const Shares share;

    VDBFRAC_INLINE LatticeCells(const PatchData& patch, const Batch& batch)
        : share(batch.cut < 0 ? kWhole<shape>.share : patch.volumes[batch.cut].share), patch_(patch), batch_(batch)
    {
    }

    template <class F>
    VDBFRAC_INLINE static void eachTet(const F& f)
    {
        unroll<kTets>(f);
    }
    template <class Real>
    VDBFRAC_INLINE void gather(const Real* in, CornersOf<PackT<Real>>& u) const
    {
        gatherCells(patch_, batch_, in, u);
    }
    template <class Real>
    VDBFRAC_INLINE void scatter(const CornersOf<PackT<Real>>& f, Real* out) const
    {
        scatterCells<3>(patch_, batch_, f, out);
    }

    /// E = sum_a u_a (x) (h grad N_a).
    template <class P, int t>
    VDBFRAC_INLINE static void differences(std::integral_constant<int, t>, const CornersOf<P>& u, MatrixOf<P>& E)
    {
        unroll<3>([&](auto d) __attribute__((always_inline)) {
            constexpr int first = firstVertex(shape, t, d);
            constexpr auto& tets = kCellTets<shape>;
            for (int i = 0; i < 3; ++i)
                addScaled<true>(E[i][d], tets.gradient[t][first][d], u[tets.corner[t][first]][i]);
            unroll<4>([&](auto a) __attribute__((always_inline)) {
                constexpr double g = tets.gradient[t][a][d];
                if constexpr (g != 0 && a != first)
                    for (int i = 0; i < 3; ++i) addScaled<false>(E[i][d], g, u[tets.corner[t][a]][i]);
            });
        });
    }
    /// f_a += P (h grad N_a).
    template <class P, int t>
    VDBFRAC_INLINE static void spread(std::integral_constant<int, t>, const MatrixOf<P>& stress, CornersOf<P>& f)
    {
        constexpr auto& tets = kCellTets<shape>;
        unroll<4>([&](auto a) __attribute__((always_inline)) {
            unroll<3>([&](auto d) __attribute__((always_inline)) {
                constexpr double g = tets.gradient[t][a][d];
                if constexpr (g != 0)
                    for (int i = 0; i < 3; ++i) addScaled<false>(f[tets.corner[t][a]][i], g, stress[i][d]);
            });
        });
    }

private:
    const PatchData& patch_;
    const Batch& batch_;
};

/// Component d of h grad N_(a + 1).
template <class P>
VDBFRAC_INLINE P gradientOf(const LaneGradients& own, int a, int d)
{
    return load<std::remove_cvref_t<decltype(P{}[0])>>(own[a][d]);
}

/// All of them, before there is arithmetic with them: the order decides what fuses, and has to be that of all units.
template <class P>
VDBFRAC_INLINE void loadGradients(const LaneGradients& own, MatrixOf<P>& g)
{
    for (int a = 0; a < 3; ++a)
        for (int d = 0; d < 3; ++d) g[a][d] = gradientOf<P>(own, a, d);
}

/// Of the tet whose vertices are the given corners.
template <class P, class Vertices>
VDBFRAC_INLINE void ownDifferences(const LaneGradients& own, const Vertices& c, const CornersOf<P>& u, MatrixOf<P>& E)
{
    MatrixOf<P> g;
    loadGradients(own, g);
    for (int i = 0; i < 3; ++i) {
        const P edge[3] = {u[c[1]][i] - u[c[0]][i], u[c[2]][i] - u[c[0]][i], u[c[3]][i] - u[c[0]][i]};
        for (int d = 0; d < 3; ++d) E[i][d] = g[0][d] * edge[0] + g[1][d] * edge[1] + g[2][d] * edge[2];
    }
}

template <class P, class Vertices>
VDBFRAC_INLINE void ownSpread(const LaneGradients& own, const Vertices& c, const MatrixOf<P>& stress, CornersOf<P>& f)
{
    MatrixOf<P> g;
    loadGradients(own, g);
    for (int a = 0; a < 3; ++a)
        for (int i = 0; i < 3; ++i) {
            const P force = stress[i][0] * g[a][0] + stress[i][1] * g[a][1] + stress[i][2] * g[a][2];
            f[c[a + 1]][i] += force;
            f[c[0]][i] -= force;
        }
}

class TetCells {
public:
    static constexpr int kTets = 1, kCorners = 4;
    static constexpr int count() { return kTets; }
    const Shares share;

    VDBFRAC_INLINE TetCells(const PatchData& patch, const Batch& batch)
        : share(patch.tets[batch.cut].share), patch_(patch), tets_(patch.tets[batch.cut])
    {
    }

    template <class F>
    VDBFRAC_INLINE static void eachTet(const F& f)
    {
        unroll<1>(f);
    }
    template <class Real>
    VDBFRAC_INLINE void gather(const Real* in, CornersOf<PackT<Real>>& u) const
    {
        gatherLanes<kCorners>(tets_.corner, patch_.stride, in, u);
    }
    template <class Real>
    VDBFRAC_INLINE void scatter(const CornersOf<PackT<Real>>& f, Real* out) const
    {
        scatterLanes<kCorners>(tets_.corner, patch_.stride, f, out);
    }
    template <class P>
    VDBFRAC_INLINE void differences(int, const CornersOf<P>& u, MatrixOf<P>& E) const
    {
        ownDifferences<P>(tets_.gradient, kVertices, u, E);
    }
    template <class P>
    VDBFRAC_INLINE void spread(int, const MatrixOf<P>& stress, CornersOf<P>& f) const
    {
        ownSpread<P>(tets_.gradient, kVertices, stress, f);
    }

private:
    static constexpr int kVertices[4] = {0, 1, 2, 3};

    const PatchData& patch_;
    const LaneTets& tets_;
};

class FlowedCells {
public:
    static constexpr int kTets = tetmesh::kMaxTets, kCorners = tetmesh::kCorners;
    int count() const { return tets_.count; }
    const Shares share;

    VDBFRAC_INLINE FlowedCells(const PatchData& patch, const Batch& batch)
        : share(patch.flowed[batch.cut].share),
          patch_(patch),
          batch_(batch),
          tets_(tetsOf(batch.shape)),
          own_(patch.flowed[batch.cut].gradient)
    {
    }

    template <class F>
    VDBFRAC_INLINE void eachTet(const F& f) const
    {
        inTurn(tets_.count, f);
    }
    template <class Real>
    VDBFRAC_INLINE void gather(const Real* in, CornersOf<PackT<Real>>& u) const
    {
        gatherCells(patch_, batch_, in, u);
    }
    template <class Real>
    VDBFRAC_INLINE void scatter(const CornersOf<PackT<Real>>& f, Real* out) const
    {
        scatterCells<3>(patch_, batch_, f, out);
    }
    template <class P>
    VDBFRAC_INLINE void differences(int t, const CornersOf<P>& u, MatrixOf<P>& E) const
    {
        ownDifferences<P>(own_[t], tets_.corner[std::size_t(t)].data(), u, E);
    }
    template <class P>
    VDBFRAC_INLINE void spread(int t, const MatrixOf<P>& stress, CornersOf<P>& f) const
    {
        ownSpread<P>(own_[t], tets_.corner[std::size_t(t)].data(), stress, f);
    }

private:
    const PatchData& patch_;
    const Batch& batch_;
    const tetmesh::CellTets& tets_;
    const LaneGradients* own_;
};

/// Mean over the tets of a cell weighted by volume; 0 in a cell without material.
template <class Cells, class P>
VDBFRAC_INLINE P cellMean(const Cells& cells, const P* value)
{
    using Real = std::remove_cvref_t<decltype(P{}[0])>;
    P sum = {}, volume = {};
    cells.eachTet([&](auto t) __attribute__((always_inline)) {
        const P V = load<Real>(cells.share[t]);
        sum += V * value[t];
        volume += V;
    });
    return volume > 0 ? sum / volume : P{};
}

/// cells.eachTet for long code: most scenes have cells of six tets alone, and it takes seconds to compile another shape
/// unrolled.
template <class Cells, class F>
VDBFRAC_INLINE void eachTetCompact(const Cells& cells, const F& f)
{
    constexpr bool five = std::is_same_v<Cells, LatticeCells<CellShape::fiveEven>> ||
                          std::is_same_v<Cells, LatticeCells<CellShape::fiveOdd>>;
    if constexpr (five)
        inTurn(cells.count(), f);
    else
        cells.eachTet(f);
}

/// Cells of any of these types, which is asked for at run time.
struct AnyCells {
    const tetmesh::CellTets& tets;
    const LaneGradients* own;  ///< of each tet; null: those of the lattice
    Shares share;

    VDBFRAC_INLINE AnyCells(const PatchData& patch, const Batch& batch)
        : tets(tetsOf(batch.shape)), own(nullptr), share(wholeShares(batch.shape)), patch_(patch), batch_(batch)
    {
        if (batch.shape == CellShape::tet)
            own = &patch.tets[batch.cut].gradient, share = patch.tets[batch.cut].share;
        else if (batch.flowed)
            own = patch.flowed[batch.cut].gradient, share = patch.flowed[batch.cut].share;
        else if (batch.cut >= 0)
            share = patch.volumes[batch.cut].share;
    }
    VDBFRAC_INLINE void scatter(const CornersOf<Pack, 6>& f, double* out) const
    {
        if (batch_.shape == CellShape::tet)
            scatterLanes<4>(patch_.tets[batch_.cut].corner, patch_.stride, f, out);
        else
            scatterCells<6>(patch_, batch_, f, out);
    }

private:
    static Shares wholeShares(CellShape shape)
    {
        switch (shape) {
        case CellShape::six: return kWhole<CellShape::six>.share;
        case CellShape::fiveEven: return kWhole<CellShape::fiveEven>.share;
        case CellShape::fiveOdd: return kWhole<CellShape::fiveOdd>.share;
        case CellShape::tet: break;
        }
        return nullptr;
    }

    const PatchData& patch_;
    const Batch& batch_;
};

/// What the energy takes from means over a cell (kernel.h), at compile time or when it runs.
template <bool ofDilation, bool ofStrain>
struct FixedMeans {
    static constexpr bool dilation = ofDilation, strain = ofStrain;
};
struct Means {
    bool dilation, strain;
};

/// Calls f<Cells>(b, means) for each batch of the patch, with its type of cells. Units that fuse get FixedMeans: what
/// fuses without a mean must not depend on the code for one. Others get Means, which costs little and is a third to
/// compile. A tet alone is its own mean.
template <class F>
VDBFRAC_INLINE void eachBatch(const PatchData& patch, const F& f)
{
    for (int b = 0; b < patch.batches; ++b) {
        const auto with = [&]<class Cells>() {
            constexpr bool several = Cells::kTets > 1;
#if defined(__FMA__)
            if (!patch.cellDilation)
                f.template operator()<Cells>(b, FixedMeans<false, false>());
            else if (several && patch.meanStrain > 0)
                f.template operator()<Cells>(b, FixedMeans<true, several>());
            else
                f.template operator()<Cells>(b, FixedMeans<true, false>());
#else
            f.template operator()<Cells>(b, Means{patch.cellDilation, several && patch.meanStrain > 0});
#endif
        };
        if (patch.batch[b].flowed) {
            with.template operator()<FlowedCells>();
            continue;
        }
        switch (patch.batch[b].shape) {
        case CellShape::six: with.template operator()<LatticeCells<CellShape::six>>(); break;
        case CellShape::fiveEven: with.template operator()<LatticeCells<CellShape::fiveEven>>(); break;
        case CellShape::fiveOdd: with.template operator()<LatticeCells<CellShape::fiveOdd>>(); break;
        case CellShape::tet: with.template operator()<TetCells>(); break;
        }
    }
}

}  // namespace

}  // namespace vdbfrac::solver
