// The part of a kernel that has energy, gradient and tangent.
#include "kernel_cells.h"
#include "kernel_laws.h"
#include "kernel_parts.h"

namespace vdbfrac::solver {

namespace {

/// F of a tet; I where there is no material.
template <class Cells, class Tet>
VDBFRAC_INLINE void deform(const Cells& cells, Tet t, const Corners& x, double h, Matrix& F)
{
    const Mask used = load<double>(cells.share[t]) > 0;
    const double scale = 1 / h;
    cells.template differences<Pack>(t, x, F);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) F[i][j] = used ? F[i][j] * scale : all(i == j);
}

template <class Law>
VDBFRAC_INLINE std::int64_t measure(Strains& s, int t, const RobustTet& scalar)
{
    const std::int64_t robust = Law::measure(s, t, scalar);
    s.dilation[t] = (s.S[t][0] - 1.) + (s.S[t][1] - 1.) + (s.S[t][2] - 1.);
    return robust;
}

/// F of the means: avg F; I in a cell without material. Returns the volume of the cells.
template <class Cells>
VDBFRAC_INLINE Pack deformMean(const Cells& cells, Strains& s)
{
    Matrix sum = {};
    Pack volume = all(0);
    cells.eachTet([&](auto t) __attribute__((always_inline)) {
        const Pack V = load<double>(cells.share[t]);
        volume += V;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) sum[i][j] += V * s.F[t][i][j];
    });
    const Mask used = volume > 0;
    const Pack inverse = used ? 1. / volume : all(0);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) s.F[kMean][i][j] = used ? sum[i][j] * inverse : all(i == j);
    return volume;
}

/// Of cells that may yield (Yield).
struct Yielding {
    Pack left;    ///< of the shear modulus: stress over what it is without flow
    Pack energy;  ///< density over mu, beyond that of the modulus that is left
};

/// |dev e|^2 of a tet or of the mean.
VDBFRAC_INLINE Pack squareOfShear(const Strains& s, int t)
{
    return squareOfStrain(s.S[t]) - 1. / 3. * s.dilation[t] * s.dilation[t];
}

/// Adds V Q (h grad N_a) of a tet at its corners.
VDBFRAC_INLINE void spreadAny(const AnyCells& cells, int t, const Matrix& VQ, CornersOf<Pack, 3>& f)
{
    const auto& corner = cells.tets.corner[std::size_t(t)];
    for (int a = 1; a < 4; ++a)
        for (int i = 0; i < 3; ++i) {
            Pack force = all(0);
            for (int d = 0; d < 3; ++d) {
                const double lattice = cells.tets.gradient[std::size_t(t)][std::size_t(a)][std::size_t(d)];
                force += VQ[i][d] * (cells.own ? gradientOf<Pack>(cells.own[t], a - 1, d) : all(lattice));
            }
            f[corner[std::size_t(a)]][i] += force;
            f[corner[0]][i] -= force;
        }
}

/// Slopes of n at the corners, times the root of 2 mu V c y / n: the curvature of what flows.
template <class Law>
VDBFRAC_OUTLINE void storeSlopes(const PatchData& patch, int b, const AnyCells& cells, const Strains& s, double theta,
                                 Pack n, Pack y)
{
    CornersOf<Pack, 3> slope = {};
    Matrix Q, mean;
    Pack volume = all(0);
    if (theta > 0) (void)Law::stress(s, kMean, all(.5), -1. / 3. * s.dilation[kMean], mean);
    for (int t = 0; t < cells.tets.count; ++t) {
        const Pack V = load<double>(cells.share[t]);
        volume += V;
        (void)Law::stress(s, t, all(.5), -1. / 3. * s.dilation[t], Q);  // dev e, turned
        for (int k = 0; k < 9; ++k) {
            Pack& q = Q[k / 3][k % 3];
            q = V * (theta > 0 ? (1 - theta) * q + theta * mean[k / 3][k % 3] : q);
        }
        spreadAny(cells, t, Q, slope);
    }
    const Mask flows = n > y;
    const Pack scale =
        flows ? root(2. * patch.mu * patch.h * patch.yieldShare * y / (n * volume)) / n : all(0);  // h^3 / h^2
    LaneYielding& out = patch.yielding[b];
    for (int c = 0; c < tetmesh::kCorners; ++c)
        for (int i = 0; i < 3; ++i) store(out.slope[c][i], scale * slope[c][i]);
}

template <class Law>
VDBFRAC_OUTLINE void yieldOf(const PatchData& patch, int b, const Strains& s, double theta, Yielding& yielding)
{
    const AnyCells cells(patch, patch.batch[b]);
    Pack square = all(0), volume = all(0);
    for (int t = 0; t < cells.tets.count; ++t) {
        const Pack V = load<double>(cells.share[t]);
        square += V * squareOfShear(s, t);
        volume += V;
    }
    square = volume > 0 ? square / volume : all(0);
    if (theta > 0) square = (1 - theta) * square + theta * squareOfShear(s, kMean);
    const Pack n = root(square > 0 ? square : all(0)), y = load<double>(patch.yields[b].strain);
    const double c = patch.yieldShare;
    yielding.left = n > y ? 1. - c * (n - y) / n : all(1);
    yielding.energy = n > y ? c * y * (n - y) : all(0);
    if (patch.shear) storeLoose(patch.shear + b * kLanes, n);
    if (!patch.yielding) return;
    LaneYielding& out = patch.yielding[b];
    out.any = any(n > y);
    store(out.left, (yielding.left + patch.share) / (1 + patch.share));
    if (out.any) storeSlopes<Law>(patch, b, cells, s, theta, n, y);
}

