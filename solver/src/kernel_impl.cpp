// Compiled once for each vector unit (see CMakeLists.txt), with VDBFRAC_KERNEL naming the result.
// Everything but that one symbol has internal linkage, so no code for a wide unit leaks into the rest of the program.
#include "kernel.h"

#include <utility>

namespace vdbfrac::solver {

extern const Kernel VDBFRAC_KERNEL;

namespace {

using tetmesh::CellShape;
using tetmesh::kCellTets;

typedef double Pack __attribute__((vector_size(64)));
typedef double LoosePack __attribute__((vector_size(64), aligned(8), may_alias));
typedef float SinglePack __attribute__((vector_size(32)));
typedef long long Mask __attribute__((vector_size(64)));

#define VDBFRAC_INLINE inline __attribute__((always_inline))

/// Calls f(integral_constant<0>), ... at compile time.
template <int n, class F>
VDBFRAC_INLINE void unroll(const F& f)
{
    [&]<int... k>(std::integer_sequence<int, k...>) __attribute__((always_inline)) {
        (f(std::integral_constant<int, k>{}), ...);
    }(std::make_integer_sequence<int, n>{});
}

VDBFRAC_INLINE Pack load(const double* p) { return *reinterpret_cast<const Pack*>(p); }
VDBFRAC_INLINE Pack load(const float* p) { return __builtin_convertvector(*reinterpret_cast<const SinglePack*>(p), Pack); }
VDBFRAC_INLINE void store(float* p, Pack v) { *reinterpret_cast<SinglePack*>(p) = __builtin_convertvector(v, SinglePack); }
VDBFRAC_INLINE Pack loadLoose(const double* p) { return *reinterpret_cast<const LoosePack*>(p); }
VDBFRAC_INLINE void storeLoose(double* p, Pack v) { *reinterpret_cast<LoosePack*>(p) = v; }
VDBFRAC_INLINE Pack all(double v) { return Pack{} + v; }
VDBFRAC_INLINE Pack root(Pack v)
{
    Pack r;
    for (int l = 0; l < kLanes; ++l) r[l] = __builtin_sqrt(v[l]);
    return r;
}
VDBFRAC_INLINE Pack magnitude(Pack v) { return v < 0 ? -v : v; }
VDBFRAC_INLINE bool any(Mask m)
{
    long long bits = 0;
    for (int l = 0; l < kLanes; ++l) bits |= m[l];
    return bits != 0;
}

using Corners = Pack[tetmesh::kCorners][3];
using Matrix = Pack[3][3];

template <int rows>
VDBFRAC_INLINE void gather(const Batch& batch, const double* in, int stride, Pack (&u)[tetmesh::kCorners][rows])
{
    for (int c = 0; c < tetmesh::kCorners; ++c)
        for (int i = 0; i < rows; ++i) {
            const double* row = in + i * stride;
            if (batch.contiguous)
                u[c][i] = loadLoose(row + batch.corner[c][0]);
            else
                for (int l = 0; l < kLanes; ++l) u[c][i][l] = row[batch.corner[c][l]];
        }
}

template <int rows>
VDBFRAC_INLINE void scatter(const Batch& batch, const Pack (&f)[tetmesh::kCorners][rows], int stride, double* out)
{
    for (int c = 0; c < tetmesh::kCorners; ++c)
        for (int i = 0; i < rows; ++i) {
            double* row = out + i * stride;
            if (batch.contiguous) {
                double* at = row + batch.corner[c][0];
                storeLoose(at, loadLoose(at) + f[c][i]);
            } else
                for (int l = 0; l < kLanes; ++l) row[batch.corner[c][l]] += f[c][i][l];
        }
}

/// a = g b on the first term of a sum, a += g b later; g is known at compile time, and mostly 1 or -1.
template <bool first>
VDBFRAC_INLINE void addScaled(Pack& a, double g, Pack b)
{
    if (first)
        a = g == 1 ? b : g * b;
    else if (g == 1)
        a += b;
    else if (g == -1)
        a -= b;
    else
        a += g * b;
}

/// First tet vertex whose gradient has a positive component d: the sum starts there.
constexpr int firstVertex(CellShape shape, int t, int d)
{
    const tetmesh::CellTets cell = tetmesh::makeCellTets(shape);
    for (int a = 0; a < 4; ++a)
        if (cell.gradient[std::size_t(t)][std::size_t(a)][std::size_t(d)] > 0) return a;
    return 0;
}

/// E = sum_a u_a (x) (h grad N_a): differences of corner values, because the rest shape is that of the lattice.
template <CellShape shape, int t>
VDBFRAC_INLINE void differences(const Corners& u, Matrix& E)
{
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
template <CellShape shape, int t>
VDBFRAC_INLINE void spread(const Matrix& P, Corners& f)
{
    constexpr auto& tets = kCellTets<shape>;
    unroll<4>([&](auto a) __attribute__((always_inline)) {
        unroll<3>([&](auto d) __attribute__((always_inline)) {
            constexpr double g = tets.gradient[t][a][d];
            if constexpr (g != 0)
                for (int i = 0; i < 3; ++i) addScaled<false>(f[tets.corner[t][a]][i], g, P[i][d]);
        });
    });
}

/// C = A^T B.
VDBFRAC_INLINE void transposedProduct(const Matrix& A, const Matrix& B, Matrix& C)
{
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) C[i][j] = A[0][i] * B[0][j] + A[1][i] * B[1][j] + A[2][i] * B[2][j];
}

VDBFRAC_INLINE void product(const Matrix& A, const Matrix& B, Matrix& C)
{
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) C[i][j] = A[i][0] * B[0][j] + A[i][1] * B[1][j] + A[i][2] * B[2][j];
}

/// cof F, with F^{-1} = cof(F)^T / det F.
VDBFRAC_INLINE void cofactor(const Matrix& F, Matrix& C)
{
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            C[i][j] = F[i1][j1] * F[i2][j2] - F[i1][j2] * F[i2][j1];
        }
}

