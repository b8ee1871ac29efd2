// Random scenes under the laws that hold for all of them: 'vdbfrac verify --random'.
#pragma once

#include <cstdint>
#include <string>

namespace vdbfrac::cli {

struct RandomOptions {
    int scenes = 0;
    std::uint64_t seed = 1;  ///< of the first; those of the others follow
    std::string keep;        ///< folder for scenes that break a law; empty: none
};
struct RandomOutput {
    std::string json;  ///< file; empty: none
    bool quiet = false;
};

/// Runs the scenes, prints what broke and a table. The exit code: kDone, or kNotConverged when a scene breaks a law.
int runRandom(const RandomOptions& options, const RandomOutput& output);

}  // namespace vdbfrac::cli
