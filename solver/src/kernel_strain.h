// What depends on the measure of strain (material.h), eight tets at a time. Part of kernel_impl.cpp.
//
// With S such that the strain is e = S - I, and p the pressure (lambda tr e, or as cell dilation has it):
//   corotational  F = R S             P = 2 mu (F - R) + p R           tangent R and R T R^T, T the twist operator
//   linear        S = sym(F), R = I   P = 2 mu e + p I                 tangent I and -mu I, which is linear elasticity
//   green         S = (F^T F + I)/2   P = F Sigma, Sigma = 2 mu e + p I  tangent F and Sigma
#pragma once

#include "kernel.h"
#include "kernel_polar.h"

namespace vdbfrac::solver {

namespace {

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

VDBFRAC_INLINE std::int64_t polarOfTet(Strains& s, int t, const RobustTet& scalar)
{
    s.robust[t] = closedPolar(s.F[t], s.R[t]);
    stretch(s.R[t], s.F[t], s.S[t]);
    std::int64_t count = 0;
    if (any(s.robust[t])) {
        takeRobustPolar(s, t, scalar);
        for (int l = 0; l < kLanes; ++l) count += s.robust[t][l] != 0;
    }
    return count;
}

/// S from F; returns the tets that took the scalar path.
template <Strain strain>
VDBFRAC_INLINE std::int64_t measure(Strains& s, int t, const RobustTet& scalar)
{
    std::int64_t count = 0;
    if constexpr (strain == Strain::corotational) {
        count = polarOfTet(s, t, scalar);
    } else {
        Matrix C;
        if constexpr (strain == Strain::green) transposedProduct(s.F[t], s.F[t], C);
        for (int k = 0; k < 6; ++k) {
            const int i = kRow[k], j = kColumn[k];
            s.S[t][k] = strain == Strain::green ? 0.5 * (C[i][j] + all(i == j)) : 0.5 * (s.F[t][i][j] + s.F[t][j][i]);
        }
    }
    s.dilation[t] = (s.S[t][0] - 1.) + (s.S[t][1] - 1.) + (s.S[t][2] - 1.);
    return count;
}

/// Sigma = 2 mu (S - I) + p I.
VDBFRAC_INLINE void secondStress(const Pack (&S)[6], double mu, Pack pressure, Pack (&Sigma)[6])
{
    for (int k = 0; k < 6; ++k) Sigma[k] = k < 3 ? 2. * mu * (S[k] - 1.) + pressure : 2. * mu * S[k];
}

/// P; returns |e|^2.
template <Strain strain>
VDBFRAC_INLINE Pack stressOfTet(const Strains& s, int t, double mu, Pack pressure, Matrix& P)
{
    Pack square = all(0);
    if constexpr (strain == Strain::corotational) {
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                const Pack e = s.F[t][i][j] - s.R[t][i][j];
                square += e * e;
                P[i][j] = 2. * mu * e + pressure * s.R[t][i][j];
            }
        return square;
    }
    Pack T[6];
    secondStress(s.S[t], mu, pressure, T);
    const Matrix full = {{T[0], T[5], T[4]}, {T[5], T[1], T[3]}, {T[4], T[3], T[2]}};
    if constexpr (strain == Strain::green) product(s.F[t], full, P);
    for (int k = 0; k < 9 && strain == Strain::linear; ++k) P[k / 3][k % 3] = full[k / 3][k % 3];
    for (int k = 0; k < 6; ++k) {
        const Pack e = k < 3 ? s.S[t][k] - 1. : s.S[t][k];
        square += k < 3 ? e * e : 2. * e * e;
    }
    return square;
}

/// R (twist operator) R^T, `share` of linear elasticity with it.
VDBFRAC_INLINE void spatialTwist(const Strains& s, int t, double mu, Pack pressure, double share,
                                 const RobustTet& scalar, Pack (&U)[6])
{
    Pack T[6];
    const Pack t0 = pressure - 2. * mu;
    twist(s.S[t], t0, T);
    if (any(s.robust[t]))
        for (int l = 0; l < kLanes; ++l) {
            if (!s.robust[t][l]) continue;
            double S[6], lane[6];
            for (int k = 0; k < 6; ++k) S[k] = s.S[t][k][l];
            scalar.twist(S, t0[l], lane);
            for (int k = 0; k < 6; ++k) T[k][l] = lane[k];
        }
    const Pack warped = all(-mu * share);
    for (int k = 0; k < 3; ++k) T[k] += warped;
    rotated(s.R[t], T, U);
}

/// `share`: of linear elasticity in the frame of R that is added; `scale`: V / h^2.
template <Strain strain>
VDBFRAC_INLINE void storeTangent(const Strains& s, int t, double mu, Pack pressure, double share, Pack scale,
                                 TetTangent& out, const RobustTet& scalar)
{
    Pack T[6];
    if constexpr (strain == Strain::corotational) spatialTwist(s, t, mu, pressure, share, scalar, T);
    if constexpr (strain == Strain::green) secondStress(s.S[t], mu, pressure, T);
    for (int k = 0; k < 6; ++k)
        store(out.T[k], (strain == Strain::linear ? all(k < 3 ? -mu * (1 + share) : 0) : T[k]) * scale);
    for (int k = 0; k < 9; ++k) {
        const int i = k / 3, j = k % 3;
        store(out.R[k], strain == Strain::corotational ? s.R[t][i][j]
                        : strain == Strain::green      ? s.F[t][i][j]
                                                       : all(i == j));
    }
}

}  // namespace

}  // namespace vdbfrac::solver
