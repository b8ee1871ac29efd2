// Compiled once for each vector unit (see CMakeLists.txt), with VDBFRAC_KERNEL naming the result.
// Everything but that one symbol has internal linkage, so no code for a wide unit leaks into the rest of the program.
#include "kernel.h"
#include "kernel_cells.h"
#include "kernel_strain.h"
#include "node_passes.h"

namespace vdbfrac::solver {

extern const Kernel VDBFRAC_KERNEL;

namespace {

template <CellShape shape, int t, Strain strain>
VDBFRAC_INLINE std::int64_t strainOfTet(const LaneTets* own, const Corners& x, Pack volume, double h, Strains& s,
                                        const RobustTet& scalar)
{
    const Mask used = volume > 0;
    const double scale = 1 / h;
    differences<shape, t, Pack>(own, x, s.F[t]);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) s.F[t][i][j] = used ? s.F[t][i][j] * scale : all(i == j);
    return measure<strain>(s, t, scalar);
}

template <CellShape shape, bool cellDilation, Strain strain>
KernelResult evaluateBatch(const PatchData& patch, int b, const RobustTet& scalar, const double* in, double* out)
{
    constexpr int tets = kCellTets<shape>.count;
    const Batch& batch = patch.batch[b];
    const auto share = volumeShares<shape>(patch, batch);
    Corners x, f;
    Strains s;
    KernelResult result;
    gather<shape, double>(patch, batch, in, x);
    const LaneTets* const own = ownTets<shape>(patch, batch);
    unroll<tets>([&](auto t) __attribute__((always_inline)) {
        result.robustTets += strainOfTet<shape, t, strain>(own, x, load<double>(share[t]), patch.h, s, scalar);
    });
    for (auto& corner : f)
        for (Pack& v : corner) v = all(0);
    const double mu = patch.mu, lambda = patch.lambda, twoThirdsMu = 2. / 3. * mu, bulk = lambda + twoThirdsMu;
    const double cellVolume = patch.h * patch.h * patch.h, perArea = cellVolume / patch.h,
                 perLength = perArea / patch.h;
    const Pack mean = cellDilation ? cellMean<tets>(share, s.dilation) : all(0);
    Pack energy = all(0);
    unroll<tets>([&](auto t) __attribute__((always_inline)) {
        const Pack V = load<double>(share[t]);
        // Per tet the bulk part is lambda/2 d^2; averaged it is K/2 mean^2, and -mu/3 d^2 leaves the deviatoric part.
        const Pack d = s.dilation[t], pressure = cellDilation ? bulk * mean - twoThirdsMu * d : lambda * d;
        const Pack force = V * perArea;
        Matrix P;
        const Pack square = stressOfTet<strain>(s, t, mu, pressure, P);
        for (auto& row : P)
            for (Pack& v : row) v = v * force;
        const Pack psi = cellDilation ? mu * square - 0.5 * twoThirdsMu * d * d + 0.5 * bulk * mean * mean
                                      : mu * square + 0.5 * lambda * d * d;
        energy += V * psi;
        if (patch.psi) storeLoose(patch.psi + (b * tetmesh::kMostTets + t) * kLanes, psi);
        spread<shape, t, Pack>(own, P, f);
        if (patch.tangent)
            storeTangent<strain>(s, t, mu, pressure, patch.share, V * perLength, patch.tangent[batch.tangent + t],
                                 scalar);
    });
    scatter<shape, 3, double>(patch, batch, f, out);
    for (int l = 0; l < kLanes; ++l) result.energy += cellVolume * energy[l];
    return result;
}

/// dP = 2 mu dF + bulk R + skew(T axial(dF R^T - R dF^T)) R, times V / h^2 with dF in units of 1/h: `T` holds that
/// factor, `twoMu` and `bulk` bring it. By columns c: axial = sum_c R_c x dF_c, and skew(v) R has the columns v x R_c.
template <class P>
VDBFRAC_INLINE void stressRate(const MatrixOf<P>& E, const MatrixOf<P>& R, const P (&T)[6], P twoMu, P bulk,
                               MatrixOf<P>& stress)
{
    P w[3], v[3];
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        w[i] = R[j][0] * E[k][0] - R[k][0] * E[j][0];
        w[i] += R[j][1] * E[k][1] - R[k][1] * E[j][1];
        w[i] += R[j][2] * E[k][2] - R[k][2] * E[j][2];
    }
    v[0] = T[0] * w[0] + T[5] * w[1] + T[4] * w[2];
    v[1] = T[5] * w[0] + T[1] * w[1] + T[3] * w[2];
    v[2] = T[4] * w[0] + T[3] * w[1] + T[2] * w[2];
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        for (int c = 0; c < 3; ++c) stress[i][c] = twoMu * E[i][c] + bulk * R[i][c] + v[j] * R[k][c] - v[k] * R[j][c];
    }
}

