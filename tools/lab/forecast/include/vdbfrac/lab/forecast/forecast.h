// What a run will take, from a short measurement on this machine.
//
// Two samples: a few steps of the scene itself say what a step and a frame cost at its size; all of it on voxels
// several times as wide, a pilot, says how many steps there will be and how they and the files change once it tears. A
// frame takes at least one step; those beyond it are bounded by voxels, so they grow as voxels get smaller.
#pragma once

#include <vdbfrac/core/estimate.h>
#include <vdbfrac/scene/scene.h>

#include <cstdint>

namespace vdbfrac::lab {

struct ForecastSettings {
    double seconds = 10;                            ///< that it may take, about
    std::uint64_t memoryLimit = ~std::uint64_t{0};  ///< bytes
    bool keepsCheckpoints = false;                  ///< all of them, not two
    int checkpointEvery = 1;                        ///< frames; 0: only at the start and at the end
    double wider = 0;  ///< voxels of the pilot over those of the scene; 0: as wide as the seconds ask for
};

struct Forecast {
    double steps = 0, seconds = 0;  ///< of the whole run
    double bytes = 0;               ///< of its files, on the disk
    double frameBytes = 0;          ///< of a frame, on average
    double checkpointBytes = 0;     ///< of all that are kept
    int measuredSteps = 0;          ///< of the scene itself; 0: it is too large, and its steps are those of the pilot
    double wider = 1;               ///< voxels of the pilot over those of the scene; 1: there was none
    double simulatedShare = 1;      ///< of the frames, in the pilot or, without one, in the scene
};

/// Throws what making the scene's bodies throws. `estimate`: of the scene.
Forecast forecast(const scene::Scene& scene, const core::SceneEstimate& estimate, const ForecastSettings& settings);

}  // namespace vdbfrac::lab
