// A key of the tables, in words.
#pragma once

#include <vdbfrac/scene/values.h>

#include <string>

namespace vdbfrac::scene {

/// What a key takes: "a number greater than 0 (m)".
std::string allowedText(const Key& key);

inline bool isRequired(const Key& key) { return key.defaultText == nullptr; }
inline bool hasDefault(const Key& key) { return key.defaultText != nullptr && *key.defaultText != '\0'; }

/// Inner tables are read by code of their own.
inline bool isPart(const Key& key) { return key.type >= Type::shape; }

}  // namespace vdbfrac::scene
