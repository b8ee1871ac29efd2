// study.svg: error over time and over work, both axes logarithmic.
#include <vdbfrac/lab/study/output.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace vdbfrac::lab::study {

namespace {

constexpr double kWidth = 1240, kPanelWidth = 500, kPanelHeight = 420, kTop = 84, kLine = 20;
constexpr double kPanelLeft[] = {84, 700};
constexpr const char* kInk = "#222222";
constexpr const char* kGrey = "#767676";

/// Colours that people of any colour vision tell apart (M. Okabe and K. Ito, 2008).
constexpr std::array kColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b8860b", "#56b4e9", "#000000"};

std::string escaped(const std::string& text)
{
    std::string out;
    for (const char c : text) {
        if (c == '&')
            out += "&amp;";
        else if (c == '<')
            out += "&lt;";
        else if (c == '>')
            out += "&gt;";
        else if (c == '"')
            out += "&quot;";
        else
            out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
    return out;
}

struct TextStyle {
    const char* anchor = "start";
    int size = 13;
    const char* colour = kInk;
    const char* more = "";
};

std::string textAt(double x, double y, const std::string& text, const TextStyle& style = {})
{
    return fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="{}" font-size="{}" fill="{}"{}>{}</text>)"
                       "\n",
                       x, y, style.anchor, style.size, style.colour, style.more, escaped(text));
}

std::string lineFrom(const std::array<double, 4>& ends, const std::string& style)
{
    return fmt::format(R"(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" {}/>)"
                       "\n",
                       ends[0], ends[1], ends[2], ends[3], style);
}

/// A logarithmic axis over whole decades, between two places of the picture.
class Axis {
public:
    Axis(const std::vector<double>& values, double from, double to) : from_(from), to_(to)
    {
        double least = INFINITY, most = 0;
        for (const double v : values) least = std::min(least, v), most = std::max(most, v);
        if (!(most > 0)) least = most = 1;
        low_ = int(std::floor(std::log10(least) + kSlack)), high_ = int(std::ceil(std::log10(most) - kSlack));
        if (high_ <= low_) high_ = low_ + 1;
    }

    double at(double value) const { return from_ + (to_ - from_) * (std::log10(value) - low_) / (high_ - low_); }

    double end() const { return to_; }

    struct Tick {
        double place;
        std::string label;  // empty for the fine ones
        bool decade;
    };
    std::vector<Tick> ticks() const
    {
        std::vector<Tick> all;
        for (int d = low_; d <= high_; ++d)
            for (int k = 1; k < 10 && (d < high_ || k == 1); ++k) {
                const double value = k * std::pow(10., d);
                const bool labelled = k == 1 || (high_ - low_ <= 2 && (k == 2 || k == 5));
                all.push_back({at(value), labelled ? label(value) : "", k == 1});
            }
        return all;
    }

private:
    static constexpr double kSlack = 1e-9;

    static std::string label(double v)
    {
        if (v >= 1e4) return fmt::format("{:.0e}", v);
        return v < 1e-3 ? fmt::format("{:.0e}", v) : fmt::format("{:g}", v);
    }

    double from_, to_;
    int low_ = 0, high_ = 1;
};

struct Point {
    std::size_t setting = 0;
    double x = 0, error = 0;  // error in %
    std::optional<Interval> spread = {};
    bool weak = false;
};

class Plot {
public:
    Plot(const Study& study, const Analysis& a) : study_(study), a_(a) {}

    std::string text() const
    {
        const std::string inside = panel(0, timePoints(),
                                         a_.base == 0 ? "time, relative to the first setting"
                                                      : "time, relative to the first setting that was solved") +
                                   panel(1, workPoints(), "work: tets evaluated and multiplied");
        double bottom = kTop + kPanelHeight + 84;
        std::string keys = legend(bottom);
        keys += failures(bottom);
        std::string t = fmt::format(
            R"(<svg xmlns="http://www.w3.org/2000/svg" width="{0:.0f}" height="{1:.0f}" viewBox="0 0 {0:.0f} {1:.0f}" )"
            R"(font-family="DejaVu Sans, Helvetica, Arial, sans-serif">)"
            "\n",
            kWidth, bottom);
        t += fmt::format(R"(<rect width="{:.0f}" height="{:.0f}" fill="#ffffff"/>)"
                         "\n",
                         kWidth, bottom);
        const std::string title = study_.name + ": error in '" + study_.spec.measures[a_.by].name + "' against cost";
        t += textAt(kPanelLeft[0], 34, title, {"start", 20, kInk, " font-weight=\"bold\""});
        t += textAt(kPanelLeft[0], 58, study_.spec.about, {"start", 14, kGrey});
        return t + inside + keys + "</svg>\n";
    }

private:
    /// Error of a setting [%]; 0 has no place on a logarithmic axis.
    std::optional<double> errorOf(std::size_t i) const
    {
        const Error& e = a_.errors[i][a_.by];
        return e.value && *e.value > 0 ? std::optional(100 * *e.value) : std::nullopt;
    }

