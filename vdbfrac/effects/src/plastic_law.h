// From what a scene says of plasticity to how a body flows. Not installed.
#pragma once

#include <vdbfrac/scene/key.h>
#include <vdbfrac/scene/values.h>
#include <vdbfrac/solver/material.h>

#include <span>
#include <string>

namespace vdbfrac::effects {

/// Keys of [plasticity], and what is wrong with their values; "" for nothing.
std::span<const scene::Key> plasticityTable();
std::string checkPlasticity(const scene::Values& values);

/// How a body flows; symbols as in plasticity.cpp.
struct PlasticLaw {
    double yieldStress = 0, hardening = 0, relaxation = 0;  ///< s_y [Pa], H [Pa], T [s]
    double maxStretch = 0, fractureShare = 0;
    double mu = 0, K = 0;  ///< Pa

    /// y after a plastic strain of a.
    double yieldStrain(double a) const;
    /// What a bar stores where it yields then [J/m^3].
    double energyAtYield(double a) const;
    /// c in a step of dt [s].
    double share(double dt) const;
};

/// That of bodies of a material.
PlasticLaw plasticLaw(const scene::Values& values, const std::string& name, const solver::Material& material);

}  // namespace vdbfrac::effects
