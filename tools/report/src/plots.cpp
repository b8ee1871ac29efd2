#include <vdbfrac/report/plots.h>

#include <vdbfrac/base/number_text.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::report {

namespace {

using Numbers = std::vector<double>;

constexpr std::size_t kPoints = 600;  // of a curve, about

/// As much of a number as a curve shows.
Json shown(double value)
{
    return std::isfinite(value) ? Json(numberFrom(fmt::format("{:.6g}", value)).value_or(value)) : Json(nullptr);
}

/// Of each stretch of a long curve: where it is lowest and where it is highest, so that no peak is lost. Steps without
/// a value count where there are no others.
std::vector<std::size_t> kept(const Numbers& y)
{
    std::vector<std::size_t> places;
    const std::size_t stretch = std::max<std::size_t>(1, 2 * y.size() / kPoints);
    for (std::size_t begin = 0; begin < y.size(); begin += stretch) {
        const auto from = y.begin() + std::ptrdiff_t(begin),
                   to = y.begin() + std::ptrdiff_t(std::min(begin + stretch, y.size()));
        const auto isLower = [](double a, double b) { return a < b || (std::isfinite(a) && !std::isfinite(b)); };
        const auto isHigher = [](double a, double b) { return a > b || (std::isfinite(a) && !std::isfinite(b)); };
        std::size_t low = std::size_t(std::min_element(from, to, isLower) - y.begin());
        std::size_t high = std::size_t(std::min_element(from, to, isHigher) - y.begin());
        if (low > high) std::swap(low, high);
        places.push_back(low);
        if (high != low) places.push_back(high);
    }
    if (!y.empty() && places.back() + 1 != y.size()) places.push_back(y.size() - 1);
    return places;
}

Json curve(const std::string& name, const Numbers& x, const Numbers& y)
{
    Json c = {{"name", name}, {"x", Json::array()}, {"y", Json::array()}};
    for (const std::size_t i : kept(y)) c["x"].push_back(shown(x[i])), c["y"].push_back(shown(y[i]));
    return c;
}

Numbers added(const Numbers& values)
{
    Numbers sums(values.size());
    double sum = 0;
    for (std::size_t i = 0; i < values.size(); ++i) sums[i] = sum += std::isfinite(values[i]) ? values[i] : 0;
    return sums;
}

/// The sum of several columns, added up over the steps.
Numbers addedColumns(const Record& record, const std::vector<std::string>& names)
{
    Numbers sum(record.steps(), 0);
    for (const std::string& name : names) {
        const Numbers one = added(record[name]);
        for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += one[i];
    }
    return sum;
}

class Plots {
public:
    explicit Plots(const Record& record) : record_(record), time_(record["time_s"]) {}

    Json all()
    {
        loads();
        energies();
        plot("Fragments", "", {"fragments"});
        plot("Material", "m³", {"volume_m3"});
        plot("Depth of contact", "m", {"contact_depth_m", "contact_self_depth_m", "collider_depth_m"});
        plot("Fragments asleep", "", {"asleep"});
        plot("Load factor of the next tear", "", {"fracture_load_factor"});
        plot("Length of a step", "s", {"dt_s"});
        plot("Newton iterations a step", "", {"newton_iterations"});
        plot("Linear iterations a step", "", {"linear_iterations"});
        plot("Energy without account, share of what was put in", "", {"unnamed_share"});
        stages();
        return std::move(plots_);
    }

private:
    void add(const std::string& title, const std::string& unit, Json series)
    {
        if (series.empty()) return;
        Json marks = Json::array();
        for (const Json& f : record_.manifest["fragments"])
            if (f.at("birth").get<double>() > 0)
                marks.push_back({{"x", f["birth"]}, {"label", "fragment " + std::to_string(f.at("id").get<int>())}});
        plots_.push_back({{"title", title}, {"unit", unit}, {"series", std::move(series)}, {"marks", marks}});
    }

    void plot(const std::string& title, const std::string& unit, const std::vector<std::string>& columns)
    {
        Json series = Json::array();
        for (const std::string& c : columns)
            if (record_.has(c)) series.push_back(curve(c, time_, record_[c]));
        add(title, unit, std::move(series));
    }

    void loads()
    {
        for (const char* kind : {"grip", "collider"}) {
            Json series = Json::array();
            for (const Loaded& loaded : loadedOf(record_))
                if (loaded.kind == kind) series.push_back(curve(loaded.name, time_, loadOf(record_, loaded)));
            add(std::string("Loads on ") + kind + "s", "N", std::move(series));
        }
    }

    void energies()
    {
        Json series = Json::array();
        series.push_back(curve("kinetic", time_, record_["kinetic_J"]));
        series.push_back(curve("elastic", time_, record_["elastic_J"]));
        const auto ofEffects = [&](const char* end) {
            std::vector<std::string> names = record_.named("", end);
            std::erase_if(names, [](const std::string& name) { return name.starts_with("work_"); });  // of grips
            return names;
        };
        std::vector<std::string> works = ofEffects("_work_J");
        for (const std::string& grip : record_.named("work_", "_J")) works.push_back(grip);
        series.push_back(curve("work put in", time_, addedColumns(record_, works)));
        if (const auto lost = ofEffects("_dissipated_J"); !lost.empty())
            series.push_back(curve("dissipated", time_, addedColumns(record_, lost)));
        if (record_.has("removed_J")) series.push_back(curve("taken by cracks", time_, added(record_["removed_J"])));
        if (record_.has("integrator_J"))
            series.push_back(curve("taken by the time step", time_, added(record_["integrator_J"])));
        add("Energies", "J", std::move(series));
    }

    void stages()
    {
        Json series = Json::array();
        for (const std::string& stage : record_.stages())
            series.push_back(curve(stage.substr(0, stage.size() - 2), time_, added(record_[stage])));
        add("Time spent in stages", "s", std::move(series));
    }

    const Record& record_;
    const Numbers& time_;
    Json plots_ = Json::array();
};

}  // namespace

Json plotsOf(const Record& record) { return record.steps() > 0 ? Plots(record).all() : Json::array(); }

Json comparedPlots(const std::vector<Record>& records, const std::vector<std::string>& names)
{
    Json plots = Json::array();
    const auto add = [&](const std::string& title, const std::string& unit, const auto& valuesOf) {
        Json series = Json::array();
        for (std::size_t i = 0; i < records.size(); ++i) {
            if (records[i].steps() == 0) continue;
            if (const Numbers y = valuesOf(records[i]); !y.empty())
                series.push_back(curve(names[i], records[i]["time_s"], y));
        }
        if (!series.empty()) plots.push_back({{"title", title}, {"unit", unit}, {"series", std::move(series)}});
    };
    const auto column = [](const char* name) {
        return [name](const Record& r) { return r.has(name) ? r[name] : Numbers{}; };
    };
    std::vector<Loaded> all;
    for (const Record& r : records)
        for (const Loaded& loaded : loadedOf(r))
            if (std::ranges::find(all, loaded) == all.end()) all.push_back(loaded);
    for (const Loaded& loaded : all)
        add("Load on " + loaded.name, "N",
            [&](const Record& r) { return r.has(loaded.columns + "_x_N") ? loadOf(r, loaded) : Numbers{}; });
    add("Elastic energy", "J", column("elastic_J"));
    add("Kinetic energy", "J", column("kinetic_J"));
    add("Fragments", "", column("fragments"));
    return plots;
}

}  // namespace vdbfrac::report