/// dP = dF Sigma + F (2 mu sym(F^T dF) + bulk I), in the same units.
template <class P>
VDBFRAC_INLINE void greenStressRate(const MatrixOf<P>& E, const MatrixOf<P>& F, const P (&T)[6], P twoMu, P bulk,
                                    MatrixOf<P>& stress)
{
    const MatrixOf<P> Sigma = {{T[0], T[5], T[4]}, {T[5], T[1], T[3]}, {T[4], T[3], T[2]}};
    MatrixOf<P> G, rate;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) G[i][j] = F[0][i] * E[0][j] + F[1][i] * E[1][j] + F[2][i] * E[2][j];
    const P mu = twoMu / 2;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) rate[i][j] = mu * (G[i][j] + G[j][i]);
    for (int i = 0; i < 3; ++i) rate[i][i] += bulk;
    for (int i = 0; i < 3; ++i)
        for (int c = 0; c < 3; ++c)
            stress[i][c] = E[i][0] * Sigma[0][c] + E[i][1] * Sigma[1][c] + E[i][2] * Sigma[2][c] +
                           F[i][0] * rate[0][c] + F[i][1] * rate[1][c] + F[i][2] * rate[2][c];
}

template <class P>
VDBFRAC_INLINE P traceOf(const MatrixOf<P>& E, const MatrixOf<P>& R)
{
    P trace = R[0][0] * E[0][0];
    for (int k = 1; k < 9; ++k) trace += R[k / 3][k % 3] * E[k / 3][k % 3];
    return trace;
}

template <class Real>
VDBFRAC_INLINE void loadRotation(const TetTangent& tangent, MatrixOf<PackT<Real>>& R)
{
    for (int k = 0; k < 9; ++k) R[k / 3][k % 3] = load<Real>(tangent.R[k]);
}

template <class Real>
VDBFRAC_INLINE void loadTangent(const TetTangent& tangent, MatrixOf<PackT<Real>>& R, PackT<Real> (&T)[6])
{
    loadRotation<Real>(tangent, R);
    for (int k = 0; k < 6; ++k) T[k] = load<Real>(tangent.T[k]);
}

/// Moduli times h, and what damping adds to the tangent.
template <class Real>
struct Moduli {
    Real twoMu, lambda, third, bulk;
    VDBFRAC_INLINE explicit Moduli(const PatchData& patch)
    {
        const double scale = patch.h * (1 + patch.share);
        twoMu = Real(2 * patch.mu * scale), lambda = Real(patch.lambda * scale), third = twoMu / 3,
        bulk = lambda + third;
    }
};

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

