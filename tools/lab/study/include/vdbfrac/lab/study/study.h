// A study: a scene run over a set of settings, to show what accuracy costs.
//
// The words: a series varies one key, a setting is one value of it, a run is what is simulated. Settings that come to
// the same scene share a run. A measure is a number (or a list of numbers) taken of each run.
#pragma once

#include <vdbfrac/lab/study/study_table.h>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace vdbfrac::lab::study {

using Json = nlohmann::ordered_json;

/// What a measure says of a run.
struct Value {
    std::vector<double> numbers = {};  ///< one; for masses of fragments one each
    std::string missing = {};          ///< why there is none; empty when there is one

    bool has() const { return missing.empty(); }
    bool operator==(const Value&) const = default;
};

/// Counts of work that do not depend on the machine, in the order in which they are shown.
using WorkCounts = std::vector<std::pair<std::string, std::int64_t>>;

/// What a run left behind, in its file (runs.h).
struct Result {
    std::string fingerprint;  ///< of the scene, its input files, what is measured and the program
    std::string failure;      ///< why the run did not end; empty when it did
    int cappedSteps = 0;      ///< steps that did not converge
    std::string stateHash;
    std::vector<Value> values;  ///< one for each measure
    WorkCounts work;
    double seconds = 0;                                  ///< from the scene to its last step
    std::vector<std::pair<std::string, double>> stages;  ///< seconds of each
    std::uint64_t peakBytes = 0;
    int threads = 0;

    /// Ended, and every step is solved: what it says may be compared.
    bool sound() const { return failure.empty() && cappedSteps == 0; }
    std::int64_t count(const std::string& what) const;  ///< 0 for what is not there
    /// Evaluated tets and products of tets with the tangent: one number for all work.
    std::int64_t totalWork() const { return count("evaluated_tets") + count("product_tets"); }
};

struct Run {
    std::vector<std::string> set;       ///< what makes its scene, "key=value"
    std::string fingerprint;            ///< of what it depends on, as hexadecimal digits
    std::optional<scene::Scene> scene;  ///< none where it was refused; then result.failure says why
    Result result;
    std::vector<double> seconds;  ///< of each timing round; NaN: not timed in it

    std::vector<double> timed() const;  ///< seconds of the rounds in which it was
};

struct Setting {
    std::size_t series = 0, level = 0;  ///< level: which value of the series
    std::size_t run = 0;
    std::string label;  ///< "time.substeps = 4"
};

struct Study {
    std::string name;
    Spec spec;
    std::vector<Run> runs;
    std::vector<Setting> settings;  ///< series by series; the first that is solved is what costs are relative to

    const Result& result(const Setting& setting) const { return runs[setting.run].result; }
};

}  // namespace vdbfrac::lab::study
