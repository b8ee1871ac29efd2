// What the folder of a run says of it: run.json, stats.csv, scene.toml.
#pragma once

#include <vdbfrac/base/error.h>

#include <nlohmann/json.hpp>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace vdbfrac::report {

using Json = nlohmann::ordered_json;

struct Record {
    std::filesystem::path folder;
    Json manifest;                                       ///< run.json
    std::string scene;                                   ///< scene.toml, empty where there is none
    std::map<std::string, std::vector<double>> columns;  ///< of stats.csv, a value a step; NaN where there is none

    bool has(const std::string& column) const { return columns.count(column) != 0; }
    const std::vector<double>& operator[](const std::string& column) const { return columns.at(column); }
    std::size_t steps() const { return columns.empty() ? 0 : columns.begin()->second.size(); }
    double sum(const std::string& column) const;  ///< 0 where there is no such column
    /// Names of the columns that begin and end so.
    std::vector<std::string> named(const std::string& begin, const std::string& end) const;
    /// Columns of the seconds that stages took.
    std::vector<std::string> stages() const;
};

/// The manifest of the run in a folder. Throws FileError where none is.
std::filesystem::path manifestIn(const std::filesystem::path& folder);
/// What to throw where that says something else than a run's.
InputError badManifest(const std::filesystem::path& folder, const Json::exception& e);

/// What it says, with all that any run's does. Throws InputError, FileError.
Json readManifest(const std::filesystem::path& folder);
/// Throws InputError, FileError. A run without steps has columns without values.
Record readRecord(const std::filesystem::path& folder);

/// What puts loads on material.
struct Loaded {
    std::string kind;     ///< "grip" or "collider"
    std::string name;     ///< as the scene has it
    std::string columns;  ///< what its columns begin with

    bool operator==(const Loaded&) const = default;
};
std::vector<Loaded> loadedOf(const Record& record);
/// In each step [N].
std::vector<double> loadOf(const Record& record, const Loaded& loaded);

/// What runs are told apart by, by name: frames, steps, time, fragments, peak loads and so on.
Json numbersOf(const Record& record);

}  // namespace vdbfrac::report