/// Largest root of x^4 - 2 a x^2 - 8 J x + 2 b - a^2: the trace of S. Newton from above is monotone.
VDBFRAC_INLINE Pack traceOfS(Pack a, Pack b, Pack J)
{
    constexpr int kMostSteps = 24;
    constexpr double kConverged = 4e-16;  // two units in the last place
    Pack x = root(3. * a);
    const Pack c = 2. * b - a * a;
    Mask active = x > 0;
    for (int step = 0; step < kMostSteps && any(active); ++step) {
        const Pack x2 = x * x;
        const Pack value = (x2 - 2. * a) * x2 - 8. * J * x + c;
        const Pack slope = 4. * (x * (x2 - a) - 2. * J);
        const Pack move = value / slope;
        x -= active ? move : all(0);
        active &= magnitude(move) > kConverged * x;
    }
    return x;
}

/// Rotation R of the signed polar decomposition in closed form. I1 = tr S is a root of a quartic in the invariants of
/// F, and R = dI1/dF:
///   R = ((I1^2 + a) F + 2 I1 cof F - 2 F F^T F) / D,  D = I1 (I1^2 - a) - 2 J = (s1+s2)(s2+s3)(s3+s1),
/// a = |F|^2, b = |F^T F|^2, J = det F; then one Newton-Schulz step to orthogonality. Returns the lanes in which D is
/// too small for it.
VDBFRAC_INLINE Mask closedPolar(const Matrix& F, Matrix& R)
{
    constexpr double kSafe = 1e-2;  // of |F|^3; rounding is magnified by its inverse
    Matrix C, cof, FC, raw, G;
    transposedProduct(F, F, C);
    cofactor(F, cof);
    product(F, C, FC);
    const Pack a = C[0][0] + C[1][1] + C[2][2];
    const Pack b = C[0][0] * C[0][0] + C[1][1] * C[1][1] + C[2][2] * C[2][2] +
                   2. * (C[0][1] * C[0][1] + C[1][2] * C[1][2] + C[2][0] * C[2][0]);
    const Pack J = F[0][0] * cof[0][0] + F[0][1] * cof[0][1] + F[0][2] * cof[0][2];
    const Pack I1 = traceOfS(a, b, J);
    const Pack D = I1 * (I1 * I1 - a) - 2. * J;
    const Pack inverse = 1. / D;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            raw[i][j] = ((I1 * I1 + a) * F[i][j] + 2. * I1 * cof[i][j] - 2. * FC[i][j]) * inverse;
    transposedProduct(raw, raw, G);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            R[i][j] = 1.5 * raw[i][j] - 0.5 * (raw[i][0] * G[0][j] + raw[i][1] * G[1][j] + raw[i][2] * G[2][j]);
    return ~(D > kSafe * a * root(a));  // also true where anything is not a number
}

