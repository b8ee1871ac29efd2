#include <vdbfrac/lab/study/references.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

namespace vdbfrac::lab::study {

namespace {

constexpr double kMinOrder = 0.3, kMaxOrder = 8;  // beyond, three levels say nothing of a limit

/// The order p at which (h3^p - h2^p) / (h2^p - h1^p) is what the differences of the values are; rising in p, so halved
/// down to.
std::optional<double> orderOfDifferences(const Level& coarse, const Level& middle, const Level& fine)
{
    const double ratio = (coarse.value - middle.value) / (middle.value - fine.value);
    if (!(ratio > 0) || !std::isfinite(ratio)) return {};
    const auto excess = [&](double p) {
        return (std::pow(coarse.h, p) - std::pow(middle.h, p)) / (std::pow(middle.h, p) - std::pow(fine.h, p)) - ratio;
    };
    double low = kMinOrder, high = kMaxOrder;
    if (excess(low) > 0 || excess(high) < 0) return {};
    for (int i = 0; i < 60; ++i) (excess(.5 * (low + high)) < 0 ? low : high) = .5 * (low + high);
    return .5 * (low + high);
}

/// The limit from two levels at an order.
double limitAt(double order, const Level& middle, const Level& fine)
{
    return fine.value + (fine.value - middle.value) / (std::pow(middle.h / fine.h, order) - 1);
}

/// The limit from three levels, with how far it is from the finest value.
std::optional<Extrapolation> limitOf(const Level& coarse, const Level& middle, const Level& fine)
{
    const auto p = orderOfDifferences(coarse, middle, fine);
    if (!p) return {};
    const double limit = limitAt(*p, middle, fine);
    return Extrapolation{limit, *p, std::abs(limit - fine.value)};
}

}  // namespace

std::optional<Extrapolation> richardson(std::span<const Level> levels, std::optional<double> expected)
{
    constexpr double kMinShare = 0.05;  // so that the finest level is not weak where all levels follow one power
    const std::size_t n = levels.size();
    if (n < 3 ||
        std::abs(levels[n - 1].value - levels[n - 2].value) >= std::abs(levels[n - 2].value - levels[n - 3].value))
        return {};
    auto limit = limitOf(levels[n - 3], levels[n - 2], levels[n - 1]);
    if (!limit) return limit;
    const auto before = n < 4 ? std::nullopt : limitOf(levels[n - 4], levels[n - 3], levels[n - 2]);
    if (before) limit->uncertainty = std::max(kMinShare * limit->uncertainty, std::abs(limit->value - before->value));
    if (expected)
        limit->uncertainty =
            std::max(limit->uncertainty, std::abs(limit->value - limitAt(*expected, levels[n - 2], levels[n - 1])));
    return limit;
}

std::optional<double> orderOf(std::span<const Level> errors)
{
    if (errors.size() < 2) return {};
    double x = 0, y = 0, xy = 0, xx = 0;
    for (const Level& e : errors) x += std::log(e.h), y += std::log(e.value);
    x /= double(errors.size()), y /= double(errors.size());
    for (const Level& e : errors) {
        const double dx = std::log(e.h) - x;
        xy += dx * (std::log(e.value) - y), xx += dx * dx;
    }
    return xy / xx;
}

std::vector<std::size_t> paretoFront(std::span<const double> cost, std::span<const double> error)
{
    std::vector<std::size_t> order(cost.size()), front;
    std::iota(order.begin(), order.end(), std::size_t(0));
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return std::pair(cost[a], error[a]) < std::pair(cost[b], error[b]);
    });
    for (const std::size_t i : order)
        if (front.empty() || error[i] < error[front.back()]) front.push_back(i);
    return front;
}

Interval medianOf(std::vector<double> values)
{
    constexpr double kEnough = 0.9;
    std::sort(values.begin(), values.end());
    const std::size_t n = values.size();
    Interval best;
    best.median = .5 * (values[(n - 1) / 2] + values[n / 2]);
    double term = std::pow(.5, double(n)), outside = 0;  // of the binomial distribution: k of n below the median
    for (std::size_t k = 0; 2 * k < n; ++k) {
        outside += 2 * term;
        if (k > 0 && 1 - outside < kEnough) break;
        best.low = values[k], best.high = values[n - 1 - k], best.confidence = std::max(0., 1 - outside);
        term *= double(n - k) / double(k + 1);
    }
    return best;
}

double massDistance(std::span<const double> a, std::span<const double> b)
{
    const auto shares = [](std::span<const double> masses, std::size_t count) {
        std::vector<double> s(masses.begin(), masses.end());
        std::sort(s.rbegin(), s.rend());
        const double sum = std::accumulate(s.begin(), s.end(), 0.);
        for (double& x : s) x /= sum;
        s.resize(count);
        return s;
    };
    if (a.empty() != b.empty()) return 1;
    const std::size_t count = std::max(a.size(), b.size());
    const std::vector<double> p = shares(a, count), q = shares(b, count);
    double distance = 0;
    for (std::size_t i = 0; i < count; ++i) distance += .5 * std::abs(p[i] - q[i]);
    return distance;
}

}  // namespace vdbfrac::lab::study
