#include <vdbfrac/lab/study/analysis.h>

#include <vdbfrac/base/number_text.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

namespace vdbfrac::lab::study {

namespace {

constexpr double kWeak = 10;  // an error is only as good as the reference is better

std::optional<double> positiveNumberOf(const std::string& tomlText)
{
    const std::optional<double> value = numberFrom(tomlText);
    return value && std::isfinite(*value) && *value > 0 ? value : std::nullopt;
}

bool isMassList(const Study& study, std::size_t measure)
{
    return study.spec.measures[measure].quantity == "fragment_masses";
}

/// Quantities that are relative already and vanish in an exact solution.
bool vanishes(const std::string& quantity)
{
    return quantity == "energy_balance" || quantity == "momentum" || quantity == "angular_momentum";
}

/// Whether a run came apart as the reference did, where that is measured.
bool hasFragmentsOfReference(const Study& study, const Analysis& a, std::size_t setting)
{
    for (std::size_t m = 0; m < study.spec.measures.size(); ++m)
        if (study.spec.measures[m].quantity == "fragments" && a.errors[setting][m].value.value_or(0) != 0) return false;
    return true;
}

class Analyst {
public:
    Analyst(const Study& study, std::size_t by) : study_(study) { a_.by = by; }

    Analysis analyse()
    {
        const std::size_t settings = study_.settings.size(), measures = study_.spec.measures.size();
        for (std::size_t i = 0; i < settings; ++i) a_.sound.push_back(study_.result(study_.settings[i]).sound());
        while (a_.base + 1 < settings && !a_.sound[a_.base]) ++a_.base;
        findResolutions();
        for (std::size_t m = 0; m < measures; ++m) a_.references.push_back(referenceOf(m));
        for (std::size_t i = 0; i < settings; ++i) {
            a_.errors.emplace_back();
            for (std::size_t m = 0; m < measures; ++m) a_.errors.back().push_back(errorOf(i, m));
        }
        for (std::size_t m = 0; m < measures; ++m) findChances(m);
        for (std::size_t s = 0; s < study_.spec.series.size(); ++s) {
            a_.orders.emplace_back();
            for (std::size_t m = 0; m < measures; ++m) a_.orders.back().push_back(orderOfSeries(s, m));
        }
        for (std::size_t i = 0; i < settings; ++i) a_.cost.push_back(costOf(i));
        findFront();
        return std::move(a_);
    }

private:
    const Value* valueOf(std::size_t setting, std::size_t measure) const
    {
        const Result& r = study_.result(study_.settings[setting]);
        return a_.sound[setting] && measure < r.values.size() && r.values[measure].has() ? &r.values[measure] : nullptr;
    }

    std::vector<std::size_t> settingsOf(std::size_t series) const
    {
        std::vector<std::size_t> all;
        for (std::size_t i = 0; i < study_.settings.size(); ++i)
            if (study_.settings[i].series == series) all.push_back(i);
        return all;
    }

    /// h of each setting: the value where lower ones are finer, else its inverse. Where the scene does not say which,
    /// those are finer that take more work.
    void findResolutions()
    {
        a_.h.resize(study_.settings.size());
        for (std::size_t s = 0; s < study_.spec.series.size(); ++s) {
            const auto& series = study_.spec.series[s];
            const std::vector<std::size_t> all = settingsOf(s);
            const bool up = series.refines == "up" || (series.refines == "auto" && workRises(series, all));
            for (const std::size_t i : all)
                if (const auto v = positiveNumberOf(series.values[study_.settings[i].level]))
                    a_.h[i] = up ? 1 / *v : *v;
        }
    }

    bool workRises(const Spec::Series& series, const std::vector<std::size_t>& all) const
    {
        std::vector<std::pair<double, std::int64_t>> work;
        for (const std::size_t i : all)
            if (const auto v = positiveNumberOf(series.values[study_.settings[i].level]); v && a_.sound[i])
                work.emplace_back(*v, study_.result(study_.settings[i]).totalWork());
        std::sort(work.begin(), work.end());
        return !work.empty() && work.back().second > work.front().second;
    }