    std::vector<Point> timePoints() const
    {
        std::vector<Point> points;
        for (std::size_t i = 0; i < study_.settings.size(); ++i)
            if (const auto e = errorOf(i); e && a_.cost[i])
                points.push_back({i, a_.cost[i]->median, *e, a_.cost[i], a_.errors[i][a_.by].weak});
        return points;
    }

    std::vector<Point> workPoints() const
    {
        std::vector<Point> points;
        for (std::size_t i = 0; i < study_.settings.size(); ++i)
            if (const auto e = errorOf(i); e && study_.result(study_.settings[i]).totalWork() > 0)
                points.push_back(
                    {i, double(study_.result(study_.settings[i]).totalWork()), *e, {}, a_.errors[i][a_.by].weak});
        return points;
    }

    std::string panel(std::size_t which, const std::vector<Point>& points, const std::string& title) const
    {
        const double left = kPanelLeft[which], right = left + kPanelWidth, bottom = kTop + kPanelHeight;
        std::vector<double> xs, ys;
        for (const Point& p : points) {
            xs.push_back(p.x), ys.push_back(p.error);
            if (p.spread) xs.insert(xs.end(), {p.spread->low, p.spread->high});
        }
        const Axis x(xs, left, right), y(ys, bottom, kTop);
        std::string t = grid(x, y, left);
        t += textAt(.5 * (left + right), bottom + 48, title, {"middle", 14});
        const double middle = kTop + .5 * kPanelHeight;
        const std::string upright = fmt::format(" transform=\"rotate(-90 {:.1f} {:.1f})\"", left - 56, middle);
        t += textAt(left - 56, middle, "error, %", {"middle", 14, kInk, upright.c_str()});
        if (points.empty())
            return t + textAt(.5 * (left + right), middle, which == 0 ? "not timed" : "nothing to show",
                              {"middle", 16, kGrey});
        return t + front(points, x, y) + curves(points, x, y);
    }

