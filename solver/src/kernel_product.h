// Products with the tangent, in either precision: what the parts kernel_product_*.cpp of a kernel are.
#pragma once

#include "kernel_cells.h"
#include "kernel_parts.h"
#include "kernel_tangents.h"

namespace vdbfrac::solver {

namespace {

template <class P>
VDBFRAC_INLINE P traceOf(const MatrixOf<P>& E, const MatrixOf<P>& R)
{
    P trace = R[0][0] * E[0][0];
    for (int k = 1; k < 9; ++k) trace += R[k / 3][k % 3] * E[k / 3][k % 3];
    return trace;
}

/// Moduli times h, with what damping adds to the tangent and less what yields: of the tets of eight cells, and of their
/// means, which have the share `theta` of the shear modulus.
template <class Real>
struct Moduli {
    PackT<Real> twoMu, lambda, third, twoMuOfMean;
    Real bulk;
    VDBFRAC_INLINE Moduli(const PatchData& patch, int b, double theta)
    {
        const double scale = patch.h * (1 + patch.share);
        const Real whole = Real(2 * patch.mu * scale), lame = Real(patch.lambda * scale);
        const PackT<Real> all = whole * leftOf<Real>(patch, b);
        bulk = lame + whole / 3, lambda = lame + (whole - all) / 3;
        twoMu = Real(1 - theta) * all, third = twoMu / 3, twoMuOfMean = Real(theta) * all;
    }
};

/// From the sum of V E over the tets of a cell to the stress that its mean adds to each, over V.
template <class Real, class Tangents>
VDBFRAC_INLINE void meanStress(const TetTangent& tangent, const Moduli<Real>& m, PackT<Real> volume,
                               MatrixOf<PackT<Real>>& E)
{
    using P = PackT<Real>;
    MatrixOf<P> R, stress;
    P T[6];
    const P inverse = volume > 0 ? Real(1) / volume : P{};
    for (int k = 0; k < 9; ++k) E[k / 3][k % 3] = E[k / 3][k % 3] * inverse;
    loadTangent<Real>(tangent, R, T);
    for (P& v : T) v = v * inverse;
    const P pressure = m.twoMuOfMean / Real(-3) * traceOf<P>(E, R);
    Tangents::template rate<P>(E, R, T, m.twoMuOfMean, pressure, stress);
    for (int k = 0; k < 9; ++k) E[k / 3][k % 3] = stress[k / 3][k % 3];
}

/// Asks the second-level cache for one of `parts` of the tangents of a batch to come: a product is bound by reading
/// them. In parts between the arithmetic, as a core waits once it has asked for some twenty lines.
template <int tets, int parts>
VDBFRAC_INLINE void prefetch(const TetTangent* now, int part)
{
    constexpr int kLine = 64, kAhead = 24;  // tets, or cells; measured
    constexpr int kLines = tets * int(sizeof *now) / kLine;
    const char* const next = reinterpret_cast<const char*>(now + kAhead);
#pragma GCC unroll 64
    for (int i = kLines * part / parts; i < kLines * (part + 1) / parts; ++i)
        __builtin_prefetch(next + kLine * i, 0, 2);
}

/// What it is less by where material flows.
template <class Real, int corners>
VDBFRAC_OUTLINE void subtractFlow(const LaneYielding& yielding, const CornersOf<PackT<Real>>& u,
                                  CornersOf<PackT<Real>>& f)
{
    PackT<Real> rate = {};
    for (int c = 0; c < corners; ++c)
        for (int i = 0; i < 3; ++i) rate += load<Real>(yielding.slope[c][i]) * u[c][i];
    for (int c = 0; c < corners; ++c)
        for (int i = 0; i < 3; ++i) f[c][i] -= rate * load<Real>(yielding.slope[c][i]);
}

template <class Real, class Tangents, class Cells, class M>
void productBatch(const PatchData& patch, int b, M means, const Real* in, Real* out)
{
    using P = PackT<Real>;
    constexpr int tets = Cells::kTets;
    const Batch& batch = patch.batch[b];
    const TetTangent* const tangent = patch.tangent + batch.tangent;
    const Cells cells(patch, batch);
    CornersOf<P> u, f;
    cells.template gather<Real>(in, u);
    for (auto& corner : f)
        for (P& v : corner) v = P{};
    const Moduli<Real> m(patch, b, means.strain ? patch.meanStrain : 0);
    P mean = {}, trace[tetmesh::kMaxTets];
    MatrixOf<P> shared = {};  // avg E, then the stress of the mean
    if (means.dilation) {
        P volume = {};
        cells.eachTet([&](auto t) __attribute__((always_inline)) {
            MatrixOf<P> E, R;
            prefetch<tets, 2 * tets>(tangent, t);
            cells.template differences<P>(t, u, E);
            loadRotation<Real>(tangent[t], R);
            trace[t] = traceOf<P>(E, R);
            const P V = load<Real>(cells.share[t]);
            mean += V * trace[t];
            volume += V;
            if (means.strain)
                for (int k = 0; k < 9; ++k) shared[k / 3][k % 3] += V * E[k / 3][k % 3];
        });
        mean = volume > 0 ? m.bulk * mean / volume : P{};
        if (means.strain) meanStress<Real, Tangents>(tangent[cells.count()], m, volume, shared);
    }
    cells.eachTet([&](auto t) __attribute__((always_inline)) {
        MatrixOf<P> E, R, stress;
        P T[6];
        prefetch<tets, 2 * tets>(tangent, tets + t);
        if (!means.dilation) prefetch<tets, 2 * tets>(tangent, t);
        cells.template differences<P>(t, u, E);
        loadTangent<Real>(tangent[t], R, T);
        const P V = load<Real>(cells.share[t]);
        const P pressure = means.dilation ? mean - m.third * trace[t] : m.lambda * traceOf<P>(E, R);
        Tangents::template rate<P>(E, R, T, m.twoMu * V, pressure * V, stress);
        if (means.strain)
            for (int k = 0; k < 9; ++k) stress[k / 3][k % 3] += V * shared[k / 3][k % 3];
        cells.template spread<P>(t, stress, f);
    });
    if (patch.yielding && patch.yielding[b].any) subtractFlow<Real, Cells::kCorners>(patch.yielding[b], u, f);
    cells.template scatter<Real>(f, out);
}

/// v = m u at the corners, or m^T u.
template <bool transposed, class P>
VDBFRAC_INLINE void turnCorners(const MatrixOf<P>& m, const CornersOf<P>& u, int corners, CornersOf<P>& v)
{
    for (int c = 0; c < corners; ++c)
        for (int i = 0; i < 3; ++i) {
            v[c][i] = (transposed ? m[0][i] : m[i][0]) * u[c][0];
            v[c][i] += (transposed ? m[1][i] : m[i][1]) * u[c][1];
            v[c][i] += (transposed ? m[2][i] : m[i][2]) * u[c][2];
        }
}

/// avg E.
template <class Real, class Cells>
VDBFRAC_INLINE void meanDifferences(const Cells& cells, const CornersOf<PackT<Real>>& u, MatrixOf<PackT<Real>>& mean)
{
    using P = PackT<Real>;
    P volume = {};
    cells.eachTet([&](auto t) __attribute__((always_inline)) {
        MatrixOf<P> E;
        cells.template differences<P>(t, u, E);
        const P V = load<Real>(cells.share[t]);
        volume += V;
        for (int k = 0; k < 9; ++k) mean[k / 3][k % 3] += V * E[k / 3][k % 3];
    });
    const P inverse = volume > 0 ? Real(1) / volume : P{};
    for (int k = 0; k < 9; ++k) mean[k / 3][k % 3] = mean[k / 3][k % 3] * inverse;
}

/// E + theta (mean - E): with one R and T for all, the stress of the tets and of their mean is that of this.
template <class P, class Real>
VDBFRAC_INLINE void blend(Real theta, const MatrixOf<P>& mean, MatrixOf<P>& E)
{
    for (int k = 0; k < 9; ++k) E[k / 3][k % 3] += theta * (mean[k / 3][k % 3] - E[k / 3][k % 3]);
}

/// productBatch with one R and T for all tets of a cell: its corners are turned into the frame of R, and its forces
/// back.
template <class Real, class Tangents, class Cells, class M>
void cellProductBatch(const PatchData& patch, int b, M means, const Real* in, Real* out)
{
    using P = PackT<Real>;
    constexpr int corners = Cells::kCorners;
    const Cells cells(patch, patch.batch[b]);
    CornersOf<P> u, turned, turnedForce, f;
    MatrixOf<P> R;
    P T[6];
    cells.template gather<Real>(in, u);
    loadTangent<Real>(patch.cells[b], R, T);
    prefetch<1, 1>(patch.cells + b, 0);
    turnCorners<true, P>(R, u, corners, turned);
    for (int c = 0; c < corners; ++c)
        for (int i = 0; i < 3; ++i) f[c][i] = turnedForce[c][i] = P{};
    const Moduli<Real> m(patch, b, 0);
    const Real theta = Real(patch.meanStrain);
    P mean = {}, trace[tetmesh::kMaxTets];
    MatrixOf<P> meanD = {}, meanE = {};
    if (means.strain) {
        meanDifferences<Real>(cells, turned, meanD);
        mean = m.bulk * (meanD[0][0] + meanD[1][1] + meanD[2][2]);
    } else if (means.dilation) {
        cells.eachTet([&](auto t) __attribute__((always_inline)) {
            MatrixOf<P> D;
            cells.template differences<P>(t, turned, D);
            trace[t] = D[0][0] + D[1][1] + D[2][2];
        });
        mean = m.bulk * cellMean(cells, trace);
    }
    if (Tangents::kPlainRate && means.strain) meanDifferences<Real>(cells, u, meanE);
    cells.eachTet([&](auto t) __attribute__((always_inline)) {
        MatrixOf<P> D, stress;
        cells.template differences<P>(t, turned, D);
        if (means.strain) {
            blend<P>(theta, meanD, D);
            trace[t] = D[0][0] + D[1][1] + D[2][2];
        }
        const P V = load<Real>(cells.share[t]);
        const P pressure = V * (means.dilation ? mean - m.third * trace[t] : m.lambda * (D[0][0] + D[1][1] + D[2][2]));
        Tangents::template turnedRate<P>(D, T, V, m.twoMu * V, pressure, stress);
        cells.template spread<P>(t, stress, turnedForce);
        if constexpr (Tangents::kPlainRate) {
            MatrixOf<P> E;
            cells.template differences<P>(t, u, E);
            if (means.strain) blend<P>(theta, meanE, E);
            Tangents::template plainRate<P>(E, T, V, stress);
            cells.template spread<P>(t, stress, f);
        }
    });
    CornersOf<P> back;
    turnCorners<false, P>(R, turnedForce, corners, back);
    for (int c = 0; c < corners; ++c)
        for (int i = 0; i < 3; ++i) f[c][i] = Tangents::kPlainRate ? f[c][i] + back[c][i] : back[c][i];
    cells.template scatter<Real>(f, out);
}

/// a.b over three rows, in a fixed order.
template <class Real>
double dotOfRows(const Real* a, const Real* b, int stride)
{
    PackT<Real> row[3] = {};
    for (int i = 0; i < stride; i += kLanes)
        for (int d = 0; d < 3; ++d) row[d] += loadLoose(a + d * stride + i) * loadLoose(b + d * stride + i);
    const PackT<Real> sum = row[0] + row[1] + row[2];
    double dot = 0;
    for (int l = 0; l < kLanes; ++l) dot += double(sum[l]);
    return dot;
}

template <class Real>
double productAll(const PatchData& patch, const Real* in, Real* out)
{
    withTangents(patch.strain, [&]<class Tangents>() {
        eachBatch(patch, [&]<class Cells>(int b, auto means) {
            patch.cells ? cellProductBatch<Real, Tangents, Cells>(patch, b, means, in, out)
                        : productBatch<Real, Tangents, Cells>(patch, b, means, in, out);
        });
    });
    return dotOfRows(in, out, patch.stride);
}

}  // namespace

}  // namespace vdbfrac::solver
