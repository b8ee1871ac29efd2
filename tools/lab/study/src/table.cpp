// The table of a study, for people.
#include <vdbfrac/base/grouping.h>
#include <vdbfrac/lab/study/output.h>

#include <fmt/format.h>

#include <algorithm>

namespace vdbfrac::lab::study {

namespace {

constexpr int kNumber = 12;  // characters of a column

/// Characters on the screen, of UTF-8.
std::size_t lengthOf(const std::string& text)
{
    return std::size_t(
        std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

std::string percent(double error) { return fmt::format("{:.3g}", 100 * error); }

class Table {
public:
    Table(const Study& study, const Analysis& a) : study_(study), a_(a) { widths(); }

    std::string text() const
    {
        std::string t =
            fmt::format("study '{}'{}\n\n", study_.name, study_.spec.about.empty() ? "" : ": " + study_.spec.about);
        t += header();
        for (std::size_t i = 0; i < study_.settings.size(); ++i) {
            const Setting& s = study_.settings[i];
            if (s.level == 0) t += study_.spec.series[s.series].name + "\n";
            t += row(i);
        }
        return t + legend() + references() + choices() + orders() + refinements();
    }

private:
    void widths()
    {
        for (const Setting& s : study_.settings) label_ = std::max(label_, lengthOf(s.label) + 2);
        for (const auto& m : study_.spec.measures)
            columns_.push_back(std::max<std::size_t>(kNumber, lengthOf(m.name) + 4));
    }

    std::string left(const std::string& text) const
    {
        return text + std::string(label_ - std::min(label_, lengthOf(text)), ' ');
    }
    static std::string right(const std::string& text, std::size_t width)
    {
        return std::string(width - std::min(width, lengthOf(text)), ' ') + text;
    }
    bool timed() const
    {
        return std::any_of(a_.cost.begin(), a_.cost.end(), [](const auto& c) { return c.has_value(); });
    }

    std::string header() const
    {
        std::string t = left("");
        for (std::size_t m = 0; m < columns_.size(); ++m) t += right(study_.spec.measures[m].name + " %", columns_[m]);
        if (timed()) t += right("time", 9) + right("", 16);
        return t + right("work", 10) + right("MiB", 8) + "\n";
    }

    std::string errorText(std::size_t i, std::size_t m) const
    {
        const Result& r = study_.result(study_.settings[i]);
        const Error& e = a_.errors[i][m];
        if (e.value) return std::string(e.byChance ? "?" : "") + (e.weak ? "~" : "") + percent(*e.value);
        if (a_.references[m].run == study_.settings[i].run) return "ref";
        return m < r.values.size() && !r.values[m].has() ? "n/a" : "-";
    }

    std::string row(std::size_t i) const
    {
        const Result& r = study_.result(study_.settings[i]);
        const bool best = std::find(a_.front.begin(), a_.front.end(), i) != a_.front.end();
        std::string t = left((best ? "* " : "  ") + study_.settings[i].label);
        if (!r.failure.empty()) return t + "  failed: " + reasonOf(study_, i) + "\n";
        for (std::size_t m = 0; m < columns_.size(); ++m) t += right(errorText(i, m), columns_[m]);
        if (a_.cost[i]) {
            t += right(fmt::format("{:.3g}", a_.cost[i]->median), 9);
            t += right(
                a_.cost[i]->confidence > 0 ? fmt::format("[{:.3g}, {:.3g}]", a_.cost[i]->low, a_.cost[i]->high) : "",
                16);
        } else if (timed()) {
            t += right("-", 9) + right("", 16);
        }
        t += right(amountText(r.totalWork()), 10) + right(fmt::format("{:.0f}", double(r.peakBytes) / (1 << 20)), 8);
        if (const std::string reason = reasonOf(study_, i); !reason.empty()) t += "  ! " + reason;
        return t + "\n";
    }

    std::string legend() const
    {
        std::string t = fmt::format("\nerrors in %; * no other setting is both cheaper and nearer in '{}'",
                                    study_.spec.measures[a_.by].name);
        for (const auto& row : a_.errors)
            if (std::any_of(row.begin(), row.end(), [](const Error& e) { return e.weak; })) {
                t += "; ~ less than ten times what is uncertain of the reference";
                break;
            }
        const auto isByChance = [](const auto& row) { return std::ranges::any_of(row, &Error::byChance); };
        if (std::ranges::any_of(a_.errors, isByChance))
            t += "; ? near by chance: a finer setting of its series is farther off, and * and the choices below go by "
                 "that";
        t += "\nwork: tets evaluated and multiplied";
        if (const auto& base = a_.cost[a_.base]) {
            const std::vector<double> seconds = study_.runs[study_.settings[a_.base].run].timed();
            t += fmt::format("; time: relative to {} ({:.3g} s), median of rounds: {}", baseText(),
                             medianOf(seconds).median, seconds.size());
            if (base->confidence > 0) t += fmt::format(" [where it lies with {:.0f} %]", 100 * base->confidence);
        }
        for (const Spec::Series& series : study_.spec.series)
            if (saysWhatIsSimulated(series.key))
                t += fmt::format(
                    "\n{} says what is simulated, not how exactly: numbers of '{}' are differences, not "
                    "errors; 'vdbfrac wedge' compares such settings",
                    series.key, series.name);
        return t + "\n" + missingText();
    }

    static bool saysWhatIsSimulated(const std::string& key)
    {
        constexpr const char* kTables[] = {"body.", "material.", "grip.", "collider.", "gravity."};
        constexpr const char* kKeys[] = {"fracture.toughness", "fracture.kappa",        "fracture.strength",
                                         "fracture.scatter",   "fracture.scatter_size", "fracture.scatter_seed",
                                         "fracture.spots",     "fracture.front_speed",  "contact.friction"};
        return std::ranges::any_of(kTables, [&](const char* table) { return key.starts_with(table); }) ||
               std::ranges::any_of(kKeys, [&](const char* own) { return key == own; });
    }

    std::string baseText() const
    {
        return a_.base == 0 ? "the first setting"
                            : "the first setting that was solved, " + study_.settings[a_.base].label;
    }

    /// Why values are not there, each reason once.
    std::string missingText() const
    {
        std::vector<std::string> lines;
        for (const Setting& s : study_.settings)
            for (std::size_t m = 0; m < study_.result(s).values.size(); ++m)
                if (const Value& v = study_.result(s).values[m]; !v.has())
                    lines.push_back(fmt::format("n/a in '{}': {}\n", study_.spec.measures[m].name, v.missing));
        sortUnique(lines);
        return fmt::format("{}", fmt::join(lines, ""));
    }

    std::string references() const
    {
        std::string t = "\nreferences\n";
        for (std::size_t m = 0; m < columns_.size(); ++m)
            t += fmt::format("  {}: {}\n", study_.spec.measures[m].name, referenceText(study_, a_, m));
        return t;
    }

    std::string choices() const
    {
        std::string t = "\ncheapest setting\n";
        for (std::size_t m = 0; m < columns_.size(); ++m) {
            // With the bounds that share an answer.
            std::vector<std::pair<std::optional<std::size_t>, std::string>> lines;
            for (const double error : {.1, .05, .01}) {
                const auto best = cheapestFor(study_, a_, m, error);
                if (lines.empty() || lines.back().first != best) lines.push_back({best, ""});
                lines.back().second += fmt::format("{}{:.0f}", lines.back().second.empty() ? "" : ", ", 100 * error);
            }
            for (const auto& [best, bounds] : lines)
                t += fmt::format("  {} within {} %: {}\n", study_.spec.measures[m].name, bounds,
                                 best ? nameOf(*best) : "none of them");
        }
        return t;
    }

    std::string nameOf(std::size_t i) const
    {
        const Setting& s = study_.settings[i];
        return fmt::format("{}: {} ({})", study_.spec.series[s.series].name, s.label,
                           a_.cost[i] ? fmt::format("time {:.3g}", a_.cost[i]->median)
                                      : "work " + amountText(study_.result(s).totalWork()));
    }

    std::string orders() const
    {
        std::string t;
        const auto text = [](const std::optional<double>& p) {
            return p ? fmt::format("{:.2f}", *p) : std::string("-");
        };
        for (std::size_t s = 0; s < a_.orders.size(); ++s)
            for (std::size_t m = 0; m < columns_.size(); ++m) {
                const Order& o = a_.orders[s][m];
                if (!o.fit && !o.own) continue;
                t +=
                    fmt::format("  {}: {} {} by errors (finest pair {}), {} by differences", study_.spec.series[s].name,
                                study_.spec.measures[m].name, text(o.fit), text(o.last), text(o.own));
                if (const auto& expected = o.expected) t += fmt::format("; expected {:g}", *expected);
                t += "\n";
            }
        return t.empty() ? t : "\nobserved order of convergence\n" + t;
    }

    std::string refinements() const
    {
        std::string t;
        for (const Refinement& r : refinementsOfBase(study_, a_))
            t += fmt::format("  {}: {} -> {} %\n", study_.settings[r.finer].label, percent(r.before), percent(r.after));
        if (t.empty()) return t;
        return fmt::format("\n{}, refined by one key alone, in '{}'; the one that matters most first\n{}", baseText(),
                           study_.spec.measures[a_.by].name, t);
    }

    const Study& study_;
    const Analysis& a_;
    std::size_t label_ = 24;
    std::vector<std::size_t> columns_;
};

}  // namespace

std::string amountText(std::int64_t n)
{
    for (const auto& [size, unit] : {std::pair(1e9, " G"), std::pair(1e6, " M"), std::pair(1e3, " k")})
        if (double(n) >= 10 * size) return fmt::format("{:.4g}{}", double(n) / size, unit);
    return std::to_string(n);
}

std::string tableText(const Study& study, const Analysis& analysis) { return Table(study, analysis).text(); }

}  // namespace vdbfrac::lab::study