    static std::string grid(const Axis& x, const Axis& y, double left)
    {
        const double right = left + kPanelWidth, bottom = kTop + kPanelHeight;
        const auto style = [](bool decade) {
            return std::string("stroke=\"") + (decade ? "#c8c8c8" : "#ececec") + "\"";
        };
        std::string t;
        for (const bool decade : {false, true}) {
            for (const Axis::Tick& k : x.ticks())
                if (k.decade == decade) t += lineFrom({k.place, kTop, k.place, bottom}, style(decade));
            for (const Axis::Tick& k : y.ticks())
                if (k.decade == decade) t += lineFrom({left, k.place, right, k.place}, style(decade));
        }
        for (const Axis::Tick& k : x.ticks())
            if (!k.label.empty()) t += textAt(k.place, bottom + 20, k.label, {"middle"});
        for (const Axis::Tick& k : y.ticks())
            if (!k.label.empty()) t += textAt(left - 8, k.place + 4, k.label, {"end"});
        return t + fmt::format(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="none" stroke="{}"/>)"
                               "\n",
                               left, kTop, kPanelWidth, kPanelHeight, kInk);
    }

    std::string front(const std::vector<Point>& points, const Axis& x, const Axis& y) const
    {
        std::vector<double> cost, error;
        for (const Point& p : points) cost.push_back(a_.sound[p.setting] ? p.x : INFINITY), error.push_back(p.error);
        std::string path;
        for (const std::size_t i : paretoFront(cost, error))
            path += fmt::format("{:.1f},{:.1f} ", x.at(cost[i]), y.at(error[i]));
        return fmt::format(R"(<polyline class="front" points="{}" fill="none" stroke="#bdbdbd" stroke-width="7" )"
                           R"(stroke-linejoin="round" stroke-linecap="round" opacity="0.6"/>)"
                           "\n",
                           path);
    }

    std::string curves(const std::vector<Point>& points, const Axis& x, const Axis& y) const
    {
        std::string lines, marks;
        for (std::size_t s = 0; s < study_.spec.series.size(); ++s) {
            std::string path;
            for (const Point& p : points) {
                if (study_.settings[p.setting].series != s) continue;
                const double px = x.at(p.x), py = y.at(p.error);
                path += fmt::format("{:.1f},{:.1f} ", px, py);
                if (p.spread)
                    lines += lineFrom({x.at(p.spread->low), py, x.at(p.spread->high), py},
                                      fmt::format("stroke=\"{}\"", colour(s)));
                marks += marker(s, {px, py}, p.weak);
                marks += label(p, {px, py}, x);
            }
            lines += fmt::format(R"(<polyline points="{}" fill="none" stroke="{}" stroke-width="1.6"/>)"
                                 "\n",
                                 path, colour(s));
        }
        return lines + marks;
    }

    /// The value that is varied, beside its marker: on the right where there is room.
    std::string label(const Point& p, const std::array<double, 2>& at, const Axis& x) const
    {
        constexpr double kRoom = 60;
        const Setting& s = study_.settings[p.setting];
        const bool room = at[0] + kRoom < x.end();
        std::string value = study_.spec.series[s.series].values[s.level];
        std::erase(value, '"');
        return textAt(at[0] + (room ? 8 : -8), at[1] - 7, value, {room ? "start" : "end", 11, kGrey});
    }

    static const char* colour(std::size_t series) { return kColours[series % kColours.size()]; }

    /// Circle, square, diamond, triangle, upside down; hollow where the error is uncertain.
    static std::string marker(std::size_t series, const std::array<double, 2>& at, bool hollow)
    {
        const double x = at[0], y = at[1], r = 5.5;
        const std::string style = fmt::format(R"(fill="{}" stroke="{}" stroke-width="1.8")",
                                              hollow ? "#ffffff" : colour(series), colour(series));
        switch (series % 5) {
        case 0:
            return fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}" {}/>)"
                               "\n",
                               x, y, r, style);
        case 1:
            return polygon({{{x - .9 * r, y - .9 * r},
                             {x + .9 * r, y - .9 * r},
                             {x + .9 * r, y + .9 * r},
                             {x - .9 * r, y + .9 * r}}},
                           style);
        case 2: return polygon({{{x, y - 1.3 * r}, {x + 1.3 * r, y}, {x, y + 1.3 * r}, {x - 1.3 * r, y}}}, style);
        case 3: return polygon({{{x, y - 1.3 * r}, {x + 1.2 * r, y + r}, {x - 1.2 * r, y + r}}}, style);
        default: return polygon({{{x, y + 1.3 * r}, {x + 1.2 * r, y - r}, {x - 1.2 * r, y - r}}}, style);
        }
    }

    static std::string polygon(const std::vector<std::array<double, 2>>& corners, const std::string& style)
    {
        std::string points;
        for (const auto& c : corners) points += fmt::format("{:.1f},{:.1f} ", c[0], c[1]);
        return fmt::format(R"(<polygon points="{}" {}/>)"
                           "\n",
                           points, style);
    }

    /// Series with their markers, then what the signs mean; moves `y` below itself.
    std::string legend(double& y) const
    {
        std::string t;
        for (std::size_t s = 0; s < study_.spec.series.size(); ++s, y += kLine) {
            const Order& order = a_.orders[s][a_.by];
            t += marker(s, {kPanelLeft[0] + 6, y - 4}, false);
            const auto& series = study_.spec.series[s];
            std::string text = series.name.find(series.key) == 0 ? series.name : series.name + " (" + series.key + ")";
            const auto observed = order.own ? order.own : order.fit;
            if (observed) text += fmt::format(", observed order {:.2f}", *observed);
            if (observed && order.expected) text += fmt::format(", expected {:g}", *order.expected);
            t += textAt(kPanelLeft[0] + 22, y, text);
        }
        for (const std::string& line :
             {std::string("Hollow: less than ten times what is uncertain of the reference. ") +
                  "Broad grey line: no other setting is both cheaper and nearer.",
              "Reference: " + referenceText(study_, a_, a_.by) + "."}) {
            t += textAt(kPanelLeft[0], y, line, {"start", 12, kGrey});
            y += kLine;
        }
        return t;
    }

    std::string failures(double& y) const
    {
        std::string t;
        for (std::size_t i = 0; i < study_.settings.size(); ++i) {
            const std::string reason = reasonOf(study_, i);
            if (reason.empty()) continue;
            constexpr std::size_t kLongest = 150;
            std::string line =
                study_.spec.series[study_.settings[i].series].name + ", " + study_.settings[i].label + ": " + reason;
            if (line.size() > kLongest) line = line.substr(0, line.rfind(' ', kLongest)) + " ...";
            t += textAt(kPanelLeft[0], y, "Not shown: " + line, {"start", 12, "#a01010"});
            y += kLine;
        }
        return t;
    }

    const Study& study_;
    const Analysis& a_;
};

}  // namespace

std::string svgText(const Study& study, const Analysis& analysis) { return Plot(study, analysis).text(); }

}  // namespace vdbfrac::lab::study
