// What was done and how long it took, stage by stage. Counts are exact and do not depend on the machine.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace vdbfrac {

/// Work of one stage: seconds, and named counts ("calls", "elements", "voxels", "bytes", ...).
struct StageWork {
    std::string name;
    double seconds = 0;
    std::map<std::string, std::int64_t> counts;
};

/// The stages of a run in the order in which they first worked. A stage that never ran is not there.
class Ledger {
public:
    /// Adds to a count of a stage; makes both on first use.
    void count(const std::string& stage, const std::string& what, std::int64_t amount);
    void addSeconds(const std::string& stage, double seconds);

    const std::vector<StageWork>& stages() const { return stages_; }
    /// 0 for a stage or count that never occurred.
    std::int64_t countOf(const std::string& stage, const std::string& what) const;
    double secondsOf(const std::string& stage) const;

    void clear() { stages_.clear(); }
    /// Adds everything of `other`, stage by stage.
    void add(const Ledger& other);

private:
    StageWork& stage(const std::string& name);
    const StageWork* find(const std::string& name) const;

    std::vector<StageWork> stages_;
};

/// Adds the time from its construction to its end to a stage, and one to its calls.
class StageTimer {
public:
    StageTimer(Ledger& ledger, std::string stage) : ledger_(ledger), stage_(std::move(stage)) {}
    ~StageTimer()
    {
        const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start_;
        ledger_.addSeconds(stage_, spent.count());
        ledger_.count(stage_, "calls", 1);
    }
    StageTimer(const StageTimer&) = delete;
    StageTimer& operator=(const StageTimer&) = delete;

private:
    Ledger& ledger_;
    std::string stage_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace vdbfrac
