// Griffith update of phi: the surface moves where elastic energy pays for it.
//
//   dphi/ds = delta_eps(phi) (Psi - kappa),  delta_eps(phi) = (1/pi) eps / (eps^2 + phi^2),  kept only where phi rises.
// Hegemann et al. 2013, section 5. Symbols: s mobility times pseudo-time [m^5/J]; eps width of the
// smoothed delta [m]; kappa fracture resistance [J/m^3]; c_R Rayleigh wave speed [m/s].
#pragma once

namespace vdbfrac::grid {

/// One update with frozen energies.
struct GriffithStep {
    double kappa = 0;    ///< J/m^3
    double epsilon = 0;  ///< m
    double s = 0;        ///< mobility * time [m^5/J]: phi at 0 moves by s (Psi - kappa) / (pi epsilon)
    double maxMove = 0;  ///< m: phi rises by no more than this
};

/// The s [m^5/J] in which phi rises by `move` [m]; infinity where it does not rise.
double griffithTime(double phi, double psi, double move, const GriffithStep& step);

/// phi [m] after the step, by the exact integral: eps phi + phi^3 / (3 eps) grows by s (Psi - kappa) / pi.
/// Never below phi.
double griffithUpdate(double phi, double psi, const GriffithStep& step);

/// Rayleigh wave speed [m/s], c_s (.862 + 1.14 nu) / (1 + nu) (Freund 1990, section 2.1), c_s^2 = mu / rho.
double rayleighSpeed(double mu, double nu, double rho);

}  // namespace vdbfrac::grid
