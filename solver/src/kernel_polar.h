// Small matrices, eight at a time, and the polar decomposition in closed form. Only for the parts
// of a kernel.
#pragma once

#include "kernel_packs.h"

namespace vdbfrac::solver {

namespace {

template <class P>
using MatrixOf = P[3][3];
using Matrix = MatrixOf<Pack>;

// Of a symmetric matrix: xx, yy, zz, yz, zx, xy.
constexpr int kRow[6] = {0, 1, 2, 1, 2, 0}, kColumn[6] = {0, 1, 2, 2, 0, 1};

/// The whole of a symmetric matrix.
template <class P>
VDBFRAC_INLINE void unpackSymmetric(const P (&S)[6], MatrixOf<P>& full)
{
    for (int k = 0; k < 6; ++k) full[kRow[k]][kColumn[k]] = full[kColumn[k]][kRow[k]] = S[k];
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

/// Largest root of x^4 - 2 a x^2 - 8 J x + 2 b - a^2: the trace of S. Chebyshev's method, of third order, from above: a
/// step is as long in time as its one division, so fewer and better ones pay.
VDBFRAC_INLINE Pack traceOfS(Pack a, Pack b, Pack J)
{
    constexpr int kMaxSteps = 24;
    constexpr double kConverged = 1e-6;  // a move this small leaves its cube times some 1e4 at most, by kSafe below
    Pack x = root(3. * a);
    const Pack c = 2. * b - a * a;
    Mask active = x > 0;
    for (int step = 0; step < kMaxSteps && any(active); ++step) {
        const Pack x2 = x * x;
        const Pack value = (x2 - 2. * a) * x2 - 8. * J * x + c;
        const Pack inverse = 0.25 / (x * (x2 - a) - 2. * J);  // of the slope
        const Pack newton = value * inverse;
        const Pack move = newton + newton * newton * ((6. * x2 - 2. * a) * inverse);  // half the second derivative
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

/// U = R T R^T, as xx, yy, zz, yz, zx, xy.
VDBFRAC_INLINE void rotated(const Matrix& R, const Pack (&T)[6], Pack (&U)[6])
{
    Matrix full, RT;
    unpackSymmetric(T, full);
    product(R, full, RT);
    for (int k = 0; k < 6; ++k) {
        const int i = kRow[k], j = kColumn[k];
        U[k] = RT[i][0] * R[j][0] + RT[i][1] * R[j][1] + RT[i][2] * R[j][2];
    }
}

/// Lanes in which `m` is too far from a rotation for nearestRotation() to get there by itself.
VDBFRAC_INLINE Mask farFromRotation(const Matrix& m)
{
    constexpr double kNear = 0.3;  // off orthogonality
    Matrix G, cof;
    transposedProduct(m, m, G);
    cofactor(m, cof);
    Pack square = all(0);
    for (int k = 0; k < 9; ++k) square += (G[k / 3][k % 3] - all(k % 4 == 0)) * (G[k / 3][k % 3] - all(k % 4 == 0));
    return ~(square < kNear * kNear) | ~(m[0][0] * cof[0][0] + m[0][1] * cof[0][1] + m[0][2] * cof[0][2] > 0);
}

/// R: the rotation nearest to `mean`, a weighted mean of rotations, to single precision.
VDBFRAC_INLINE void nearestRotation(const Matrix& mean, const RobustTet& scalar, Matrix& R)
{
    constexpr int kSteps = 4;  // of Newton-Schulz, from kNear to single precision
    for (int k = 0; k < 9; ++k) R[k / 3][k % 3] = mean[k / 3][k % 3];
    for (int step = 0; step < kSteps; ++step) {
        Matrix G, RG;
        transposedProduct(R, R, G);
        product(R, G, RG);
        for (int k = 0; k < 9; ++k) R[k / 3][k % 3] = 1.5 * R[k / 3][k % 3] - 0.5 * RG[k / 3][k % 3];
    }
    const Mask far = farFromRotation(mean);
    if (!any(far)) return;
    for (int l = 0; l < kLanes; ++l) {
        if (!far[l]) continue;
        double F[9], nearest[9], S[6];
        for (int k = 0; k < 9; ++k) F[k] = mean[k / 3][k % 3][l];
        scalar.polar(F, nearest, S);
        for (int k = 0; k < 9; ++k) R[k / 3][k % 3][l] = nearest[k];
    }
}

}  // namespace

}  // namespace vdbfrac::solver
