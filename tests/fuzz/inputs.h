// Everything that comes from outside, as functions of bytes: what the fuzz targets, the replay and the mutations share.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace vdbfrac::fuzz {

/// How reading ended. Whatever else is thrown is a defect and passes through.
enum class Outcome { read, inputError, fileError, limitError };
inline constexpr const char* kOutcomeNames[] = {"read", "input error", "file error", "limit error"};

struct Kind {
    const char* name;  ///< "scene", "obj", "stl", "ply", "off", "vdb"; "checkpoint" joins them when there are checkpoints
    Outcome (*read)(std::string_view bytes);
    std::vector<std::string> (*soundFiles)();  ///< small valid ones, made here
};
const std::vector<Kind>& kinds();
/// Throws Error for a name that is none.
const Kind& kindOf(std::string_view name);

}  // namespace vdbfrac::fuzz
