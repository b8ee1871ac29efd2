#include <vdbfrac/lab/study/oscillation.h>

#include <cmath>
#include <optional>
#include <numeric>
#include <vector>

namespace vdbfrac::lab::study {

namespace {

/// Times at which u crosses a level upward (sign 1) or downward (sign -1).
std::vector<double> crossings(const Samples& s, double level, double sign)
{
    std::vector<double> times;
    for (std::size_t i = 1; i < s.t.size(); ++i) {
        const double a = sign * (s.u[i - 1] - level), b = sign * (s.u[i] - level);
        if (a < 0 && b >= 0) times.push_back(s.t[i - 1] + (s.t[i] - s.t[i - 1]) * a / (a - b));
    }
    return times;
}

/// Mean over time between two times, by trapezoids.
double meanBetween(const Samples& s, double from, double to)
{
    double sum = 0, length = 0;
    for (std::size_t i = 1; i < s.t.size(); ++i) {
        if (s.t[i - 1] < from || s.t[i] > to) continue;
        const double dt = s.t[i] - s.t[i - 1];
        sum += .5 * dt * (s.u[i] + s.u[i - 1]), length += dt;
    }
    return length > 0 ? sum / length : s.u.front();
}

/// The level given, or the mean; a part of a swing at the end would shift it, so it is taken again over whole swings.
double levelOf(const Samples& s, std::optional<double> rest)
{
    if (rest) return *rest;
    const double mean = meanBetween(s, s.t.front(), s.t.back());
    const std::vector<double> up = crossings(s, mean, 1);
    return up.size() < 2 ? mean : meanBetween(s, up.front(), up.back());
}

struct Peak {
    double t, height;
};

/// Largest |u - level| between two crossings, at the top of a parabola through three samples. Swings that the ends of
/// the record cut off do not count, nor do ripples.
std::vector<Peak> peaks(const Samples& s, double level)
{
    std::vector<Peak> found;
    const auto side = [&](std::size_t i) { return s.u[i] < level ? -1. : 1.; };
    bool whole = false;  // a crossing came before
    std::optional<Peak> highest;
    for (std::size_t i = 1; i + 1 < s.t.size(); ++i) {
        if (side(i) != side(i - 1)) {
            if (whole && highest) found.push_back(*highest);
            whole = true;
            highest.reset();
        }
        const double sign = side(i);
        const double a = sign * (s.u[i - 1] - level), b = sign * (s.u[i] - level), c = sign * (s.u[i + 1] - level);
        if (!(b > a && b >= c && b > 0)) continue;
        const double left = s.t[i] - s.t[i - 1], right = s.t[i + 1] - s.t[i];
        const double slopeLeft = (b - a) / left, slopeRight = (c - b) / right;
        const double curvature = (slopeRight - slopeLeft) / (left + right);             // half the second derivative
        const double slope = (slopeLeft * right + slopeRight * left) / (left + right);  // at sample i
        const double shift = curvature < 0 ? -.5 * slope / curvature : 0;
        const Peak peak{s.t[i] + shift, b + .5 * slope * shift};
        if (!highest || peak.height > highest->height) highest = peak;
    }
    return found;
}

}  // namespace

std::optional<double> periodOf(const Samples& s, std::optional<double> rest)
{
    if (s.t.size() < 3) return {};
    const double level = levelOf(s, rest);
    double sum = 0;
    int directions = 0;
    for (const double sign : {1., -1.}) {
        const std::vector<double> times = crossings(s, level, sign);
        if (times.size() < 2) continue;
        sum += (times.back() - times.front()) / double(times.size() - 1);
        ++directions;
    }
    return directions > 0 ? std::optional(sum / directions) : std::nullopt;
}

std::optional<double> dampingOf(const Samples& s, std::optional<double> rest)
{
    if (s.t.size() < 3) return {};
    const std::vector<Peak> found = peaks(s, levelOf(s, rest));
    if (found.size() < 2) return {};
    double t = 0, y = 0, ty = 0, tt = 0;
    for (const Peak& p : found) t += p.t, y += std::log(p.height);
    t /= double(found.size()), y /= double(found.size());
    for (const Peak& p : found) ty += (p.t - t) * (std::log(p.height) - y), tt += (p.t - t) * (p.t - t);
    return -ty / tt;
}

}  // namespace vdbfrac::lab::study