template <class Real, CellShape shape, bool cellDilation, bool green>
void productBatch(const PatchData& patch, int b, const Real* in, Real* out)
{
    using P = PackT<Real>;
    constexpr int tets = kCellTets<shape>.count, passes = cellDilation ? 2 : 1;
    const Batch& batch = patch.batch[b];
    const TetTangent* const tangent = patch.tangent + batch.tangent;
    const auto share = volumeShares<shape>(patch, batch);
    const LaneTets* const own = ownTets<shape>(patch, batch);
    CornersOf<P> u, f;
    gather<shape, Real>(patch, batch, in, u);
    for (auto& corner : f)
        for (P& v : corner) v = P{};
    const auto [twoMu, lambda, third, bulk] = Moduli<Real>(patch);
    P mean = {}, trace[tetmesh::kMostTets];
    if constexpr (cellDilation) {
        P volume = {};
        unroll<tets>([&](auto t) __attribute__((always_inline)) {
            MatrixOf<P> E, R;
            prefetch<tets, passes * tets>(tangent, t);
            differences<shape, t, P>(own, u, E);
            loadRotation<Real>(tangent[t], R);
            trace[t] = traceOf<P>(E, R);
            const P V = load<Real>(share[t]);
            mean += V * trace[t];
            volume += V;
        });
        mean = volume > 0 ? bulk * mean / volume : P{};
    }
    unroll<tets>([&](auto t) __attribute__((always_inline)) {
        MatrixOf<P> E, R;
        P T[6];
        prefetch<tets, passes * tets>(tangent, (passes - 1) * tets + t);
        differences<shape, t, P>(own, u, E);
        loadTangent<Real>(tangent[t], R, T);
        const P V = load<Real>(share[t]);
        const P pressure = cellDilation ? mean - third * trace[t] : lambda * traceOf<P>(E, R);
        MatrixOf<P> stress;
        green ? greenStressRate<P>(E, R, T, twoMu * V, pressure * V, stress)
              : stressRate<P>(E, R, T, twoMu * V, pressure * V, stress);
        spread<shape, t, P>(own, stress, f);
    });
    scatter<shape, 3, Real>(patch, batch, f, out);
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

/// stressRate in the frame of R, of D = R^T E.
template <class P>
VDBFRAC_INLINE void turnedStressRate(const MatrixOf<P>& D, const P (&T)[6], P V, P twoMu, P bulk, MatrixOf<P>& stress)
{
    const P w[3] = {D[2][1] - D[1][2], D[0][2] - D[2][0], D[1][0] - D[0][1]};
    const P v[3] = {V * (T[0] * w[0] + T[5] * w[1] + T[4] * w[2]), V * (T[5] * w[0] + T[1] * w[1] + T[3] * w[2]),
                    V * (T[4] * w[0] + T[3] * w[1] + T[2] * w[2])};
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        stress[i][i] = twoMu * D[i][i] + bulk;
        stress[i][j] = twoMu * D[i][j] - v[k];
        stress[i][k] = twoMu * D[i][k] + v[j];
    }
}

/// productBatch with one R and T for all tets of a cell: its corners are turned into the frame of R, and its forces
/// back.
template <class Real, CellShape shape, bool cellDilation, bool green>
void cellProductBatch(const PatchData& patch, int b, const Real* in, Real* out)
{
    using P = PackT<Real>;
    constexpr int tets = kCellTets<shape>.count, corners = shape == CellShape::tet ? 4 : tetmesh::kCorners;
    const Batch& batch = patch.batch[b];
    const auto share = volumeShares<shape>(patch, batch);
    const LaneTets* const own = ownTets<shape>(patch, batch);
    CornersOf<P> u, turned, turnedForce, f;
    MatrixOf<P> R;
    P T[6];
    gather<shape, Real>(patch, batch, in, u);
    loadTangent<Real>(patch.cells[b], R, T);
    prefetch<1, 1>(patch.cells + b, 0);
    turnCorners<true, P>(R, u, corners, turned);
    for (int c = 0; c < corners; ++c)
        for (int i = 0; i < 3; ++i) f[c][i] = turnedForce[c][i] = P{};
    const auto [twoMu, lambda, third, bulk] = Moduli<Real>(patch);
    P mean = {}, trace[tetmesh::kMostTets];
    if constexpr (cellDilation) {
        unroll<tets>([&](auto t) __attribute__((always_inline)) {
            MatrixOf<P> D;
            differences<shape, t, P>(own, turned, D);
            trace[t] = D[0][0] + D[1][1] + D[2][2];
        });
        mean = bulk * cellMean<tets>(share, trace);
    }
    unroll<tets>([&](auto t) __attribute__((always_inline)) {
        MatrixOf<P> D, stress;
        differences<shape, t, P>(own, turned, D);
        const P V = load<Real>(share[t]);
        const P pressure = V * (cellDilation ? mean - third * trace[t] : lambda * (D[0][0] + D[1][1] + D[2][2]));
        if constexpr (green) {
            MatrixOf<P> E;
            const P mu = twoMu / 2 * V;
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) stress[i][j] = mu * (D[i][j] + D[j][i]);
            for (int i = 0; i < 3; ++i) stress[i][i] += pressure;
            spread<shape, t, P>(own, stress, turnedForce);
            differences<shape, t, P>(own, u, E);
            const MatrixOf<P> Sigma = {{T[0], T[5], T[4]}, {T[5], T[1], T[3]}, {T[4], T[3], T[2]}};
            for (int i = 0; i < 3; ++i)
                for (int c = 0; c < 3; ++c)
                    stress[i][c] = V * (E[i][0] * Sigma[0][c] + E[i][1] * Sigma[1][c] + E[i][2] * Sigma[2][c]);
            spread<shape, t, P>(own, stress, f);
        } else {
            turnedStressRate<P>(D, T, V, twoMu * V, pressure, stress);
            spread<shape, t, P>(own, stress, turnedForce);
        }
    });
    CornersOf<P> back;
    turnCorners<false, P>(R, turnedForce, corners, back);
    for (int c = 0; c < corners; ++c)
        for (int i = 0; i < 3; ++i) f[c][i] = green ? f[c][i] + back[c][i] : back[c][i];
    scatter<shape, 3, Real>(patch, batch, f, out);
}

