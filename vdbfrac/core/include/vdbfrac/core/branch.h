// Branches: a run goes on from a checkpoint of another with other settings.
#pragma once

#include <vdbfrac/scene/changes.h>

#include <string>
#include <vector>

namespace vdbfrac::core {

struct Branch {
    std::vector<scene::Change> changes;
    bool isFiner = false;  ///< voxels half as wide
};

/// From the settings of a run (as writeScene writes them) to others. Throws InputError that names every key that has
/// to stay: what bodies are at rest, what grips hold, when frames are, the lattice unless it gets twice as fine.
Branch branchBetween(const std::string& before, const std::string& after);

/// A branch that a run took, as its manifest has it.
struct BranchRecord {
    int frame = 0, step = 0;  ///< the last ones before it
    std::string from;         ///< the folder of the other run; empty: the same
    std::vector<scene::Change> changes;
};

/// Does nothing change but what frames hold? Then what is simulated has the bits of the run.
bool isDrawnOtherwiseOnly(const Branch& branch);

/// Are the colliders others, or how what is in them is drawn?
bool hasOtherColliders(const Branch& branch);

/// "fracture.toughness = 50 (was 100)"; what is long is cut short.
std::string changeText(const scene::Change& change);

}  // namespace vdbfrac::core
