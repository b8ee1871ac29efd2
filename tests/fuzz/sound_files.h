// Small valid files of every kind: where fuzzing and mutations start. Each list covers the ways a format can be
// written.
#pragma once

#include <vdbfrac/scene/key.h>

#include <string>
#include <vector>

namespace vdbfrac::fuzz {

/// What scenes can say in the programs, but one table with a key of every type instead of those of the effects.
scene::Vocabulary vocabulary();
std::vector<std::string> soundScenes();
std::vector<std::string> soundObjs();
std::vector<std::string> soundStls();
std::vector<std::string> soundPlys();
std::vector<std::string> soundOffs();
std::vector<std::string> soundVdbs();
std::vector<std::string> soundCheckpoints();

}  // namespace vdbfrac::fuzz
