// Values as TOML text that reads back to the same bits.
#pragma once

#include "document.h"

#include <vdbfrac/scene/key.h>

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace vdbfrac::scene {

std::string numberText(double number);

/// A basic string with everything escaped that must be.
std::string quotedText(std::string_view text);

/// A bare key where it can be, else a quoted one.
std::string keyText(std::string_view key);

/// A value as its key's type writes it; `entries` describes those of a list of tables.
std::string valueText(const Values::Value& value, Type type, const TableSpec* entries = nullptr);

/// What of a table Values do not keep: TOML text of its parts, by key.
using PartTexts = std::map<std::string, std::string>;

/// "key = value" for each key that has one, but for those of tables with headers of their own.
std::vector<std::string> assignments(const TableSpec& spec, const Values& values, const PartTexts& parts = {});

/// "{ key = value, ... }"
std::string inlineTable(const TableSpec& spec, const Values& values, const PartTexts& parts = {});

/// A parsed value for an error message: one line, shortened.
std::string describe(const Node& node);

}  // namespace vdbfrac::scene