/// Adds skew(q) U skew(q)^T.
VDBFRAC_INLINE void addTwistBlock(const Pack (&q)[3], const Pack (&U)[6], Pack (&K)[6])
{
    const Matrix full = {{U[0], U[5], U[4]}, {U[5], U[1], U[3]}, {U[4], U[3], U[2]}};
    Matrix QU;  // skew(q) U
    for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i) {
            const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
            QU[i][j] = q[i1] * full[i2][j] - q[i2] * full[i1][j];
        }
    for (int k = 0; k < 6; ++k) {  // (skew(q) U) skew(q)^T: row i of QU crossed with q
        const int i = kRow[k], j1 = (kColumn[k] + 1) % 3, j2 = (kColumn[k] + 2) % 3;
        K[k] += q[j1] * QU[i][j2] - q[j2] * QU[i][j1];
    }
}

/// Adds s r r^T.
VDBFRAC_INLINE void addOuter(const Pack (&r)[3], Pack s, Pack (&K)[6])
{
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        K[i] += s * r[i] * r[i];
        K[i + 3] += s * r[j] * r[k];
    }
}

/// Component d of h grad N_a.
template <CellShape shape>
VDBFRAC_INLINE Pack vertexGradient(const LaneTets* own, int t, int a, int d)
{
    if constexpr (shape != CellShape::tet) return all(kCellTets<shape>.gradient[t][a][d]);
    if (a > 0) return gradientOf<Pack>(own, a - 1, d);
    return -(gradientOf<Pack>(own, 0, d) + gradientOf<Pack>(own, 1, d) + gradientOf<Pack>(own, 2, d));
}

/// Adds what a tet has of the diagonal block of a vertex with h grad N = g, q = R g, besides dilatation: the part of mu
/// and that of T (stressRate, greenStressRate), `V` in units of h^3.
template <bool green>
VDBFRAC_INLINE void addVertexBlock(const Pack (&g)[3], const Pack (&q)[3], const Matrix& R, const Pack (&T)[6],
                                   Pack muV, Pack (&K)[6])
{
    const Pack length2 = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
    if constexpr (!green) {
        for (int i = 0; i < 3; ++i) K[i] += 2. * length2 * muV;
        addTwistBlock(q, T, K);
        return;
    }
    const Pack stress = T[0] * g[0] * g[0] + T[1] * g[1] * g[1] + T[2] * g[2] * g[2] +
                        2. * (T[3] * g[1] * g[2] + T[4] * g[2] * g[0] + T[5] * g[0] * g[1]);
    for (int i = 0; i < 3; ++i) K[i] += stress;
    for (int k = 0; k < 6; ++k) {
        const int i = kRow[k], j = kColumn[k];
        K[k] += length2 * muV * (R[i][0] * R[j][0] + R[i][1] * R[j][1] + R[i][2] * R[j][2]);
    }
    addOuter(q, muV, K);
}

/// R and T of tet t, of volume V: its own or those of its cell.
template <bool green>
VDBFRAC_INLINE void tangentOfTet(const PatchData& patch, int b, int t, Pack V, Matrix& R, Pack (&T)[6])
{
    if (!patch.cells) return loadTangent<double>(patch.tangent[int(patch.batch[b].tangent) + t], R, T);
    loadTangent<double>(patch.cells[b], R, T);
    Pack own[6];
    for (int k = 0; k < 6; ++k) own[k] = V * T[k];
    if constexpr (green)
        for (int k = 0; k < 6; ++k) T[k] = own[k];
    else
        rotated(R, own, T);
}