    /// Settings of a series that have a resolution, the finest last.
    std::vector<std::size_t> byResolution(std::size_t series) const
    {
        std::vector<std::size_t> all = settingsOf(series);
        std::erase_if(all, [&](std::size_t i) { return !a_.h[i]; });
        std::stable_sort(all.begin(), all.end(), [&](std::size_t a, std::size_t b) { return *a_.h[a] > *a_.h[b]; });
        return all;
    }

    /// The setting of most work that has a value.
    std::optional<std::size_t> finest(std::size_t measure) const
    {
        std::optional<std::size_t> best;
        for (std::size_t i = 0; i < study_.settings.size(); ++i)
            if (valueOf(i, measure) && (!best || work(i) > work(*best))) best = i;
        return best;
    }

    std::int64_t work(std::size_t setting) const { return study_.result(study_.settings[setting]).totalWork(); }

    Reference referenceOf(std::size_t m) const
    {
        const Spec::Measure& measure = study_.spec.measures[m];
        if (measure.exact || vanishes(measure.quantity)) return {Reference::Kind::exact, {{measure.exact.value_or(0)}}};
        const auto best = finest(m);
        if (!best) return {};
        if (!isMassList(study_, m))
            if (const auto series = surest(study_.settings[*best].series, m))
                return corrected(*extrapolated(*series, m), *series, m);
        return {Reference::Kind::finest, *valueOf(*best, m), 0, 0, {}, study_.settings[*best].run};
    }

    /// Of the series that vary the same keys as `like`, the one whose limit is the least uncertain.
    std::optional<std::size_t> surest(std::size_t like, std::size_t m) const
    {
        std::optional<std::size_t> best;
        std::set<std::string> keys;
        addKeys(keys, like);
        for (std::size_t s = 0; s < study_.spec.series.size(); ++s) {
            std::set<std::string> own;
            addKeys(own, s);
            const auto limit = own == keys ? extrapolated(s, m) : std::nullopt;
            if (limit && (!best || limit->uncertainty < extrapolated(*best, m)->uncertainty)) best = s;
        }
        return best;
    }

    /// The limit of one series still has the errors that others refine. So what those series would change of the run
    /// that they share with it is added: one series for each other key, as if errors added up.
    Reference corrected(const Extrapolation& limit, std::size_t main, std::size_t m) const
    {
        Reference r{Reference::Kind::extrapolated, {{limit.value}}, limit.uncertainty, limit.order, {main}};
        std::set<std::string> keys;
        addKeys(keys, main);
        for (std::size_t s = 0; s < study_.spec.series.size(); ++s) {
            const auto shared = sharedSetting(s, main);
            if (!shared || keys.count(study_.spec.series[s].key) || !valueOf(*shared, m)) continue;
            const auto other = extrapolated(s, m);
            if (!other) continue;
            r.value.numbers[0] += other->value - valueOf(*shared, m)->numbers[0];
            r.uncertainty += other->uncertainty;
            r.series.push_back(s);
            addKeys(keys, s);
        }
        return r;
    }

    void addKeys(std::set<std::string>& keys, std::size_t series) const
    {
        keys.insert(study_.spec.series[series].key);
        for (const auto& tied : study_.spec.series[series].tied) keys.insert(tied.key);
    }

    /// A setting of one series whose run is in the other, too.
    std::optional<std::size_t> sharedSetting(std::size_t series, std::size_t other) const
    {
        for (const std::size_t i : settingsOf(series))
            for (const std::size_t j : settingsOf(other))
                if (study_.settings[i].run == study_.settings[j].run) return i;
        return {};
    }

    /// Of the levels of a series down to the finest that has a value.
    std::optional<Extrapolation> extrapolated(std::size_t series, std::size_t m) const
    {
        std::vector<Level> levels;
        for (const std::size_t i : byResolution(series))
            if (const Value* v = valueOf(i, m); v && (levels.empty() || *a_.h[i] < levels.back().h))
                levels.push_back({*a_.h[i], v->numbers[0]});
        return richardson(levels, expectedOrder(series, m));
    }

