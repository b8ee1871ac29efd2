// From what a scene says of fracture to what tears a body. Not installed.
//
//   l      averaging radius [m]                kappa  fracture resistance [J/m^3]       h  lattice spacing [m]
//   Gc     toughness [J/m^2]                   sigma_t  tensile strength [Pa]           E  Young's modulus [Pa]
//   A      averaged energy at a tip times l, over the G that the crack sets free: calibrated (docs/physics.md)
// One law with an average of `average` h: kappa = A Gc / l. Then
//   kappa                  l = average h: a smooth bar tears at sqrt(2 E kappa), and Gc = kappa l / A falls with h
//   toughness              l = average h: Gc is that of any h, and the strength rises as h falls; under the driver
//                          tension Psi is A G / l then, G the energy that a crack there would set free
//   toughness + strength   l = 2 A E Gc / sigma_t^2, kappa = sigma_t^2 / (2 E), where the lattice can carry that
// Without one, nodal energies are as they are, and kappa = .25 Gc / h under toughness alone.
#pragma once

#include <vdbfrac/scene/key.h>
#include <vdbfrac/scene/scene.h>
#include <vdbfrac/scene/values.h>
#include <vdbfrac/solver/material.h>

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace vdbfrac::effects {

/// Keys of [fracture], and what is wrong with their values; "" for nothing.
std::span<const scene::Key> fractureTable();
std::string checkFracture(const scene::Values& values);

/// [fracture] as far as the law goes.
struct FractureKeys {
    std::optional<double> kappa, toughness, strength;  ///< J/m^3, J/m^2, Pa
    double average = 0;                                ///< in lattice cells; 0: none
    bool isTension = true;                             ///< the driver
};

/// That of bodies of a material.
FractureKeys fractureKeys(const scene::Values& values, const std::string& material);

/// Notes on resistances that are of no body: a sentence each.
std::vector<std::string> unusedResistances(const scene::Values& values, const scene::Scene& scene);

/// What tears one body.
struct FractureLaw {
    double kappa = 0;        ///< J/m^3
    double radius = 0;       ///< m, of the average; 0: none
    double perRelease = 0;   ///< A / l [1/m], where Psi is that of G; else 0
    double leastFactor = 1;  ///< on kappa, anywhere in it (fracture_places.h)
};

/// `notes`: what the user should know of it, a sentence each.
FractureLaw fractureLaw(const FractureKeys& keys, const scene::Grid& grid, const std::string& body,
                        const solver::Material& material, std::vector<std::string>& notes);

/// A.
double tipFactor(bool isTension, scene::LatticeKind lattice, double nu);

}  // namespace vdbfrac::effects
