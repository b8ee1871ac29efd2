// What the folder of a run holds, by its manifest.
#pragma once

#include <nlohmann/json.hpp>

#include <filesystem>

namespace vdbfrac::cli {

struct RunInfo {
    nlohmann::ordered_json json;
    bool sound = true;  ///< no file is missing or damaged
};

/// Frames, files and fragments of a run. Files have to be there with the size they had; with `verify` also with their
/// checksum, and readable. Throws FileError without a manifest, InputError for what is none.
RunInfo runInfo(const std::filesystem::path& folder, bool verify);

}  // namespace vdbfrac::cli
