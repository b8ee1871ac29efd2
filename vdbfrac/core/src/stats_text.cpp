#include <vdbfrac/base/number_text.h>
#include <vdbfrac/core/run_folder.h>

#include <algorithm>
#include <charconv>
#include <set>

namespace vdbfrac::core {

namespace {

/// Shortest text that reads back as the same double.
std::string number(double v)
{
    char text[40];
    const auto end = std::to_chars(text, text + sizeof text, v).ptr;
    return std::string(text, end);
}

const char* word(Outcome outcome)
{
    switch (outcome) {
    case Outcome::converged: return "converged";
    case Outcome::cutback: return "cutback";
    case Outcome::capped: return "capped";
    }
    return "";
}

/// stage/count pairs that occur in any step, in a fixed order.
std::vector<std::pair<std::string, std::string>> countColumns(const std::vector<StepRecord>& steps)
{
    std::set<std::pair<std::string, std::string>> columns;
    for (const StepRecord& s : steps)
        for (const StageWork& stage : s.work.stages())
            for (const auto& [what, amount] : stage.counts) columns.insert({stage.name, what});
    return {columns.begin(), columns.end()};
}

/// Names that occur in one of the maps of steps.
std::set<std::string> namesIn(const std::vector<StepRecord>& steps, std::map<std::string, double> StepRecord::*map)
{
    std::set<std::string> names;
    for (const StepRecord& s : steps)
        for (const auto& [name, amount] : s.*map) names.insert(name);
    return names;
}

std::set<std::string> stageColumns(const std::vector<StepRecord>& steps)
{
    std::set<std::string> columns;
    for (const StepRecord& s : steps)
        for (const StageWork& stage : s.work.stages()) columns.insert(stage.name);
    return columns;
}

}  // namespace

double maxUnnamedShare(const std::vector<StepRecord>& steps)
{
    double most = 0;
    for (const StepRecord& s : steps) most = std::max(most, s.unnamedShare);
    return most;
}

std::string statsText(const std::vector<StepRecord>& steps, const scene::Scene& scene)
{
    const auto counts = countColumns(steps);
    const auto flows = namesIn(steps, &StepRecord::energyFlow), measured = namesIn(steps, &StepRecord::measured),
               stages = stageColumns(steps);
    std::string text =
        "step,time_s,dt_s,status,cutbacks,newton_iterations,linear_iterations,projections,residual,min_residual,"
        "kinetic_J,elastic_J,unnamed_share,"
        "volume_m3,fragments,nodes,tets";
    for (const scene::Grip& g : scene.grips)
        for (const char* axis : {"x", "y", "z"}) text += "," + csvCell("load_" + g.name + "_" + axis + "_N");
    for (const std::string& flow : flows) text += "," + csvCell(flow + "_J");
    for (const std::string& name : measured) text += "," + csvCell(name);
    for (const auto& [stage, what] : counts) text += "," + stage + "_" + what;
    for (const std::string& stage : stages) text += "," + stage + "_s";
    text += '\n';
    for (const StepRecord& s : steps) {
        text += std::to_string(s.step) + ',' + number(s.time) + ',' + number(s.dt) + ',' + word(s.outcome) + ',' +
                std::to_string(s.cutbacks) + ',' + std::to_string(s.newtonIterations) + ',' +
                std::to_string(s.linearIterations) + ',' + std::to_string(s.projections) + ',' + number(s.residual) +
                ',' + number(s.minResidual) + ',' + number(s.kineticEnergy) + ',' + number(s.elasticEnergy) + ',' +
                number(s.unnamedShare) + ',' + number(s.volume) + ',' + std::to_string(s.fragments) + ',' +
                std::to_string(s.nodes) + ',' + std::to_string(s.tets);
        for (const Vec3& load : s.gripLoad)
            text += ',' + number(load.x()) + ',' + number(load.y()) + ',' + number(load.z());
        for (const std::string& flow : flows) {
            const auto it = s.energyFlow.find(flow);
            text += ',' + number(it == s.energyFlow.end() ? 0 : it->second);
        }
        for (const std::string& name : measured) {
            const auto it = s.measured.find(name);
            text += ',' + (it == s.measured.end() ? "" : number(it->second));
        }
        for (const auto& [stage, what] : counts) text += ',' + std::to_string(s.work.countOf(stage, what));
        for (const std::string& stage : stages) text += ',' + number(s.work.secondsOf(stage));
        text += '\n';
    }
    return text;
}

}  // namespace vdbfrac::core