/// Symmetric part of R^T F, as xx, yy, zz, yz, zx, xy.
VDBFRAC_INLINE void stretch(const Matrix& R, const Matrix& F, Pack (&S)[6])
{
    Matrix A;
    transposedProduct(R, F, A);
    for (int i = 0; i < 3; ++i) {
        S[i] = A[i][i];
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        S[i + 3] = 0.5 * (A[j][k] + A[k][j]);
    }
}

/// T = t (tr(S) I - S)^{-1}.
VDBFRAC_INLINE void twist(const Pack (&S)[6], Pack t, Pack (&T)[6])
{
    const Pack trace = S[0] + S[1] + S[2];
    const Pack M[6] = {trace - S[0], trace - S[1], trace - S[2], -S[3], -S[4], -S[5]};
    Pack adjugate[6];
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        adjugate[i] = M[j] * M[k] - M[i + 3] * M[i + 3];
        adjugate[i + 3] = M[j + 3] * M[k + 3] - M[i] * M[i + 3];
    }
    const Pack scale = t / (M[0] * adjugate[0] + M[5] * adjugate[5] + M[4] * adjugate[4]);
    for (int i = 0; i < 6; ++i) T[i] = scale * adjugate[i];
}

/// F, R, S and tr S - 3 of the tets of eight cells.
struct Strains {
    Matrix F[tetmesh::kMostTets], R[tetmesh::kMostTets];
    Pack S[tetmesh::kMostTets][6];
    Pack dilation[tetmesh::kMostTets];
    Mask robust[tetmesh::kMostTets];
};

void takeRobustPolar(Strains& s, int t, const RobustTet& scalar)
{
    for (int l = 0; l < kLanes; ++l) {
        if (!s.robust[t][l]) continue;
        double F[9], R[9], S[6];
        for (int k = 0; k < 9; ++k) F[k] = s.F[t][k / 3][k % 3][l];
        scalar.polar(F, R, S);
        for (int k = 0; k < 9; ++k) s.R[t][k / 3][k % 3][l] = R[k];
        for (int k = 0; k < 6; ++k) s.S[t][k][l] = S[k];
    }
}

template <CellShape shape, int t>
VDBFRAC_INLINE std::int64_t strainOfTet(const Corners& x, Pack volume, double h, Strains& s, const RobustTet& scalar)
{
    const Mask used = volume > 0;
    const double scale = 1 / h;
    differences<shape, t>(x, s.F[t]);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) s.F[t][i][j] = used ? s.F[t][i][j] * scale : all(i == j);
    s.robust[t] = closedPolar(s.F[t], s.R[t]);
    stretch(s.R[t], s.F[t], s.S[t]);
    std::int64_t count = 0;
    if (any(s.robust[t])) {
        takeRobustPolar(s, t, scalar);
        for (int l = 0; l < kLanes; ++l) count += s.robust[t][l] != 0;
    }
    s.dilation[t] = (s.S[t][0] - 1.) + (s.S[t][1] - 1.) + (s.S[t][2] - 1.);
    return count;
}

/// Mean over the tets of a cell weighted by volume; 0 in a cell without material.
template <int tets>
VDBFRAC_INLINE Pack cellMean(const Batch& batch, const Pack (&value)[tetmesh::kMostTets])
{
    Pack sum = all(0), volume = all(0);
    for (int t = 0; t < tets; ++t) {
        const Pack V = load(batch.volume[t]);
        sum += V * value[t];
        volume += V;
    }
    return volume > 0 ? sum / volume : all(0);
}