/// What the mean adds to each tet of its cell.
struct MeanShare {
    Matrix P;  ///< stress
    Pack psi;  ///< energy density
};

template <class Law, class Cells>
VDBFRAC_INLINE void evaluateMean(const PatchData& patch, const Batch& batch, const Cells& cells,
                                 const RobustTet& scalar, Strains& s, Pack volume, Pack left, MeanShare& mean)
{
    const double whole = patch.meanStrain * patch.mu;
    const Pack mu = whole * left, d = s.dilation[kMean], pressure = -2. / 3. * mu * d;
    mean.psi = mu * Law::stress(s, kMean, mu, pressure, mean.P) + 0.5 * pressure * d;
    if (patch.tangent)
        Law::store(s, kMean, {mu, whole * patch.share, pressure, volume * patch.h},
                   patch.tangent[batch.tangent + std::uint32_t(cells.count())], scalar);
}

template <class Law, class Cells, class M>
KernelResult evaluateBatch(const PatchData& patch, int b, M means, const RobustTet& scalar, const double* in,
                           double* out)
{
    const Batch& batch = patch.batch[b];
    const Cells cells(patch, batch);
    Corners x, f = {};
    Strains s;
    KernelResult result;
    cells.template gather<double>(in, x);
    cells.eachTet([&](auto t) __attribute__((always_inline)) { deform(cells, t, x, patch.h, s.F[t]); });
    eachTetCompact(
        cells, [&](auto t) __attribute__((always_inline)) { result.robustTets += measure<Law>(s, t, scalar); });
    Pack volume;
    if (means.strain) {
        volume = deformMean(cells, s);
        result.robustTets += measure<Law>(s, kMean, scalar);
    }
    Yielding yielding = {all(1), all(0)};
    if (patch.yields) yieldOf<Law>(patch, b, s, means.strain ? patch.meanStrain : 0, yielding);
    MeanShare shared;
    if (means.strain) evaluateMean<Law>(patch, batch, cells, scalar, s, volume, yielding.left, shared);
    const double whole = means.strain ? (1 - patch.meanStrain) * patch.mu : patch.mu, bulk = patch.bulk;
    const Pack mu = whole * yielding.left, twoThirdsMu = 2. / 3. * mu;  // of the tets
    const Pack lambda = patch.lambda + (1. - yielding.left) * (2. / 3. * patch.mu);
    const double cellVolume = patch.h * patch.h * patch.h, perArea = cellVolume / patch.h,
                 perLength = perArea / patch.h;
    const Pack mean = means.dilation ? cellMean(cells, s.dilation) : all(0);
    Pack energy = all(0);
    TangentScale scales[tetmesh::kMaxTets];
    cells.eachTet([&](auto t) __attribute__((always_inline)) {
        const Pack V = load<double>(cells.share[t]);
        // Per tet the bulk part is lambda/2 d^2; averaged it is K/2 mean^2, and -mu/3 d^2 leaves the deviatoric part.
        const Pack d = s.dilation[t], pressure = means.dilation ? bulk * mean - twoThirdsMu * d : lambda * d;
        const Pack force = V * perArea;
        Matrix P;
        const Pack square = Law::stress(s, t, mu, pressure, P);
        Pack psi = means.dilation ? mu * square - 0.5 * twoThirdsMu * d * d + 0.5 * bulk * mean * mean
                                  : mu * square + 0.5 * lambda * d * d;
        if (means.strain) {
            psi += shared.psi;
            for (int k = 0; k < 9; ++k) P[k / 3][k % 3] += shared.P[k / 3][k % 3];
        }
        if (patch.yields) psi += patch.mu * yielding.energy;
        for (auto& row : P)
            for (Pack& v : row) v = v * force;
        energy += V * psi;
        if (patch.psi) storeLoose(patch.psi + (b * tetmesh::kMaxTets + t) * kLanes, psi);
        cells.template spread<Pack>(t, P, f);
        const TangentScale scale = {mu, whole * patch.share, pressure, V * perLength};
        if (Law::kLong)
            scales[t] = scale;
        else if (patch.tangent)
            Law::store(s, t, scale, patch.tangent[batch.tangent + std::uint32_t(t)], scalar);
    });
    if (Law::kLong && patch.tangent)
        eachTetCompact(
            cells, [&](auto t) __attribute__((always_inline)) {
                Law::store(s, t, scales[t], patch.tangent[batch.tangent + std::uint32_t(t)], scalar);
            });
    cells.template scatter<double>(f, out);
    for (int l = 0; l < kLanes; ++l) result.energy += cellVolume * energy[l];
    return result;
}

}  // namespace

KernelResult VDBFRAC_KERNEL::evaluate(const PatchData& patch, const RobustTet& scalar, const double* in, double* out)
{
    KernelResult sum;
    withLaw(patch.strain, [&]<class Law>() {
        eachBatch(patch, [&]<class Cells>(int b, auto means) {
            const KernelResult r = evaluateBatch<Law, Cells>(patch, b, means, scalar, in, out);
            sum.energy += r.energy;
            sum.robustTets += r.robustTets;
        });
    });
    return sum;
}

void VDBFRAC_KERNEL::polar(const RobustTet& scalar, LanePolars& of)
{
    Strains s;
    for (int k = 0; k < 9; ++k) s.F[0][k / 3][k % 3] = load<double>(of.F[k]);
    (void)Corotational::measure(s, 0, scalar);
    for (int k = 0; k < 9; ++k) storeLoose(of.R[k], s.R[0][k / 3][k % 3]);
    for (int k = 0; k < 6; ++k) storeLoose(of.S[k], s.S[0][k]);
}

}  // namespace vdbfrac::solver
