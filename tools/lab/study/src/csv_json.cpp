// study.csv and study.json.
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/core/version.h>
#include <vdbfrac/lab/study/one_run.h>
#include <vdbfrac/lab/study/output.h>

#include <charconv>

namespace vdbfrac::lab::study {

namespace {

/// Shortest text that reads back as the same double.
std::string numberText(double v)
{
    char text[40];
    return {text, std::to_chars(text, text + sizeof text, v).ptr};
}

std::string optionalText(const std::optional<double>& v) { return v ? numberText(*v) : ""; }

std::string valueText(const Value& v)
{
    std::string text;
    for (const double x : v.numbers) text += (text.empty() ? "" : " ") + numberText(x);
    return text;
}

/// The counts that any run has; a run that failed has none.
WorkCounts countsOf(const Study& study)
{
    for (const Run& run : study.runs)
        if (!run.result.work.empty()) return run.result.work;
    return {};
}

std::string headerOf(const Study& study)
{
    std::string text = "series,setting,run,status";
    for (const auto& m : study.spec.measures)
        text += "," + csvCell(m.name) + "," + csvCell(m.name + "_error") + "," + csvCell(m.name + "_weak") + "," +
                csvCell(m.name + "_by_chance");
    text += ",time_ratio,time_ratio_low,time_ratio_high,seconds_median,peak_bytes,work";
    for (const auto& [what, n] : countsOf(study)) text += "," + what;
    return text + "\n";
}

std::string rowOf(const Study& study, const Analysis& a, std::size_t i)
{
    const Setting& s = study.settings[i];
    const Run& run = study.runs[s.run];
    const std::string reason = reasonOf(study, i);
    std::string text = csvCell(study.spec.series[s.series].name) + "," + csvCell(s.label) + "," +
                       std::to_string(s.run) + "," + csvCell(reason.empty() ? "done" : reason);
    for (std::size_t m = 0; m < study.spec.measures.size(); ++m) {
        const Error& e = a.errors[i][m];
        text += "," + (m < run.result.values.size() ? valueText(run.result.values[m]) : "") + "," +
                optionalText(e.value) + "," + (e.value ? e.weak ? "1" : "0" : "") + "," +
                (e.value ? e.byChance ? "1" : "0" : "");
    }
    if (const auto& c = a.cost[i])
        text += "," + numberText(c->median) + "," + numberText(c->low) + "," + numberText(c->high);
    else
        text += ",,,";
    text += "," + (run.timed().empty() ? "" : numberText(medianOf(run.timed()).median));
    text += "," + std::to_string(run.result.peakBytes) + "," + std::to_string(run.result.totalWork());
    for (const auto& [what, n] : countsOf(study)) text += "," + std::to_string(run.result.count(what));
    return text + "\n";
}

Json optionalJson(const std::optional<double>& v) { return v ? Json(*v) : Json(); }

Json runJson(const Run& run)
{
    Json json = toJson(run.result);
    json["set"] = run.set;
    json["round_seconds"] = run.seconds;
    return json;
}

Json settingJson(const Study& study, const Analysis& a, std::size_t i)
{
    const Setting& s = study.settings[i];
    Json errors = Json::array();
    const std::vector<Value>& values = study.result(s).values;
    for (std::size_t m = 0; m < a.errors[i].size(); ++m) {
        errors.push_back({{"error", optionalJson(a.errors[i][m].value)},
                          {"weak", a.errors[i][m].weak},
                          {"by_chance", a.errors[i][m].byChance}});
        if (m < values.size() && !values[m].has()) errors.back()["missing"] = values[m].missing;
    }
    Json json = {{"series", study.spec.series[s.series].name},
                 {"setting", s.label},
                 {"run", s.run},
                 {"sound", bool(a.sound[i])},
                 {"reason", reasonOf(study, i)},
                 {"h", optionalJson(a.h[i])},
                 {"errors", errors}};
    if (const auto& c = a.cost[i])
        json["time_ratio"] = {{"median", c->median}, {"low", c->low}, {"high", c->high}, {"confidence", c->confidence}};
    return json;
}

const char* kindName(Reference::Kind kind)
{
    switch (kind) {
    case Reference::Kind::exact: return "exact";
    case Reference::Kind::extrapolated: return "extrapolated";
    case Reference::Kind::finest: return "finest run";
    default: return "none";
    }
}

Json measureJson(const Study& study, const Analysis& a, std::size_t m)
{
    const Reference& r = a.references[m];
    Json json = {{"name", study.spec.measures[m].name},
                 {"quantity", study.spec.measures[m].quantity},
                 {"reference", kindName(r.kind)},
                 {"reference_value", r.value.numbers},
                 {"reference_uncertainty", r.uncertainty},
                 {"reference_text", referenceText(study, a, m)},
                 {"orders", Json::array()}};
    for (std::size_t s = 0; s < a.orders.size(); ++s)
        json["orders"].push_back({{"series", study.spec.series[s].name},
                                  {"fit", optionalJson(a.orders[s][m].fit)},
                                  {"finest_pair", optionalJson(a.orders[s][m].last)},
                                  {"differences", optionalJson(a.orders[s][m].own)},
                                  {"expected", optionalJson(a.orders[s][m].expected)}});
    for (const double error : {.1, .05, .01}) {
        const auto best = cheapestFor(study, a, m, error);
        json["cheapest"][numberText(error)] = best ? Json(*best) : Json();
    }
    return json;
}

}  // namespace

std::string csvText(const Study& study, const Analysis& analysis)
{
    std::string text = headerOf(study);
    for (std::size_t i = 0; i < study.settings.size(); ++i) text += rowOf(study, analysis, i);
    return text;
}

Json jsonOf(const Study& study, const Analysis& a, const Json& machine)
{
    Json json = {{"program", "vdbfrac"},      {"version", core::kVersion},   {"study", study.name},
                 {"about", study.spec.about}, {"rounds", study.spec.rounds}, {"machine", machine}};
    json["by"] = study.spec.measures[a.by].name;
    for (const char* list : {"measures", "settings", "runs", "refinements_of_the_first"}) json[list] = Json::array();
    for (std::size_t m = 0; m < study.spec.measures.size(); ++m) json["measures"].push_back(measureJson(study, a, m));
    for (std::size_t i = 0; i < study.settings.size(); ++i) json["settings"].push_back(settingJson(study, a, i));
    json["front"] = a.front;
    for (const Refinement& r : refinementsOfBase(study, a))
        json["refinements_of_the_first"].push_back({{"series", study.spec.series[r.series].name},
                                                    {"setting", r.finer},
                                                    {"before", r.before},
                                                    {"after", r.after}});
    for (const Run& run : study.runs) json["runs"].push_back(runJson(run));
    return json;
}

}  // namespace vdbfrac::lab::study