template <int t>
VDBFRAC_INLINE void storeTangent(const Strains& s, Pack twistOfTet, Pack scale, BatchTangent& out, const RobustTet& scalar)
{
    Pack T[6];
    twist(s.S[t], twistOfTet, T);
    if (any(s.robust[t]))
        for (int l = 0; l < kLanes; ++l) {
            if (!s.robust[t][l]) continue;
            double S[6], lane[6];
            for (int k = 0; k < 6; ++k) S[k] = s.S[t][k][l];
            scalar.twist(S, twistOfTet[l], lane);
            for (int k = 0; k < 6; ++k) T[k][l] = lane[k];
        }
    for (int k = 0; k < 9; ++k) store(out.R[t][k], s.R[t][k / 3][k % 3]);
    for (int k = 0; k < 6; ++k) store(out.T[t][k], T[k] * scale);
}

template <CellShape shape, bool cellDilation>
KernelResult evaluateBatch(const PatchData& patch, int b, const RobustTet& scalar)
{
    constexpr int tets = kCellTets<shape>.count;
    const Batch& batch = patch.batch[b];
    Corners x, f;
    Strains s;
    KernelResult result;
    gather(batch, patch.in, patch.stride, x);
    unroll<tets>([&](auto t) __attribute__((always_inline)) {
        result.robustTets += strainOfTet<shape, t>(x, load(batch.volume[t]), patch.h, s, scalar);
    });
    for (auto& corner : f)
        for (Pack& v : corner) v = all(0);
    const Pack mu = load(batch.mu), lambda = load(batch.lambda);
    const Pack twoThirdsMu = 2. / 3. * mu, bulk = lambda + twoThirdsMu;
    const Pack mean = cellDilation ? cellMean<tets>(batch, s.dilation) : all(0);
    Pack energy = all(0);
    unroll<tets>([&](auto t) __attribute__((always_inline)) {
        const Pack V = load(batch.volume[t]);
        // Per tet the bulk part is lambda/2 d^2; averaged it is K/2 mean^2, and -mu/3 d^2 leaves the deviatoric part.
        const Pack d = s.dilation[t], pressure = cellDilation ? bulk * mean - twoThirdsMu * d : lambda * d;
        const Pack force = V / patch.h;
        Pack deviation = all(0);
        Matrix P;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                const Pack e = s.F[t][i][j] - s.R[t][i][j];
                deviation += e * e;
                P[i][j] = (2. * mu * e + pressure * s.R[t][i][j]) * force;
            }
        const Pack psi = cellDilation ? mu * deviation - 0.5 * twoThirdsMu * d * d + 0.5 * bulk * mean * mean
                                      : mu * deviation + 0.5 * lambda * d * d;
        energy += V * psi;
        if (patch.psi) storeLoose(patch.psi + (b * tetmesh::kMostTets + t) * kLanes, psi);
        spread<shape, t>(P, f);
        if (patch.tangent)
            storeTangent<t>(s, pressure - 2. * mu, V / (patch.h * patch.h), patch.tangent[b], scalar);
    });
    scatter(batch, f, patch.stride, patch.out);
    for (int l = 0; l < kLanes; ++l) result.energy += energy[l];
    return result;
}

template <CellShape shape, int t>
VDBFRAC_INLINE Pack traceOfTet(const Corners& u, const BatchTangent& tangent, Matrix& E)
{
    differences<shape, t>(u, E);
    Pack trace = all(0);
    for (int k = 0; k < 9; ++k) trace += load(tangent.R[t][k]) * E[k / 3][k % 3];
    return trace;
}

