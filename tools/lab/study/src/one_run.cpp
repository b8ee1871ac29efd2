#include <vdbfrac/lab/study/one_run.h>

#include "measures.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/hash.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/core/estimate.h>
#include <vdbfrac/core/version.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/machine/memory.h>
#include <vdbfrac/lab/scenes/patience.h>
#include <vdbfrac/lab/scenes/prepared_scene.h>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>

namespace vdbfrac::lab::study {

namespace {

/// A simulation with the effects of its scene and with witnesses.
class Watched {
public:
    Watched(const scene::Scene& scene, std::span<const Spec::Measure> measures, std::uint64_t memoryLimit)
    {
        for (const auto& m : measures) witnesses_.push_back(makeWitness(m, scene));
        core::requireMemory(core::estimateScene(scene, memoryLimit, effects::bytesPerTet(scene)), memoryLimit);
        run_.emplace(scene, memoryLimit);
        for (const auto& w : witnesses_) w->start(run_->simulation);
    }

    /// All frames, in the steps that 'vdbfrac sim' takes.
    void run()
    {
        while (!run_->atEnd()) step();
    }

    Result result() const
    {
        Result r;
        r.cappedSteps = capped_;
        r.stateHash = hexadecimal(run_->simulation.stateHash());
        for (const auto& w : witnesses_) r.values.push_back(w->end(run_->simulation, last_));
        r.work = counts();
        for (const StageWork& s : work_.stages()) r.stages.emplace_back(s.name, s.seconds);
        return r;
    }

private:
    void step()
    {
        last_ = run_->simulation.stepInFrame();
        work_.add(last_.work);
        capped_ += int(last_.outcome == core::Outcome::capped);
        for (const auto& w : witnesses_) w->step(run_->simulation, last_);
        if (!run_->atEnd() && patience_.isOver(last_, run_->simulation.framesDone()))
            throw LimitError(
                fmt::format("gets nowhere after {:.4g} s: too many steps were cut back or not solved", last_.time));
    }

    WorkCounts counts() const
    {
        std::int64_t voxels = 0;
        for (const StageWork& s : work_.stages())
            if (const auto it = s.counts.find("voxels"); it != s.counts.end()) voxels += it->second;
        const auto solve = [&](const char* what) {
            return std::pair<std::string, std::int64_t>(what, work_.countOf("solve", what));
        };
        return {{"steps", last_.step},
                solve("newton_iterations"),
                solve("linear_iterations"),
                solve("evaluated_tets"),
                solve("product_tets"),
                solve("robust_tets"),
                {"cut_cells", work_.countOf("cut", "cells")},
                {"voxels", voxels},
                {"nodes", std::int64_t(run_->simulation.x().size())},
                {"tets", run_->simulation.elastic().tetCount()}};
    }

    std::vector<std::unique_ptr<Witness>> witnesses_;
    std::optional<PreparedScene> run_;  // ends before what it was given
    core::StepRecord last_;
    Ledger work_;
    int capped_ = 0;
    Patience patience_;
};

Json toJson(const Value& v)
{
    if (!v.has()) return {{"missing", v.missing}};
    return v.numbers.size() == 1 ? Json(v.numbers[0]) : Json(v.numbers);
}

Value valueOf(const Json& json)
{
    if (json.is_object()) return {{}, json.at("missing").get<std::string>()};
    if (json.is_number()) return {{json.get<double>()}};
    return {json.get<std::vector<double>>()};
}

}  // namespace

std::int64_t Result::count(const std::string& what) const
{
    const auto it = std::find_if(work.begin(), work.end(), [&](const auto& c) { return c.first == what; });
    return it == work.end() ? 0 : it->second;
}

Result simulate(const scene::Scene& scene, std::span<const Spec::Measure> measures, std::uint64_t memoryLimit)
{
    const auto start = std::chrono::steady_clock::now();
    Watched run(scene, measures, memoryLimit);
    run.run();
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    Result result = run.result();
    result.seconds = spent.count();
    result.threads = threadCount();
    return result;
}

Json toJson(const Result& r)
{
    Json values = Json::array(), work = Json::object(), stages = Json::object();
    for (const Value& v : r.values) values.push_back(toJson(v));
    for (const auto& [what, n] : r.work) work[what] = n;
    for (const auto& [stage, seconds] : r.stages) stages[stage] = seconds;
    return {{"program", core::kCreator},
            {"fingerprint", r.fingerprint},
            {"status", r.failure.empty() ? "done" : "failed"},
            {"failure", r.failure},
            {"capped_steps", r.cappedSteps},
            {"state", r.stateHash},
            {"values", values},
            {"work", work},
            {"seconds", r.seconds},
            {"stage_seconds", stages},
            {"peak_bytes", r.peakBytes},
            {"threads", r.threads}};
}

Result resultOf(const Json& json)
{
    Result r;
    r.fingerprint = json.at("fingerprint").get<std::string>();
    r.failure = json.at("failure").get<std::string>();
    r.cappedSteps = json.at("capped_steps").get<int>();
    r.stateHash = json.at("state").get<std::string>();
    for (const Json& v : json.at("values")) r.values.push_back(valueOf(v));
    for (const auto& [what, n] : json.at("work").items()) r.work.emplace_back(what, n.get<std::int64_t>());
    r.seconds = json.at("seconds").get<double>();
    for (const auto& [stage, seconds] : json.at("stage_seconds").items())
        r.stages.emplace_back(stage, seconds.get<double>());
    r.peakBytes = json.at("peak_bytes").get<std::uint64_t>();
    r.threads = json.at("threads").get<int>();
    return r;
}

}  // namespace vdbfrac::lab::study
