#include <vdbfrac/lab/study/plan.h>

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/hash.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/study/vary.h>
#include <vdbfrac/scene/reader.h>

#include <algorithm>
#include <map>

namespace vdbfrac::lab::study {

namespace fs = std::filesystem;

namespace {

std::string joined(const std::vector<std::string>& parts, const char* between)
{
    std::string text;
    for (const std::string& p : parts) text += (text.empty() ? "" : between) + p;
    return text;
}

std::string tomlText(const std::string& text) { return nlohmann::json(text).dump(); }  // its escapes are TOML's too

std::string seriesText(const Varied& v, const std::vector<std::string>& set)
{
    std::vector<std::string> quoted;
    for (const std::string& s : set) quoted.push_back(tomlText(s));
    const std::string name = set.empty() ? v.key : v.key + ", " + joined(set, ", ");
    return "{name=" + tomlText(name) + ",set=[" + joined(quoted, ",") + "],key=" + tomlText(v.key) + ",values=[" +
           joined(v.values, ",") + "]}";
}

/// study.series as --set would say it.
std::string seriesOverride(const PlanInput& input)
{
    std::vector<Varied> varied;
    for (const std::string& text : input.vary) varied.push_back(parseVary(text));
    std::vector<std::string> series;
    if (input.grid)
        for (const auto& set : combinations(std::span(varied).subspan(1))) series.push_back(seriesText(varied[0], set));
    else
        for (const Varied& v : varied) series.push_back(seriesText(v, {}));
    return "study.series=[" + joined(series, ",") + "]";
}

std::string measureText(const std::string& text)
{
    const std::size_t colon = text.find(':');
    std::string table = "{quantity=" + tomlText(text.substr(0, colon));
    for (const std::string& part :
         colon == std::string::npos ? std::vector<std::string>{} : split(text.substr(colon + 1), ',')) {
        const std::size_t equals = part.find('=');
        if (equals == std::string::npos)
            throw InputError({"--measure", "'" + part + "' in '" + text + "' sets nothing", "KEY=VALUE", ""});
        table += "," + part.substr(0, equals + 1) + quotedWord(part.substr(equals + 1));
    }
    return table + "}";
}

std::string measureOverride(const std::vector<std::string>& measures)
{
    std::vector<std::string> tables;
    for (const std::string& m : measures) tables.push_back(measureText(m));
    return "study.measure=[" + joined(tables, ",") + "]";
}

/// What says something of most scenes.
std::vector<Spec::Measure> usualMeasures(const scene::Scene& scene)
{
    std::vector<Spec::Measure> measures;
    const auto add = [&](const char* quantity) {
        measures.emplace_back();
        measures.back().name = measures.back().quantity = quantity;
    };
    if (!scene.grips.empty()) {
        add("load_peak");
        measures.back().grip = scene.grips[0].name;
    }
    add("energy_norm");
    add("volume");
    if (effects::canTear(scene)) add("onset"), add("fragments");
    return measures;
}

/// Of what a run depends on; frames are not written, so output does not count.
std::string fingerprintOf(scene::Scene scene, const Spec& study, std::uint64_t hash)
{
    scene.output = {};
    Spec measured;
    measured.measures = study.measures;
    for (Spec::Measure& m : measured.measures)
        m.exact.reset(), m.scale.reset(), m.order.reset(), m.source.clear(), m.name = m.quantity;
    scene.notes = {tableOf(measured)};
    const std::string text = scene::writeScene(scene, vocabulary());
    return hexadecimal(hashBytes(text.data(), text.size(), hash));
}

class Planner {
public:
    explicit Planner(const PlanInput& input) : input_(input), text_(readText(input.scene)) {}

    Study plan()
    {
        std::vector<std::string> set = input_.set;
        if (!input_.vary.empty()) set.push_back(seriesOverride(input_));
        if (!input_.measure.empty()) set.push_back(measureOverride(input_.measure));
        const scene::Scene scene = parseAsGiven(set);
        const std::optional<Spec> spec = specOf(scene);
        if (!spec || spec->series.empty())
            throw InputError({input_.scene.string(), "nothing is varied", "a table [study] with [[study.series]]",
                              "or --vary KEY=VALUE,VALUE,..."});
        study_.name = scene.name;
        study_.spec = *spec;
        if (study_.spec.measures.empty()) study_.spec.measures = usualMeasures(scene);
        for (std::size_t s = 0; s < study_.spec.series.size(); ++s) {
            for (std::size_t level = 0; level < study_.spec.series[s].values.size(); ++level) addSetting(s, level);
            requireScenes(s);
        }
        return std::move(study_);
    }

private:
    scene::Scene parse(const std::vector<std::string>& set) const
    {
        return scene::parseScene(text_, input_.scene, vocabulary(), set);
    }

