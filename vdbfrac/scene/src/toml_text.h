// Values as TOML text that reads back to the same bits.
#pragma once

#include "document.h"

#include <vdbfrac/scene/values.h>

#include <string>
#include <string_view>

namespace vdbfrac::scene {

std::string numberText(double number);

/// A basic string with everything escaped that must be.
std::string quotedText(std::string_view text);

/// A bare key where it can be, else a quoted one.
std::string keyText(std::string_view key);

/// A value as its key's type writes it.
std::string valueText(const Values::Value& value, Type type);

/// A parsed value for an error message: one line, shortened.
std::string describe(const Node& node);

}  // namespace vdbfrac::scene
