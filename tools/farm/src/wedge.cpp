#include <vdbfrac/farm/wedge.h>

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/lab/study/study_table.h>
#include <vdbfrac/lab/study/vary.h>
#include <vdbfrac/lab/study/wedge_table.h>
#include <vdbfrac/scene/reader.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace vdbfrac::farm {

namespace fs = std::filesystem;
namespace study = lab::study;

namespace {

using Json = nlohmann::ordered_json;
using study::Varied;

constexpr std::size_t kMaxRuns = 10000;

std::vector<Varied> variedBy(const study::WedgeSpec& spec)
{
    std::vector<Varied> all;
    for (const auto& v : spec.vary) {
        all.push_back({v.key, v.values});
        for (int n = 1; n <= v.count; ++n) all.back().values.push_back(std::to_string(n));
    }
    return all;
}

/// The values of each run.
std::vector<std::vector<std::string>> valuesOf(const std::vector<Varied>& varied, bool together,
                                               const std::string& place)
{
    const std::size_t count = varied[0].values.size();
    std::size_t all = together ? count : 1;
    for (const Varied& v : varied) {
        if (together && v.values.size() != count)
            throw InputError(
                {place, fmt::format("{} has {} values, and {} has {}", v.key, v.values.size(), varied[0].key, count),
                 "as many values of each key", "or combine = \"grid\": every value with every other"});
        if (!together) all *= std::min(v.values.size(), kMaxRuns + 1);
        if (all > kMaxRuns) throw InputError({place, "makes too many runs", fmt::format("at most {}", kMaxRuns), ""});
    }
    std::vector<std::vector<std::string>> runs(all);
    for (std::size_t r = 0; r < all; ++r) {
        std::size_t rest = r;
        for (std::size_t k = varied.size(); k-- > 0;) {
            const auto& values = varied[k].values;
            runs[r].insert(runs[r].begin(), values[together ? r : rest % values.size()]);
            rest /= values.size();
        }
    }
    return runs;
}

/// The scene of a run: what it would say without the wedge.
scene::Scene sceneOf(const std::string& text, const WedgeInput& input, const Wedge& wedge, const WedgeRun& run)
{
    std::vector<std::string> set = input.set;
    for (std::size_t k = 0; k < wedge.keys.size(); ++k) set.push_back(wedge.keys[k] + "=" + run.values[k]);
    scene::Scene scene = scene::parseScene(text, input.scene, study::vocabulary(), set);
    scene.notes.clear();
    return scene;
}

Json toJson(const Wedge& wedge)
{
    Json runs = Json::array();
    for (const WedgeRun& run : wedge.runs) runs.push_back({{"name", run.name}, {"values", run.values}});
    return {{"wedge", wedge.name}, {"keys", wedge.keys}, {"runs", runs}};
}

fs::path failureFile(const fs::path& folder, const WedgeRun& run) { return folder / "logs" / (run.name + ".failed"); }

std::string sceneText(const scene::Scene& scene) { return scene::writeScene(scene, study::vocabulary()); }

std::string nameOf(std::size_t number) { return fmt::format("{:04}", number); }

/// Takes runs that the folder has as they are named there, and numbers the others behind them. False where one of the
/// folder's is not planned, or would be simulated with another scene.
bool takeUp(const Wedge& there, const fs::path& folder, WedgePlan& plan)
{
    if (there.name != plan.wedge.name || there.keys != plan.wedge.keys) return false;
    WedgePlan all{{there.name, there.keys, there.runs}, {}};
    std::vector<bool> isThere(plan.scenes.size(), false);
    for (const WedgeRun& run : there.runs) {
        std::size_t k = 0;  // values may come twice
        while (k < isThere.size() && (isThere[k] || plan.wedge.runs[k].values != run.values)) ++k;
        if (k == isThere.size()) return false;
        const fs::path file = sceneFile(folder, run);
        if (!fs::exists(file) || readText(file) != sceneText(plan.scenes[k])) return false;
        isThere[k] = true;
        all.scenes.push_back(std::move(plan.scenes[k]));
    }
    for (std::size_t k = 0; k < isThere.size(); ++k) {
        if (isThere[k]) continue;
        all.wedge.runs.push_back({nameOf(all.wedge.runs.size()), plan.wedge.runs[k].values});
        all.scenes.push_back(std::move(plan.scenes[k]));
    }
    plan = std::move(all);
    return true;
}

/// Whether a folder holds nothing, or no more than a layout that was killed leaves: it is done anew.
bool isEmpty(const fs::path& folder)
{
    if (!fs::exists(folder)) return true;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        if (isTemporary(entry.path()) || (name == "logs" && fs::is_empty(entry.path()))) continue;
        if (name != "scenes") return false;
        for (const fs::directory_entry& scene : fs::directory_iterator(entry.path())) {
            const std::string number = scene.path().stem().string();
            const bool isScene = scene.path().extension() == ".toml" && !number.empty() &&
                                 number.find_first_not_of("0123456789") == std::string::npos;
            if (!isScene && !isTemporary(scene.path())) return false;
        }
    }
    return true;
}

