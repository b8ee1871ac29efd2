#include <vdbfrac/grid/griffith.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace vdbfrac::grid {

namespace {

/// Integral of 1 / (pi delta_eps) from 0 to phi.
double integral(double phi, double eps) { return eps * phi + phi * phi * phi / (3 * eps); }

}  // namespace

double griffithTime(double phi, double psi, double move, const GriffithStep& step)
{
    const double drive = psi - step.kappa, eps = step.epsilon;
    if (!(drive > 0)) return std::numeric_limits<double>::infinity();
    return std::numbers::pi * (integral(phi + move, eps) - integral(phi, eps)) / drive;
}

double griffithUpdate(double phi, double psi, const GriffithStep& step)
{
    const double drive = psi - step.kappa;
    if (!(drive > 0) || step.maxMove <= 0) return phi;
    const double eps = step.epsilon;
    const double goal = integral(phi, eps) + step.s * drive / std::numbers::pi;
    const double most = phi + step.maxMove;
    if (integral(most, eps) <= goal) return most;
    // Depressed cubic p^3 + 3 eps^2 p = 3 eps goal, one real root (Cardano in hyperbolic form), one Newton step to
    // polish.
    double p = 2 * eps * std::sinh(std::asinh(1.5 * goal / (eps * eps)) / 3);
    p -= (integral(p, eps) - goal) / (eps + p * p / eps);
    return std::clamp(p, phi, most);
}

double rayleighSpeed(double mu, double nu, double rho)
{
    // Over the speed of shear waves: Freund 1990's fit, off by 1.4 % at 0 and .2 % from .25 on; below 0, where that has
    // none, the polynomial of Rahman and Michelitsch 2006, off by less than .5 %.
    const double ratio = nu < 0 ? .874 + nu * (.196 - nu * (.043 + nu * .055)) : (.862 + 1.14 * nu) / (1 + nu);
    return std::sqrt(mu / rho) * ratio;
}

}  // namespace vdbfrac::grid