/// dP = 2 mu dF + bulk R + R skew(T axial(R^T dF - dF^T R)), times V / h^2 with dF in units of 1/h.
template <CellShape shape, int t>
VDBFRAC_INLINE void productOfTet(const Matrix& E, const BatchTangent& tangent, Pack twoMu, Pack bulk, Corners& f)
{
    Matrix R, A, B, P;
    for (int k = 0; k < 9; ++k) R[k / 3][k % 3] = load(tangent.R[t][k]);
    transposedProduct(R, E, A);
    const Pack w[3] = {A[2][1] - A[1][2], A[0][2] - A[2][0], A[1][0] - A[0][1]};
    Pack T[6], v[3];
    for (int k = 0; k < 6; ++k) T[k] = load(tangent.T[t][k]);
    v[0] = T[0] * w[0] + T[5] * w[1] + T[4] * w[2];
    v[1] = T[5] * w[0] + T[1] * w[1] + T[3] * w[2];
    v[2] = T[4] * w[0] + T[3] * w[1] + T[2] * w[2];
    B[0][0] = B[1][1] = B[2][2] = bulk;
    B[0][1] = -v[2], B[1][0] = v[2];
    B[0][2] = v[1], B[2][0] = -v[1];
    B[1][2] = -v[0], B[2][1] = v[0];
    product(R, B, P);
    for (int k = 0; k < 9; ++k) P[k / 3][k % 3] += twoMu * E[k / 3][k % 3];
    spread<shape, t>(P, f);
}

template <CellShape shape, bool cellDilation>
void productBatch(const PatchData& patch, int b)
{
    constexpr int tets = kCellTets<shape>.count;
    const Batch& batch = patch.batch[b];
    const BatchTangent& tangent = patch.tangent[b];
    Corners u, f;
    gather(batch, patch.in, patch.stride, u);
    for (auto& corner : f)
        for (Pack& v : corner) v = all(0);
    const double scale = 1 / (patch.h * patch.h);
    const Pack twoMu = 2. * load(batch.mu) * scale, lambda = load(batch.lambda) * scale;
    const Pack third = twoMu / 3., bulk = lambda + third;
    Pack mean = all(0), trace[tetmesh::kMostTets];
    if constexpr (cellDilation) {
        unroll<tets>([&](auto t) __attribute__((always_inline)) {
            Matrix E;
            trace[t] = traceOfTet<shape, t>(u, tangent, E);
        });
        mean = cellMean<tets>(batch, trace);
    }
    unroll<tets>([&](auto t) __attribute__((always_inline)) {
        const Pack V = load(batch.volume[t]);
        Matrix E;
        if constexpr (cellDilation) {
            differences<shape, t>(u, E);
            productOfTet<shape, t>(E, tangent, twoMu * V, (bulk * mean - third * trace[t]) * V, f);
        } else {
            const Pack own = traceOfTet<shape, t>(u, tangent, E);
            productOfTet<shape, t>(E, tangent, twoMu * V, lambda * own * V, f);
        }
    });
    scatter(batch, f, patch.stride, patch.out);
}