/// How many runs of the plan the folder has already. Throws where it holds something else.
std::size_t runsThere(const fs::path& folder, WedgePlan& plan)
{
    if (isEmpty(folder)) return 0;
    if (!fs::exists(folder / "wedge.json"))
        throw InputError(
            {folder.string(), "is not empty and holds no wedge", "a new folder, or that of this wedge", ""});
    const Wedge there = readWedge(folder);
    if (!takeUp(there, folder, plan))
        throw InputError({folder.string(), "holds another wedge: other values, or another scene", "a new folder",
                          "values can be added to a wedge; it keeps its scene as it was when it was made"});
    return there.runs.size();
}

}  // namespace

WedgePlan planWedge(const WedgeInput& input)
{
    const std::string text = readText(input.scene);
    const scene::Scene base = scene::parseScene(text, input.scene, study::vocabulary(), input.set);
    std::vector<Varied> varied;
    for (const std::string& v : input.vary) varied.push_back(study::parseVary(v));
    bool together = input.together;
    if (const auto spec = study::wedgeOf(base); spec && varied.empty())
        varied = variedBy(*spec), together = spec->combine == "list";
    if (varied.empty())
        throw InputError({input.scene.string(), "nothing is varied", "a table [wedge] with [[wedge.vary]]",
                          "or --vary KEY=VALUE,VALUE,..."});
    WedgePlan plan;
    plan.wedge.name = base.name;
    for (const Varied& v : varied) {
        if (std::count(plan.wedge.keys.begin(), plan.wedge.keys.end(), v.key) > 0)
            throw InputError({input.scene.string(), v.key + " is varied twice", "all its values in one list", ""});
        plan.wedge.keys.push_back(v.key);
    }
    std::vector<InputError::Detail> complaints;
    for (auto& values : valuesOf(varied, together, input.scene.string())) {
        WedgeRun& run = plan.wedge.runs.emplace_back();
        run = {nameOf(plan.wedge.runs.size() - 1), std::move(values)};
        try {
            plan.scenes.push_back(sceneOf(text, input, plan.wedge, run));
        } catch (const InputError& e) {
            for (InputError::Detail d : e.details()) {
                d.place = "run " + run.name + ": " + d.place;
                complaints.push_back(d);
            }
        }
    }
    if (!complaints.empty()) throw InputError(complaints);
    return plan;
}

void layOut(WedgePlan& plan, const fs::path& folder)
{
    const std::size_t there = runsThere(folder, plan);
    if (there == plan.scenes.size()) return;
    for (const char* place : {"scenes", "logs"}) fs::create_directories(folder / place);
    removeTemporaries(folder / "scenes");  // elsewhere tasks may be writing
    for (std::size_t r = there; r < plan.scenes.size(); ++r)
        writeText(sceneFile(folder, plan.wedge.runs[r]), sceneText(plan.scenes[r]));
    writeText(folder / "wedge.json", toJson(plan.wedge).dump(1) + "\n");  // last: with it the wedge is whole
}

Wedge readWedge(const fs::path& folder)
{
    const fs::path file = folder / "wedge.json";
    Wedge wedge;
    try {
        const Json json = Json::parse(readText(file));
        wedge.name = json.at("wedge").get<std::string>();
        wedge.keys = json.at("keys").get<std::vector<std::string>>();
        for (const Json& run : json.at("runs")) {
            WedgeRun& r = wedge.runs.emplace_back();
            r = {run.at("name").get<std::string>(), run.at("values").get<std::vector<std::string>>()};
            if (r.values.size() != wedge.keys.size() || r.name.find_first_not_of("0123456789") != std::string::npos)
                throw InputError({file.string(), "run '" + r.name + "' does not fit the keys", "", ""});
        }
    } catch (const nlohmann::json::exception& e) {
        throw InputError({file.string(), std::string("is not the plan of a wedge: ") + e.what(), "",
                          "give the folder that 'vdbfrac wedge -o' wrote"});
    }
    return wedge;
}

fs::path sceneFile(const fs::path& folder, const WedgeRun& run) { return folder / "scenes" / (run.name + ".toml"); }
fs::path logFile(const fs::path& folder, const WedgeRun& run) { return folder / "logs" / (run.name + ".log"); }

void keepFailure(const fs::path& folder, const WedgeRun& run, int code)
{
    if (code != 0)
        writeText(failureFile(folder, run), std::to_string(code) + "\n");
    else if (std::error_code error; fs::remove(failureFile(folder, run), error), error)
        throw FileError(failureFile(folder, run).string(), "cannot be removed: " + error.message());
}

std::string statusOf(const fs::path& folder, const WedgeRun& run)
{
    std::string status = "waiting";
    if (const fs::path file = folder / run.name / "run.json"; fs::exists(file)) {
        const Json json = Json::parse(readText(file), nullptr, false);
        const Json found = json.is_object() ? json.value("status", Json()) : Json();
        status = found.is_string() ? found.get<std::string>() : "damaged";
    }
    if (isDone(status) || status == "stuck" || !fs::exists(failureFile(folder, run))) return status;
    const std::string code = readText(failureFile(folder, run));
    return "failed (" + code.substr(0, code.find('\n')) + ")";
}

bool isDone(const std::string& status) { return status.starts_with("done"); }

}  // namespace vdbfrac::farm