template <CellShape shape, bool cellDilation, bool green>
void diagonalBatch(const PatchData& patch, int b, double* out)
{
    constexpr auto& cell = kCellTets<shape>;
    const Batch& batch = patch.batch[b];
    const auto share = volumeShares<shape>(patch, batch);
    const double scale = patch.h * (1 + patch.share), mu = patch.mu * scale, lambda = patch.lambda * scale;
    Pack K[tetmesh::kCorners][6], bulk[tetmesh::kCorners][3], cellVolume = all(0);
    for (int c = 0; c < tetmesh::kCorners; ++c) {
        for (Pack& v : K[c]) v = all(0);
        for (Pack& v : bulk[c]) v = all(0);
    }
    for (int t = 0; t < cell.count; ++t) {
        const Pack V = load<double>(share[t]);
        cellVolume += V;
        Matrix R;
        Pack T[6];
        tangentOfTet<green>(patch, b, t, V, R, T);
        for (int a = 0; a < 4; ++a) {
            const int c = cell.corner[t][a];
            Pack g[3], q[3];
            for (int d = 0; d < 3; ++d) g[d] = vertexGradient<shape>(ownTets<shape>(patch, batch), t, a, d);
            for (int i = 0; i < 3; ++i) q[i] = R[i][0] * g[0] + R[i][1] * g[1] + R[i][2] * g[2];
            addVertexBlock<green>(g, q, R, T, mu * V, K[c]);
            addOuter(q, (cellDilation ? -2. / 3. * mu : lambda) * V, K[c]);
            if (cellDilation)
                for (int i = 0; i < 3; ++i) bulk[c][i] += V * q[i];
        }
    }
    if (cellDilation) {
        const Pack weight = cellVolume > 0 ? (lambda + 2. / 3. * mu) / cellVolume : all(0);
        for (int c = 0; c < tetmesh::kCorners; ++c) addOuter(bulk[c], weight, K[c]);
    }
    scatter<shape, 6, double>(patch, batch, K, out);
}

/// Adds to the diagonal of T, by the circles of Gershgorin, what makes its least eigenvalue at least `least`.
VDBFRAC_INLINE void raise(Pack (&T)[6], double least)
{
    Pack lowest = all(least);
    for (int i = 0; i < 3; ++i) {
        const Pack low = T[i] - magnitude(T[3 + (i + 1) % 3]) - magnitude(T[3 + (i + 2) % 3]);
        lowest = low < lowest ? low : lowest;
    }
    for (int i = 0; i < 3; ++i) T[i] += least - lowest;
}

/// Semidefinite, as project() makes tets: where the energy is not convex the tangents of the tets of a cell may add up
/// to a definite one when their mean does not, and what is preconditioned with that follows its softest direction
/// alone.
template <CellShape shape, bool green>
void averageBatch(const PatchData& patch, int b, const RobustTet& scalar, TetTangent& cell)
{
    const Batch& batch = patch.batch[b];
    const TetTangent* const tangent = patch.tangent + batch.tangent;
    const auto share = volumeShares<shape>(patch, batch);
    Pack volume = all(0), T[6], turned[6];
    Matrix mean, R, back;
    for (int k = 0; k < 9; ++k) mean[k / 3][k % 3] = all(0);
    for (Pack& v : T) v = all(0);
    for (int t = 0; t < kCellTets<shape>.count; ++t) {
        const Pack V = load<double>(share[t]);
        const Mask used = V > 0;  // what a tet without material has is of no interest
        volume += V;
        for (int k = 0; k < 9; ++k) mean[k / 3][k % 3] += used ? V * load<double>(tangent[t].R[k]) : all(0);
        for (int k = 0; k < 6; ++k) T[k] += used ? load<double>(tangent[t].T[k]) : all(0);
    }
    const Pack inverse = volume > 0 ? 1. / volume : all(0);
    for (int k = 0; k < 9; ++k) mean[k / 3][k % 3] = volume > 0 ? mean[k / 3][k % 3] * inverse : all(k % 4 == 0);
    for (Pack& v : T) v = v * inverse;
    if constexpr (!green) {
        nearestRotation(mean, scalar, R);
        for (int k = 0; k < 9; ++k) back[k / 3][k % 3] = R[k % 3][k / 3];
        rotated(back, T, turned);
    }
    raise(green ? T : turned, green ? 0 : -patch.mu * patch.h * (1 + patch.share));
    for (int k = 0; k < 9; ++k) store(cell.R[k], (green ? mean : R)[k / 3][k % 3]);
    for (int k = 0; k < 6; ++k) store(cell.T[k], (green ? T : turned)[k]);
}