/// U = R T R^T, as xx, yy, zz, yz, zx, xy.
VDBFRAC_INLINE void rotated(const Matrix& R, const Pack (&T)[6], Pack (&U)[6])
{
    const Matrix full = {{T[0], T[5], T[4]}, {T[5], T[1], T[3]}, {T[4], T[3], T[2]}};
    Matrix RT;
    product(R, full, RT);
    constexpr int kRow[6] = {0, 1, 2, 1, 2, 0}, kColumn[6] = {0, 1, 2, 2, 0, 1};
    for (int k = 0; k < 6; ++k) {
        const int i = kRow[k], j = kColumn[k];
        U[k] = RT[i][0] * R[j][0] + RT[i][1] * R[j][1] + RT[i][2] * R[j][2];
    }
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
    constexpr int kRow[6] = {0, 1, 2, 1, 2, 0}, kColumn[6] = {0, 1, 2, 2, 0, 1};
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

template <CellShape shape, bool cellDilation>
void diagonalBatch(const PatchData& patch, int b)
{
    constexpr auto& cell = kCellTets<shape>;
    const Batch& batch = patch.batch[b];
    const BatchTangent& tangent = patch.tangent[b];
    const double scale = 1 / (patch.h * patch.h);
    const Pack mu = load(batch.mu) * scale, lambda = load(batch.lambda) * scale;
    Pack K[tetmesh::kCorners][6], bulk[tetmesh::kCorners][3], cellVolume = all(0);
    for (int c = 0; c < tetmesh::kCorners; ++c) {
        for (Pack& v : K[c]) v = all(0);
        for (Pack& v : bulk[c]) v = all(0);
    }
    for (int t = 0; t < cell.count; ++t) {
        const Pack V = load(batch.volume[t]);
        cellVolume += V;
        Matrix R;
        Pack T[6], U[6];
        for (int k = 0; k < 9; ++k) R[k / 3][k % 3] = load(tangent.R[t][k]);
        for (int k = 0; k < 6; ++k) T[k] = load(tangent.T[t][k]);
        rotated(R, T, U);
        for (int a = 0; a < 4; ++a) {
            const auto& g = cell.gradient[t][a];
            const int c = cell.corner[t][a];
            Pack q[3];
            for (int i = 0; i < 3; ++i) q[i] = R[i][0] * g[0] + R[i][1] * g[1] + R[i][2] * g[2];
            const double length2 = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
            for (int i = 0; i < 3; ++i) K[c][i] += 2. * length2 * mu * V;
            addTwistBlock(q, U, K[c]);
            addOuter(q, (cellDilation ? -2. / 3. * mu : lambda) * V, K[c]);
            if (cellDilation)
                for (int i = 0; i < 3; ++i) bulk[c][i] += V * q[i];
        }
    }
    if (cellDilation) {
        const Pack share = cellVolume > 0 ? (lambda + 2. / 3. * mu) / cellVolume : all(0);
        for (int c = 0; c < tetmesh::kCorners; ++c) addOuter(bulk[c], share, K[c]);
    }
    scatter(batch, K, patch.stride, patch.out);
}

template <CellShape shape>
KernelResult evaluateShape(const PatchData& patch, int b, bool cellDilation, const RobustTet& scalar)
{
    return cellDilation ? evaluateBatch<shape, true>(patch, b, scalar) : evaluateBatch<shape, false>(patch, b, scalar);
}
template <CellShape shape>
void productShape(const PatchData& patch, int b, bool cellDilation)
{
    cellDilation ? productBatch<shape, true>(patch, b) : productBatch<shape, false>(patch, b);
}
template <CellShape shape>
void diagonalShape(const PatchData& patch, int b, bool cellDilation)
{
    cellDilation ? diagonalBatch<shape, true>(patch, b) : diagonalBatch<shape, false>(patch, b);
}

KernelResult evaluate(const PatchData& patch, bool cellDilation, const RobustTet& scalar)
{
    KernelResult sum;
    for (int b = 0; b < patch.batches; ++b) {
        KernelResult r;
        switch (patch.batch[b].shape) {
        case CellShape::six: r = evaluateShape<CellShape::six>(patch, b, cellDilation, scalar); break;
        case CellShape::fiveEven: r = evaluateShape<CellShape::fiveEven>(patch, b, cellDilation, scalar); break;
        case CellShape::fiveOdd: r = evaluateShape<CellShape::fiveOdd>(patch, b, cellDilation, scalar); break;
        }
        sum.energy += r.energy;
        sum.robustTets += r.robustTets;
    }
    return sum;
}

void productAll(const PatchData& patch, bool cellDilation)
{
    for (int b = 0; b < patch.batches; ++b) switch (patch.batch[b].shape) {
        case CellShape::six: productShape<CellShape::six>(patch, b, cellDilation); break;
        case CellShape::fiveEven: productShape<CellShape::fiveEven>(patch, b, cellDilation); break;
        case CellShape::fiveOdd: productShape<CellShape::fiveOdd>(patch, b, cellDilation); break;
        }
}

void diagonalAll(const PatchData& patch, bool cellDilation)
{
    for (int b = 0; b < patch.batches; ++b) switch (patch.batch[b].shape) {
        case CellShape::six: diagonalShape<CellShape::six>(patch, b, cellDilation); break;
        case CellShape::fiveEven: diagonalShape<CellShape::fiveEven>(patch, b, cellDilation); break;
        case CellShape::fiveOdd: diagonalShape<CellShape::fiveOdd>(patch, b, cellDilation); break;
        }
}

#define VDBFRAC_TEXT2(x) #x
#define VDBFRAC_TEXT(x) VDBFRAC_TEXT2(x)

}  // namespace

const Kernel VDBFRAC_KERNEL = {evaluate, productAll, diagonalAll, VDBFRAC_TEXT(VDBFRAC_KERNEL)};

}  // namespace vdbfrac::solver
