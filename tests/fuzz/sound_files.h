// Small valid files of every kind: where fuzzing and mutations start. Each list covers the ways a format can be
// written.
#pragma once

#include <vdbfrac/scene/values.h>

#include <span>
#include <string>
#include <vector>

namespace vdbfrac::fuzz {

/// Tables as effects bring them, with a key of every type. The real ones would link the whole program.
std::span<const scene::TableSpec> effectTables();
std::vector<std::string> soundScenes();
std::vector<std::string> soundObjs();
std::vector<std::string> soundStls();
std::vector<std::string> soundPlys();
std::vector<std::string> soundOffs();
std::vector<std::string> soundVdbs();
std::vector<std::string> soundCheckpoints();

}  // namespace vdbfrac::fuzz