    std::optional<double> expectedOrder(std::size_t series, std::size_t m) const
    {
        const auto& own = study_.spec.measures[m].order;
        const std::optional<double> order = own ? own : study_.spec.series[series].order;
        return order == 0. ? std::nullopt : order;
    }

    /// What an absolute error is divided by.
    double scaleOf(std::size_t m) const
    {
        const Spec::Measure& measure = study_.spec.measures[m];
        if (measure.scale) return *measure.scale;
        const Reference& r = a_.references[m];
        return r.value.numbers.empty() || r.value.numbers[0] == 0 ? 1 : std::abs(r.value.numbers[0]);
    }

    Error errorOf(std::size_t i, std::size_t m) const
    {
        const Reference& r = a_.references[m];
        const Value* v = valueOf(i, m);
        if (!v || r.kind == Reference::Kind::none || r.run == study_.settings[i].run) return {};
        if (isMassList(study_, m)) {
            const double error = massDistance(v->numbers, r.value.numbers);
            return {error, false, error};
        }
        const double off = std::abs(v->numbers[0] - r.value.numbers[0]);
        return {off / scaleOf(m), off < kWeak * r.uncertainty, (off + r.uncertainty) / scaleOf(m)};
    }

    /// Errors that change their sign on the way to the limit are small somewhere: whoever chooses by them is not safe.
    void findChances(std::size_t m)
    {
        constexpr double kMuch = 1.5;
        for (std::size_t s = 0; s < study_.spec.series.size(); ++s) {
            const std::vector<std::size_t> settings = byResolution(s);
            double most = 0;
            for (auto i = settings.rbegin(); i != settings.rend(); ++i) {
                Error& e = a_.errors[*i][m];
                if (!e.value) continue;
                e.ofFiner = most, e.byChance = most > kMuch * *e.value;
                most = std::max(most, *e.value);
            }
        }
    }

    Order orderOfSeries(std::size_t series, std::size_t m) const
    {
        constexpr double kRounding = 1e-9;  // errors of what holds but for rounding have no order
        std::vector<Level> errors;
        for (const std::size_t i : byResolution(series))
            if (const Error& e = a_.errors[i][m];
                e.value && *e.value > kRounding && !e.weak && (errors.empty() || *a_.h[i] < errors.back().h))
                errors.push_back({*a_.h[i], *e.value});
        Order order;
        if (errors.size() >= 2) order.fit = orderOf(errors), order.last = orderOf(std::span(errors).last(2));
        order.expected = expectedOrder(series, m);
        if (!isMassList(study_, m))
            if (const auto limit = extrapolated(series, m)) order.own = limit->order;
        return order;
    }

    /// Time relative to that of the base in the same round.
    std::optional<Interval> costOf(std::size_t i) const
    {
        const std::vector<double>& own = study_.runs[study_.settings[i].run].seconds;
        const std::vector<double>& base = study_.runs[study_.settings[a_.base].run].seconds;
        std::vector<double> ratios;  // of the rounds that timed both
        for (std::size_t r = 0; r < std::min(own.size(), base.size()); ++r)
            if (std::isfinite(own[r]) && std::isfinite(base[r])) ratios.push_back(own[r] / base[r]);
        return ratios.empty() ? std::nullopt : std::optional(medianOf(ratios));
    }

    void findFront()
    {
        std::vector<std::size_t> settings;
        std::vector<double> cost, error;
        for (std::size_t i = 0; i < study_.settings.size(); ++i) {
            const auto c = a_.costOf(study_, i);
            if (!c || !a_.errors[i][a_.by].value || !hasFragmentsOfReference(study_, a_, i)) continue;
            settings.push_back(i), cost.push_back(*c), error.push_back(a_.errors[i][a_.by].trusted());
        }
        for (const std::size_t i : paretoFront(cost, error)) a_.front.push_back(settings[i]);
    }

