// What has to hold in every step of every scene, whatever it is.
#pragma once

#include <string>

namespace vdbfrac::lab::verify {

/// What one scene did.
struct SceneOutcome {
    std::string broken;    ///< the first law that did not hold: step, law, numbers; empty when all did
    bool refused = false;  ///< an InputError before the first step: `broken` is empty, `refusal` says why
    std::string refusal;
    bool cutShort = false;  ///< took more work than a scene may; what was run counts
    int steps = 0, converged = 0, cutback = 0, capped = 0;
    /// Largest rise in a step, of the energy there was and the work done, and of what the laws allow.
    double solveGain = 0;                ///< elastic, kinetic and potential energy beyond the work of grips and forces
    double recutGain = 0;                ///< elastic energy when material went
    double startVolume = 0, volume = 0;  ///< m^3
    double seconds = 0;
};

/// Runs a scene (TOML text) to its end and checks after each step:
/// - positions, velocities, energies, loads and all that is reported are finite;
/// - energy: kinetic, elastic and potential energy together do not grow by more than the work of grips and forces, what
///   the Newton tolerance and rounding leave open, and the one gain that backward Euler allows (below). Capped steps
///   are let off;
/// - removing material takes kinetic energy away and no more elastic energy comes than mean dilatation had averaged
///   away;
/// - reported loads and elastic energy are those of the state;
/// - material does not grow, and fragments add up to it;
/// and at the end:
/// - what is drawn has no gaps, and no face that joins two fragments; at the start neither, and nothing torn if all is
///   one fragment;
/// - with `compareThreads`: the state has the same bits for one thread and for two, with nobody looking on.
///
/// Backward Euler dissipates if the energy lies above its tangent plane at the end of the step. Corotational energy is
/// not convex: material that is compressed and turns may gain E(x0) - E(x1) below that plane. This much is computed and
/// allowed. Throws nothing: what a scene throws is a broken law.
SceneOutcome runUnderLaws(const std::string& scene, bool compareThreads = false);

}  // namespace vdbfrac::lab::verify
