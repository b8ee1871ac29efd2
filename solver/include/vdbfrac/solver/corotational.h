// Corotational elasticity of one tet, in plain scalar form: the reference for the vectorised kernel, and its path for
// tets that are nearly flat or inverted.
//
// Parker & O'Brien 2009, section 3.1; McAdams et al. 2011, section 3; Smith, de Goes, Kim 2019, sections 3-4.
//   F        deformation gradient, 3x3
//   F = R S  polar decomposition with R a rotation (det R = 1 also when det F < 0), S symmetric
//   s_i      signed singular values: eigenvalues of S, only the smallest may be negative
//   Psi      = mu sum (s_i - 1)^2 + lambda/2 (tr S - 3)^2                         energy density [J/m^3]
//   P        = 2 mu (F - R) + lambda tr(S - I) R                                  first Piola-Kirchhoff stress [Pa]
//   t        = lambda (tr S - 3) - 2 mu
//   twist    H has eigenvalues 2 mu (5x), 2 mu + 3 lambda, and 2 mu + 2 t / (s_i + s_j): only these can be negative
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/solver/material.h>

namespace vdbfrac::solver {

/// w x as a matrix.
Mat3 skew(const Vec3& w);

struct Polar {
    Mat3 R;
    Mat3 S;
    Vec3 s;  ///< falling
    Mat3 V;  ///< eigenvectors of S, by column
};
/// Signed polar decomposition by SVD; any F, also singular ones (then one of the closest rotations).
Polar signedPolar(const Mat3& F);

double energyDensity(const Mat3& F, const Material& material);
Mat3 piolaStress(const Mat3& F, const Material& material);

/// dP for a change dF, exact.
Mat3 stressDifferential(const Mat3& F, const Mat3& dF, const Material& material);

/// The three twist eigenvalues, of the pairs (s_0, s_1), (s_1, s_2), (s_2, s_0).
Vec3 twistEigenvalues(const Mat3& F, const Material& material);

/// Twist operator T of the material frame, t (tr(S) I - S)^{-1}: dR-part of dP is R skew(T axial(R^T dF - dF^T R)).
/// s_i + s_j is kept from 0 by `kTwistGuard`.
Mat3 twistOperator(const Polar& polar, double t);

/// Smallest |s_i + s_j| that is divided by. The true tangent has a pole there; with the guard it is finite, negative
/// enough for the solver to notice and project.
inline constexpr double kTwistGuard = 1e-3;

}  // namespace vdbfrac::solver
