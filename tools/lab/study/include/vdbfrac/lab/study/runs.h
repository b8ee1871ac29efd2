// Runs of a study in processes of their own, so that none can end the others.
#pragma once

#include <vdbfrac/lab/study/study.h>

#include <functional>

namespace vdbfrac::lab::study {

struct RunSettings {
    std::vector<std::string> command;  ///< this program and what makes the same study again; "--run K" comes behind
    std::filesystem::path folder;      ///< holds runs/
    int threads = 1;                   ///< in all
    bool threadsPerRun = false;        ///< one run at a time, on all threads; else side by side, one thread each
    std::function<void(const std::string& line)> say;
};

/// What came of the runs beside the results.
struct RunReport {
    int reused = 0;  ///< results that were there already
    int reusedRounds = 0;
    std::vector<std::string> differences;  ///< work or state that was not the same again: there should be none
    std::vector<std::string> untimed;      ///< runs that did not end when they were timed, and why
};

/// runs/FINGERPRINT.json, or with a round from 1 runs/FINGERPRINT.round-R.json: what --run writes. Studies of other
/// settings in the same folder find it too.
std::filesystem::path resultFile(const std::filesystem::path& folder, const Run& run, int round);

/// Fills in results and times: first every run once, then `rounds` times all that ended, one process at a time, in
/// turn. Results with the right fingerprint are reused; rounds only whole ones, of the same threads.
RunReport runAll(Study& study, const RunSettings& settings);

}  // namespace vdbfrac::lab::study