    const Study& study_;
    Analysis a_;
};

}  // namespace

std::optional<double> Analysis::costOf(const Study& study, std::size_t setting) const
{
    if (!sound[setting]) return {};
    if (cost[setting]) return cost[setting]->median;
    if (cost[base]) return {};
    return double(study.result(study.settings[setting]).totalWork());
}

std::vector<double> Run::timed() const
{
    std::vector<double> known;
    for (const double s : seconds)
        if (std::isfinite(s)) known.push_back(s);
    return known;
}

Analysis analyse(const Study& study, std::size_t by) { return Analyst(study, by).analyse(); }

std::optional<std::size_t> cheapestFor(const Study& study, const Analysis& a, std::size_t measure, double error)
{
    std::optional<std::size_t> best;
    for (std::size_t i = 0; i < study.settings.size(); ++i) {
        const auto cost = a.costOf(study, i);
        const Error& e = a.errors[i][measure];
        if (cost && e.value && std::max(e.atMost, e.ofFiner) <= error && hasFragmentsOfReference(study, a, i) &&
            (!best || *cost < *a.costOf(study, *best)))
            best = i;
    }
    return best;
}

std::vector<Refinement> refinementsOfBase(const Study& study, const Analysis& a)
{
    std::vector<Refinement> all;
    for (std::size_t s = 0; s < study.spec.series.size(); ++s) {
        if (!study.spec.series[s].tied.empty()) continue;  // more than one key changes
        std::optional<std::size_t> base, finer;
        for (std::size_t i = 0; i < study.settings.size(); ++i)
            if (study.settings[i].series == s && study.settings[i].run == study.settings[a.base].run && a.h[i])
                base = i;
        for (std::size_t i = 0; base && i < study.settings.size(); ++i)
            if (study.settings[i].series == s && a.h[i] && *a.h[i] < *a.h[*base] && (!finer || *a.h[i] > *a.h[*finer]))
                finer = i;
        if (!finer || !a.errors[*base][a.by].value || !a.errors[*finer][a.by].value) continue;
        all.push_back({s, *finer, *a.errors[*base][a.by].value, *a.errors[*finer][a.by].value});
    }
    std::stable_sort(all.begin(), all.end(), [](const Refinement& x, const Refinement& y) {
        return std::abs(x.after - x.before) > std::abs(y.after - y.before);
    });
    return all;
}

std::string reasonOf(const Study& study, std::size_t setting)
{
    const Result& r = study.result(study.settings[setting]);
    if (!r.failure.empty()) {
        std::string line;
        for (std::istringstream lines(r.failure); lines;)
            if (std::string part; std::getline(lines >> std::ws, part)) line += (line.empty() ? "" : "; ") + part;
        return line;
    }
    return r.cappedSteps > 0 ? fmt::format("{} of {} steps did not converge", r.cappedSteps, r.count("steps")) : "";
}

std::string referenceText(const Study& study, const Analysis& a, std::size_t m)
{
    const Spec::Measure& measure = study.spec.measures[m];
    const Reference& r = a.references[m];
    const std::string scale = measure.scale ? fmt::format(", errors relative to {:.6g}", *measure.scale) : "";
    switch (r.kind) {
    case Reference::Kind::none: return "none: no run has a value";
    case Reference::Kind::exact:
        return fmt::format("exact {:.8g}{}{}", r.value.numbers[0],
                           measure.source.empty() ? "" : " (" + measure.source + ")", scale);
    case Reference::Kind::extrapolated: {
        std::string names;
        for (const std::size_t s : r.series)
            names += (names.empty() ? "'" : " and '") + study.spec.series[s].name + "'";
        return fmt::format("extrapolated from {} to {:.8g} +- {:.2g}{}", names, r.value.numbers[0], r.uncertainty,
                           scale);
    }
    case Reference::Kind::finest: break;
    }
    const auto it =
        std::find_if(study.settings.begin(), study.settings.end(), [&](const Setting& s) { return s.run == *r.run; });
    const std::string value = r.value.numbers.size() == 1 ? fmt::format(" {:.8g}", r.value.numbers[0]) : "";
    return fmt::format("the run of most work,{} of {}: {}; how far it is off itself is not known{}", value,
                       study.spec.series[it->series].name, it->label, scale);
}

}  // namespace vdbfrac::lab::study
