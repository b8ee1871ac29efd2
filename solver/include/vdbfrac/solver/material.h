// Isotropic elastic material.
#pragma once

namespace vdbfrac::solver {

/// What the energy Psi = mu |e|^2 + lambda/2 tr(e)^2 is a square of, F = R S:
enum class Strain {
    corotational,  ///< e = S - I: unchanged by any turn, stress linear in stretch
    linear,        ///< e = sym(F) - I, Cauchy's: turns strain it
    green,         ///< e = (F^T F - I) / 2, Green & Lagrange's; the material of St. Venant and Kirchhoff
};

/// Lame parameters [Pa] and density [kg/m^3].
struct Material {
    double mu = 0;      ///< shear modulus, E / (2 (1 + nu))
    double lambda = 0;  ///< nu E / ((1 + nu) (1 - 2 nu))
    double rho = 0;     ///< rest density

    double youngsModulus() const { return mu * (3 * lambda + 2 * mu) / (lambda + mu); }
    double poissonRatio() const { return lambda / (2 * (lambda + mu)); }
};

/// E [Pa] > 0, -1 < nu < .5, rho [kg/m^3] > 0; the scene has checked them.
constexpr Material makeMaterial(double E, double nu, double rho)
{
    return {E / (2 * (1 + nu)), nu * E / ((1 + nu) * (1 - 2 * nu)), rho};
}

}  // namespace vdbfrac::solver