/// Calls f<shape, cellDilation, strain>(b) for each batch of the patch.
template <class F>
VDBFRAC_INLINE void eachBatch(const PatchData& patch, bool cellDilation, const F& f)
{
    for (int b = 0; b < patch.batches; ++b) {
        const auto withStrain = [&]<CellShape shape, Strain strain>() {
            cellDilation ? f.template operator()<shape, true, strain>(b)
                         : f.template operator()<shape, false, strain>(b);
        };
        const auto withShape = [&]<CellShape shape>() {
            switch (patch.strain) {
            case Strain::corotational: withStrain.template operator()<shape, Strain::corotational>(); break;
            case Strain::linear: withStrain.template operator()<shape, Strain::linear>(); break;
            case Strain::green: withStrain.template operator()<shape, Strain::green>(); break;
            }
        };
        switch (patch.batch[b].shape) {
        case CellShape::six: withShape.template operator()<CellShape::six>(); break;
        case CellShape::fiveEven: withShape.template operator()<CellShape::fiveEven>(); break;
        case CellShape::fiveOdd: withShape.template operator()<CellShape::fiveOdd>(); break;
        case CellShape::tet: withShape.template operator()<CellShape::tet>(); break;
        }
    }
}

KernelResult evaluate(const PatchData& patch, bool cellDilation, const RobustTet& scalar, const double* in, double* out)
{
    KernelResult sum;
    eachBatch(patch, cellDilation, [&]<CellShape shape, bool dilation, Strain strain>(int b) {
        const KernelResult r = evaluateBatch<shape, dilation, strain>(patch, b, scalar, in, out);
        sum.energy += r.energy;
        sum.robustTets += r.robustTets;
    });
    return sum;
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
double productAll(const PatchData& patch, bool cellDilation, const Real* in, Real* out)
{
    eachBatch(patch, cellDilation, [&]<CellShape shape, bool dilation, Strain strain>(int b) {
        constexpr bool green = strain == Strain::green;
        patch.cells ? cellProductBatch<Real, shape, dilation, green>(patch, b, in, out)
                    : productBatch<Real, shape, dilation, green>(patch, b, in, out);
    });
    return dotOfRows(in, out, patch.stride);
}

template <class Real>
void readAll(const PatchData& patch, const Real* points, Real* in)
{
    for (const NodeRun* run = patch.run; run != patch.run + patch.runs; ++run) {
        const Real* from = points + 3 * std::size_t(run->node);
        int i = run->local;
        const int end = i + run->count;
        for (; i + kLanes <= end; i += kLanes, from += 3 * kLanes) {
            PackT<Real> v[3];
            split(from, v);
            for (int d = 0; d < 3; ++d) storeLoose(in + d * patch.stride + i, v[d]);
        }
        for (; i < end; ++i, from += 3)
            for (int d = 0; d < 3; ++d) in[d * patch.stride + i] = from[d];
    }
    for (int d = 0; d < 3; ++d)
        for (int i = patch.nodes; i < patch.stride; ++i) in[d * patch.stride + i] = 0;
}

template <class Real>
void writeAll(const PatchData& patch, const Real* out, Real* points)
{
    for (int i = 0; i < patch.nodes; i += kLanes, points += 3 * kLanes)
        join(loadLoose(out + i), loadLoose(out + patch.stride + i), loadLoose(out + 2 * patch.stride + i), points);
}

void diagonalAll(const PatchData& patch, bool cellDilation, double* out)
{
    eachBatch(patch, cellDilation, [&]<CellShape shape, bool dilation, Strain strain>(int b) {
        diagonalBatch<shape, dilation, strain == Strain::green>(patch, b, out);
    });
}

void averageAll(const PatchData& patch, const RobustTet& scalar, TetTangent* cells)
{
    eachBatch(patch, false, [&]<CellShape shape, bool dilation, Strain strain>(int b) {
        averageBatch<shape, strain == Strain::green>(patch, b, scalar, cells[b]);
    });
}

#define VDBFRAC_TEXT2(x) #x
#define VDBFRAC_TEXT(x) VDBFRAC_TEXT2(x)

template <class Real>
constexpr VectorKernel<Real> kVectors = {readAll<Real>, writeAll<Real>, productAll<Real>, descend<Real>, turn<Real>};

}  // namespace

const Kernel VDBFRAC_KERNEL = {
    evaluate, diagonalAll, averageAll, kVectors<double>, kVectors<float>, smoothNodes, VDBFRAC_TEXT(VDBFRAC_KERNEL)};

}  // namespace vdbfrac::solver
