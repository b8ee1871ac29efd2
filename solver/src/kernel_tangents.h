// What products, diagonal blocks and means make of the tangents of the strain laws (kernel_laws.h), eight tets at a
// time. Only for the parts of a kernel.
//
// A type of tangents has, with E = dF h, `twoMu` and `bulk` the moduli times V, and all in units in which T is kept:
//   rate                dP from E, R and T
//   turnedRate          the same where one R and T serve all tets of a cell, in the frame of R: from D = R^T E
//   kPlainRate          whether the frame of the system has a share of it too: plainRate
//   addVertexBlock      a tet's share of the diagonal block of a vertex with h grad N = g, q = R g, without dilatation
//   ofTet               T of a tet from its share V T of that of its cell
//   mean                R and T of a cell from weighted means over its tets
//   minEigenvalue     of T / (mu h) that leaves the tangent semidefinite, with `share` of linear elasticity in it
#pragma once

#include "kernel_polar.h"

namespace vdbfrac::solver {

namespace {

/// Adds skew(q) U skew(q)^T.
VDBFRAC_INLINE void addTwistBlock(const Pack (&q)[3], const Pack (&U)[6], Pack (&K)[6])
{
    Matrix full, QU;  // skew(q) U
    unpackSymmetric(U, full);
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

/// Of the corotational law and of the linear one, for which R = I: rotation R and R (twist operator) R^T.
struct RotatedTangent {
    static constexpr bool kPlainRate = false;
    static double minEigenvalue(double share) { return -(1 + share); }

    /// dP = 2 mu dF + bulk R + skew(T axial(dF R^T - R dF^T)) R. By columns c: axial = sum_c R_c x dF_c, and skew(v) R
    /// has the columns v x R_c.
    template <class P>
    VDBFRAC_INLINE static void rate(const MatrixOf<P>& E, const MatrixOf<P>& R, const P (&T)[6], P twoMu, P bulk,
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
            for (int c = 0; c < 3; ++c)
                stress[i][c] = twoMu * E[i][c] + bulk * R[i][c] + v[j] * R[k][c] - v[k] * R[j][c];
        }
    }

    template <class P>
    VDBFRAC_INLINE static void turnedRate(const MatrixOf<P>& D, const P (&T)[6], P V, P twoMu, P bulk,
                                          MatrixOf<P>& stress)
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

    VDBFRAC_INLINE static void addVertexBlock(const Pack (&g)[3], const Pack (&q)[3], const Matrix&, const Pack (&T)[6],
                                              Pack muV, Pack (&K)[6])
    {
        const Pack length2 = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
        for (int i = 0; i < 3; ++i) K[i] += 2. * length2 * muV;
        addTwistBlock(q, T, K);
    }

    VDBFRAC_INLINE static void ofTet(const Matrix& R, const Pack (&own)[6], Pack (&T)[6]) { rotated(R, own, T); }

    /// T in the frame of R.
    VDBFRAC_INLINE static void mean(const RobustTet& scalar, Matrix& R, Pack (&T)[6])
    {
        Matrix nearest, back;
        Pack turned[6];
        nearestRotation(R, scalar, nearest);
        for (int k = 0; k < 9; ++k) back[k / 3][k % 3] = nearest[k % 3][k / 3];
        rotated(back, T, turned);
        for (int k = 0; k < 9; ++k) R[k / 3][k % 3] = nearest[k / 3][k % 3];
        for (int k = 0; k < 6; ++k) T[k] = turned[k];
    }
};

/// F (in the place of R) and Sigma (in that of T).
struct GreenTangent {
    static constexpr bool kPlainRate = true;
    static double minEigenvalue(double) { return 0; }  // the rest is a square of the rate of strain

    /// dP = dF Sigma + F (2 mu sym(F^T dF) + bulk I).
    template <class P>
    VDBFRAC_INLINE static void rate(const MatrixOf<P>& E, const MatrixOf<P>& F, const P (&T)[6], P twoMu, P bulk,
                                    MatrixOf<P>& stress)
    {
        MatrixOf<P> G, rate, Sigma;
        unpackSymmetric(T, Sigma);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) G[i][j] = F[0][i] * E[0][j] + F[1][i] * E[1][j] + F[2][i] * E[2][j];
        symmetricRate<P>(G, twoMu / 2, bulk, rate);
        for (int i = 0; i < 3; ++i)
            for (int c = 0; c < 3; ++c)
                stress[i][c] = E[i][0] * Sigma[0][c] + E[i][1] * Sigma[1][c] + E[i][2] * Sigma[2][c] +
                               F[i][0] * rate[0][c] + F[i][1] * rate[1][c] + F[i][2] * rate[2][c];
    }

    template <class P>
    VDBFRAC_INLINE static void turnedRate(const MatrixOf<P>& D, const P (&)[6], P, P twoMu, P bulk, MatrixOf<P>& stress)
    {
        symmetricRate<P>(D, twoMu / 2, bulk, stress);
    }
    template <class P>
    VDBFRAC_INLINE static void plainRate(const MatrixOf<P>& E, const P (&T)[6], P V, MatrixOf<P>& stress)
    {
        MatrixOf<P> Sigma;
        unpackSymmetric(T, Sigma);
        for (int i = 0; i < 3; ++i)
            for (int c = 0; c < 3; ++c)
                stress[i][c] = V * (E[i][0] * Sigma[0][c] + E[i][1] * Sigma[1][c] + E[i][2] * Sigma[2][c]);
    }

    VDBFRAC_INLINE static void addVertexBlock(const Pack (&g)[3], const Pack (&q)[3], const Matrix& F,
                                              const Pack (&T)[6], Pack muV, Pack (&K)[6])
    {
        const Pack length2 = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
        const Pack stress = T[0] * g[0] * g[0] + T[1] * g[1] * g[1] + T[2] * g[2] * g[2] +
                            2. * (T[3] * g[1] * g[2] + T[4] * g[2] * g[0] + T[5] * g[0] * g[1]);
        for (int i = 0; i < 3; ++i) K[i] += stress;
        for (int k = 0; k < 6; ++k) {
            const int i = kRow[k], j = kColumn[k];
            K[k] += length2 * muV * (F[i][0] * F[j][0] + F[i][1] * F[j][1] + F[i][2] * F[j][2]);
        }
        addOuter(q, muV, K);
    }

    VDBFRAC_INLINE static void ofTet(const Matrix&, const Pack (&own)[6], Pack (&T)[6])
    {
        for (int k = 0; k < 6; ++k) T[k] = own[k];
    }
    VDBFRAC_INLINE static void mean(const RobustTet&, Matrix&, Pack (&)[6]) {}

private:
    /// mu (G + G^T) + bulk I.
    template <class P>
    VDBFRAC_INLINE static void symmetricRate(const MatrixOf<P>& G, P mu, P bulk, MatrixOf<P>& rate)
    {
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) rate[i][j] = mu * (G[i][j] + G[j][i]);
        for (int i = 0; i < 3; ++i) rate[i][i] += bulk;
    }
};

/// Calls f<tangents of the law>().
template <class F>
VDBFRAC_INLINE void withTangents(Strain strain, const F& f)
{
    strain == Strain::green ? f.template operator()<GreenTangent>() : f.template operator()<RotatedTangent>();
}

/// What is left of the shear modulus.
template <class Real>
VDBFRAC_INLINE PackT<Real> leftOf(const PatchData& patch, int b)
{
    return patch.yielding ? load<Real>(patch.yielding[b].left) : PackT<Real>{} + Real(1);
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

}  // namespace

}  // namespace vdbfrac::solver
