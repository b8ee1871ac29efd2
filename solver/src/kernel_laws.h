// The strain laws (material.h), eight tets at a time: from F to strain, stress and tangent. Only for the parts of a
// kernel; what a product makes of the tangents is in kernel_tangents.h.
//
// With S such that the strain is e = S - I, and p the pressure (lambda tr e, or as cell dilation has it):
//   corotational  F = R S             P = 2 mu (F - R) + p R           tangent R and R T R^T, T the twist operator
//   linear        S = sym(F), R = I   P = 2 mu e + p I                 tangent I and -mu I, which is linear elasticity
//   green         S = (F^T F + I)/2   P = F Sigma, Sigma = 2 mu e + p I  tangent F and Sigma
//
// A law has
//   measure  S from F; returns how many tets took the scalar path
//   stress   P; returns |e|^2
//   store    writes the tangent
//   kLong    whether what measure and store do is much
#pragma once

#include "kernel_polar.h"

namespace vdbfrac::solver {

namespace {

/// The place of the mean of a cell behind its tets.
constexpr int kMean = tetmesh::kMaxTets;

/// F, R, S and tr S - 3 of the tets of eight cells, and of their means.
struct Strains {
    Matrix F[kMean + 1], R[kMean + 1];
    Pack S[kMean + 1][6];
    Pack dilation[kMean + 1];
    Mask robust[kMean + 1];
};

/// What the tangent of a tet is made from besides its strain.
struct TangentScale {
    Pack mu;        ///< what is left of it where it yields
    double damped;  ///< mu of what is added of linear elasticity in the frame of R
    Pack pressure;
    Pack scale;  ///< V / h^2
};

/// Sigma = 2 mu (S - I) + p I.
VDBFRAC_INLINE void secondStress(const Pack (&S)[6], Pack mu, Pack pressure, Pack (&Sigma)[6])
{
    for (int k = 0; k < 6; ++k) Sigma[k] = k < 3 ? 2. * mu * (S[k] - 1.) + pressure : 2. * mu * S[k];
}

/// |S - I|^2.
VDBFRAC_INLINE Pack squareOfStrain(const Pack (&S)[6])
{
    Pack square = all(0);
    for (int k = 0; k < 6; ++k) {
        const Pack e = k < 3 ? S[k] - 1. : S[k];
        square += k < 3 ? e * e : 2. * e * e;
    }
    return square;
}

struct Corotational {
    static constexpr bool kLong = true;

    VDBFRAC_INLINE static std::int64_t measure(Strains& s, int t, const RobustTet& scalar)
    {
        s.robust[t] = closedPolar(s.F[t], s.R[t]);
        stretch(s.R[t], s.F[t], s.S[t]);
        if (!any(s.robust[t])) return 0;
        takeRobustPolar(s, t, scalar);
        std::int64_t count = 0;
        for (int l = 0; l < kLanes; ++l) count += s.robust[t][l] != 0;
        return count;
    }
    VDBFRAC_INLINE static Pack stress(const Strains& s, int t, Pack mu, Pack pressure, Matrix& P)
    {
        Pack square = all(0);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                const Pack e = s.F[t][i][j] - s.R[t][i][j];
                square += e * e;
                P[i][j] = 2. * mu * e + pressure * s.R[t][i][j];
            }
        return square;
    }
    VDBFRAC_INLINE static void store(const Strains& s, int t, const TangentScale& of, TetTangent& out,
                                     const RobustTet& scalar)
    {
        Pack T[6], U[6];
        const Pack t0 = of.pressure - 2. * of.mu;
        twist(s.S[t], t0, T);
        if (any(s.robust[t])) takeRobustTwist(s, t, t0, scalar, T);
        const Pack warped = all(-of.damped);
        for (int k = 0; k < 3; ++k) T[k] += warped;
        rotated(s.R[t], T, U);
        for (int k = 0; k < 6; ++k) solver::store(out.T[k], U[k] * of.scale);
        for (int k = 0; k < 9; ++k) solver::store(out.R[k], s.R[t][k / 3][k % 3]);
    }

private:
    VDBFRAC_OUTLINE static void takeRobustPolar(Strains& s, int t, const RobustTet& scalar)
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
    VDBFRAC_OUTLINE static void takeRobustTwist(const Strains& s, int t, Pack t0, const RobustTet& scalar, Pack (&T)[6])
    {
        for (int l = 0; l < kLanes; ++l) {
            if (!s.robust[t][l]) continue;
            double S[6], lane[6];
            for (int k = 0; k < 6; ++k) S[k] = s.S[t][k][l];
            scalar.twist(S, t0[l], lane);
            for (int k = 0; k < 6; ++k) T[k][l] = lane[k];
        }
    }
};

struct Linear {
    static constexpr bool kLong = false;

    VDBFRAC_INLINE static std::int64_t measure(Strains& s, int t, const RobustTet&)
    {
        for (int k = 0; k < 6; ++k) s.S[t][k] = 0.5 * (s.F[t][kRow[k]][kColumn[k]] + s.F[t][kColumn[k]][kRow[k]]);
        return 0;
    }
    VDBFRAC_INLINE static Pack stress(const Strains& s, int t, Pack mu, Pack pressure, Matrix& P)
    {
        Pack Sigma[6];
        secondStress(s.S[t], mu, pressure, Sigma);
        unpackSymmetric(Sigma, P);
        return squareOfStrain(s.S[t]);
    }
    VDBFRAC_INLINE static void store(const Strains&, int, const TangentScale& of, TetTangent& out, const RobustTet&)
    {
        for (int k = 0; k < 6; ++k) solver::store(out.T[k], (k < 3 ? -of.mu - of.damped : all(0)) * of.scale);
        for (int k = 0; k < 9; ++k) solver::store(out.R[k], all(k % 4 == 0));
    }
};

struct Green {
    static constexpr bool kLong = false;

    VDBFRAC_INLINE static std::int64_t measure(Strains& s, int t, const RobustTet&)
    {
        Matrix C;
        transposedProduct(s.F[t], s.F[t], C);
        for (int k = 0; k < 6; ++k) s.S[t][k] = 0.5 * (C[kRow[k]][kColumn[k]] + all(kRow[k] == kColumn[k]));
        return 0;
    }
    VDBFRAC_INLINE static Pack stress(const Strains& s, int t, Pack mu, Pack pressure, Matrix& P)
    {
        Pack packed[6];
        Matrix Sigma;
        secondStress(s.S[t], mu, pressure, packed);
        unpackSymmetric(packed, Sigma);
        product(s.F[t], Sigma, P);
        return squareOfStrain(s.S[t]);
    }
    VDBFRAC_INLINE static void store(const Strains& s, int t, const TangentScale& of, TetTangent& out, const RobustTet&)
    {
        Pack Sigma[6];
        secondStress(s.S[t], of.mu, of.pressure, Sigma);
        for (int k = 0; k < 6; ++k) solver::store(out.T[k], Sigma[k] * of.scale);
        for (int k = 0; k < 9; ++k) solver::store(out.R[k], s.F[t][k / 3][k % 3]);
    }
};

/// Calls f<Law>().
template <class F>
VDBFRAC_INLINE void withLaw(Strain strain, const F& f)
{
    switch (strain) {
    case Strain::corotational: return f.template operator()<Corotational>();
    case Strain::linear: return f.template operator()<Linear>();
    case Strain::green: return f.template operator()<Green>();
    }
}

}  // namespace

}  // namespace vdbfrac::solver
