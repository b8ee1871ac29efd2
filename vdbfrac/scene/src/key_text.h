// A key of the tables, in words.
#pragma once

#include <vdbfrac/scene/key.h>

#include <string>

namespace vdbfrac::scene {

/// What a key takes: "a number greater than 0 (m)".
std::string allowedText(const Key& key);

/// TOML text of the default, or "" where there is none.
std::string defaultTextOf(const Key& key);

/// Inner tables are read by code of their own.
inline bool isPart(const Key& key) { return key.type() >= Type::tables; }

}  // namespace vdbfrac::scene
