// Everything that comes from outside, as functions of bytes: what the fuzz targets, the replay and the mutations share.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace vdbfrac::fuzz {

/// How a command ends with a file: done, or an error with the exit code of its type. Whatever else is thrown is a
/// defect and passes through.
enum class Ending { done, inputError, fileError, limitError };
inline constexpr const char* kEndingNames[] = {"done", "bad data", "damaged file", "limit"};

/// Bytes that a command may take, but for what the file itself fills. Enough for all sound files.
inline constexpr std::uint64_t kMemoryLimit = 200000000;

struct Kind {
    const char* name;                       ///< "scene", "obj", "stl", "ply", "off", "vdb", "checkpoint"
    const char* extension;                  ///< of such files, with its dot
    std::span<const char* const> commands;  ///< that take such a file, as they are called on the command line
    /// What those commands do, one after the other; an ending for each.
    std::vector<Ending> (*run)(std::string_view bytes);
    std::vector<std::string> (*soundFiles)();  ///< small valid ones, made here
};
const std::vector<Kind>& kinds();
/// Throws Error for a name that is none.
const Kind& kindOf(std::string_view name);

}  // namespace vdbfrac::fuzz