    /// Errors name the options that were given, not what was made of them.
    scene::Scene parseAsGiven(const std::vector<std::string>& set) const
    try {
        return parse(set);
    } catch (const InputError& e) {
        std::vector<InputError::Detail> details = e.details();
        for (InputError::Detail& d : details) {
            if (d.place == "--set study.measure" && !input_.measure.empty()) d.place = "--measure";
            if (d.place == "--set study.series" && !input_.vary.empty()) d.place = "--vary";
        }
        throw InputError(details);
    }

    void addSetting(std::size_t s, std::size_t level)
    {
        const Spec::Series& series = study_.spec.series[s];
        Run run;
        run.set = series.set;
        run.set.push_back(series.key + "=" + series.values[level]);
        std::string label = series.key + " = " + series.values[level];
        for (const Spec::Tied& t : series.tied) {
            run.set.push_back(t.key + "=" + t.values[level]);
            label += ", " + t.key + " = " + t.values[level];
        }
        resolve(run);
        study_.settings.push_back({s, level, indexOf(std::move(run)), label});
    }

    /// A value may be refused where others are not; where all are, the key is mistaken. Of a series with other settings
    /// it may be these.
    void requireScenes(std::size_t s) const
    {
        if (!study_.spec.series[s].set.empty()) return;
        const Run* first = nullptr;
        for (const Setting& setting : study_.settings) {
            if (setting.series != s) continue;
            const Run& run = study_.runs[setting.run];
            if (run.scene) return;
            if (!first) first = &run;
        }
        if (first)
            throw InputError({input_.vary.empty() ? "study.series" : "--vary",
                              "no value of '" + study_.spec.series[s].key + "' makes a scene: " + first->result.failure,
                              "", ""});
    }

    /// Of the program and the files that bodies and colliders are read from.
    std::uint64_t hashOfInputs(const scene::Scene& scene)
    {
        std::uint64_t hash = hashBytes(input_.program.data(), input_.program.size());
        const auto add = [&](const fs::path& file) {
            const auto [known, isNew] = files_.try_emplace(file);
            if (isNew) known->second = hashFile(file);
            hash = hashBytes(&known->second, sizeof known->second, hash);
        };
        for (const scene::Body& body : scene.bodies)
            if (const fs::path* file = scene::fileOf(body.shape)) add(*file);
        for (const scene::Collider& collider : scene.colliders)
            if (const fs::path* file = scene::fileOf(collider.shape)) add(*file);
        return hash;
    }

    void resolve(Run& run)
    {
        std::vector<std::string> set = input_.set;
        set.insert(set.end(), run.set.begin(), run.set.end());
        try {
            run.scene = parse(set);
            run.scene->notes.clear();
            run.fingerprint = fingerprintOf(*run.scene, study_.spec, hashOfInputs(*run.scene));
        } catch (const Error& e) {
            run.scene.reset();
            const std::string refused = "refused " + joined(run.set, ", ");
            run.fingerprint = hexadecimal(hashBytes(refused.data(), refused.size()));
            run.result.failure = e.what();
        }
    }

    /// Of a run with the same scene; of this one, added, where there is none.
    std::size_t indexOf(Run&& run)
    {
        const auto same = std::find_if(study_.runs.begin(), study_.runs.end(),
                                       [&](const Run& r) { return r.fingerprint == run.fingerprint; });
        const std::size_t index = std::size_t(same - study_.runs.begin());
        if (same == study_.runs.end()) study_.runs.push_back(std::move(run));
        return index;
    }

    const PlanInput& input_;
    std::string text_;
    Study study_;
    std::map<fs::path, std::uint64_t> files_;  // hashes of those read
};

}  // namespace

Study makePlan(const PlanInput& input) { return Planner(input).plan(); }

}  // namespace vdbfrac::lab::study
