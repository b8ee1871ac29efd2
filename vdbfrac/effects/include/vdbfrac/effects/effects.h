// The effects a scene can ask for.
#pragma once

#include <vdbfrac/core/stages.h>
#include <vdbfrac/scene/key.h>
#include <vdbfrac/scene/scene.h>

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace vdbfrac::effects {

/// One effect: its scene table, and how to make it from the table's values.
struct EffectInfo {
    scene::TableSpec table;
    const char* stages;  ///< where it joins, in words, for the plan of a run
    std::unique_ptr<core::Effect> (*make)(const scene::Values& values, const scene::Scene& scene);
    bool tears = false;                    ///< can it take a body apart?
    std::vector<std::string> fields = {};  ///< that output.vdb can list: the names of its field sources
    /// Where its tables are the scene's own and `table` is but their name: does the scene have any?
    bool (*inScene)(const scene::Scene& scene) = nullptr;
    double bytesPerTet = 0;               ///< memory that it takes beside the rest, at the most
    const char* bodiesWithout = nullptr;  ///< note for a scene of several bodies that does not name it
};

/// All effects of this build, in the order in which they join. Empty in a build without effects.
std::span<const EffectInfo> effectList();

/// What scenes of this build can say: the tables of the effects, the fields of the core and of the effects.
scene::Vocabulary vocabulary();

/// Does the scene name an effect?
bool isNamed(const EffectInfo& effect, const scene::Scene& scene);

/// Does the scene name an effect that can take a body apart?
bool canTear(const scene::Scene& scene);

/// Memory that the effects of a scene take beside the rest, at the most, for each tet.
double bytesPerTet(const scene::Scene& scene);

/// What a scene should know of itself, and of effects that it does not name: sentences.
std::vector<std::string> notesOf(const scene::Scene& scene);

/// Makes the effects that the scene names, and no other.
std::vector<std::unique_ptr<core::Effect>> makeEffects(const scene::Scene& scene);

}  // namespace vdbfrac::effects
