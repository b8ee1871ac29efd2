// Notched beams: bent in three points, split along a groove.
#include "newtons.h"
#include "reference_values.h"

#include <algorithm>
#include <cmath>

namespace vdbfrac::lab::verify {

namespace {

/// Height W = 1 m, span 4 m, notch .3 m from below, .2 m thick.
struct BentBeam {
    static constexpr double kSpan = 4, kNotch = .3, kThick = .2;  // m
    static constexpr double kE = 1e7, kToughness = 200;           // Pa, J/m^2

    /// N: K^2 / E is the toughness (Srawley 1976: the stress intensity, right to .5 %).
    static double load()
    {
        const double a = kNotch, bracket = 1.99 - a * (1 - a) * (2.15 - 3.93 * a + 2.7 * a * a),
                     shape = 3 * std::sqrt(a) * bracket / (2 * (1 + 2 * a) * std::pow(1 - a, 1.5));
        return std::sqrt(kE * kToughness) * kThick / (kSpan * shape);
    }
};

/// N, the load under which it tears. Its ends are pushed up alike, its middle is held at the top: nothing is held back
/// along the beam.
double bendingLoad(const Division& division)
{
    constexpr int kFrames = 150;
    constexpr double kMost = 2;  // of the load of the reference
    Specimen s;
    s.h = 1. / division.cells, s.division = division, s.E = BentBeam::kE, s.nu = .3, s.frames = kFrames,
    s.substeps = "\"auto\"";
    const double tip = -.5 + BentBeam::kNotch, end = BentBeam::kSpan / 2;
    s.shape = boxKeys({BentBeam::kSpan + 4 * s.h, 1, BentBeam::kThick}, Vec3::Zero()) +
              cutKeys({.6 * s.dx(), 1, 1}, {0, tip - .5, 0});
    const auto patch = [&](double x, double y) {
        return format("box = { size = [%.17g, %.17g, 1], center = [%.17g, %.17g, 0] }", .5 * s.h, 2.5 * s.h, x, y);
    };
    s.rest = grip("middle", patch(0, .5 - s.h), "velocity = [0, 0, 0]");
    for (double side : {1., -1.})
        s.rest += grip(side > 0 ? "right" : "left", patch(side * end, 0),
                       format("force = [0, %.17g, 0], ramp = %d", kMost * BentBeam::load() / 2, kFrames));
    s.rest += slowToughness(BentBeam::kToughness);
    SceneRun run(s.text());
    const Crack crack(run.simulation);
    const double start = tip - s.dx() / 2;
    while (!run.atEnd()) {
        const double load = -run.step().gripLoad[0].y();
        // Past what it bears there is no equilibrium, and the crack runs.
        if (crack.tip(run.simulation, Vec3::UnitY(), start) > start + .25) return load;
    }
    return NAN;
}

/// Two arms .4 m high that a web joins, moved apart at x = 0 without turning.
struct DoubleCantilever {
    static constexpr double kArm = .4, kLength = 2.2, kSlit = .8;   // m
    static constexpr double kThick = .6, kWeb = .2, kGroove = .22;  // m, m, m high

    /// J/m^2, of a crack of 1 to 1.4 m; in between as a power of its length, right to 1 %.
    static double energyRelease(double opening, double a)
    {
        const double power = std::log(kArms14Release / kArms10Release) / std::log(1.4);
        return kArms10Release * std::pow(a, power) * kYoungsModulus * opening * opening;
    }
};

/// The specimen and its slit; grooves that are three planes of voxels high keep the crack in its plane.
std::string doubleCantileverKeys(double h)
{
    using D = DoubleCantilever;
    constexpr double kFar = 20;  // m
    std::string keys = boxKeys({D::kLength + 2 * h, 2 * D::kArm, D::kThick}, {D::kLength / 2 - h, 0, 0}) +
                       format("cut = [{ box = { size = [%.17g, %.17g, 1] } }", 2 * D::kSlit - h, .6 * h);
    for (double side : {1., -1.})
        keys += format(", { box = { size = [%g, %g, 1], center = [0, 0, %g] } }", kFar, D::kGroove,
                       side * (D::kWeb / 2 + .5));
    return keys + "]\n";
}

/// G / Gc of a crack that grows from 1 to 1.4 m as its arms open: mean over the way.
double splittingRelease(int armCells)
{
    using D = DoubleCantilever;
    constexpr Ramp kRamp{.3, 130};
    constexpr double kFrom = 1, kTo = 1.4;
    Specimen s;
    s.h = D::kArm / armCells, s.frames = int(kRamp.seconds), s.substeps = "\"auto\"";
    s.shape = doubleCantileverKeys(s.h);
    const double most = 2 * std::sqrt(kToughness / D::energyRelease(1, kTo));
    for (double side : {1., -1.})
        s.rest +=
            grip(side > 0 ? "top" : "bottom", format("box = { size = [2, 2, 2], center = [-1, %g, 0] }", 1.01 * side),
                 kRamp.keys({0, side * most / 2, 0}));
    s.rest += slowToughness();
    SceneRun run(s.text());
    const Crack crack(run.simulation);
    double tip = D::kSlit - s.h / 2, start = NAN, weighted = 0;
    while (!run.atEnd() && tip < kTo) {
        const double share = kRamp.share(run.step().time);
        const double now = D::kSlit - s.h / 2 + crack.meanLength(run.simulation);
        if (now >= kFrom && std::isnan(start))
            start = now;
        else if (now >= kFrom)
            weighted += (now - tip) * D::energyRelease(most * share, (now + tip) / 2);
        tip = now;
    }
    return tip < kTo ? NAN : weighted / (tip - start) / kToughness;
}

}  // namespace

Measurements threePointBend(Extent extent)
{
    constexpr double kLimit = .1;
    Measurements all;
    const auto add = [&](const Division& division) {
        all.push_back(
            within(division.name() + ": load, N", bendingLoad(division), BentBeam::load(), kLimit * BentBeam::load()));
    };
    add({10});
    if (extent == Extent::quick) return all;
    for (const Division& d : {Division{20}, {20, "five"}, {20, "six", 2}}) add(d);
    return all;
}

Measurements doubleCantilever(Extent extent)
{
    constexpr double kLimit = .1;
    Measurements all;
    for (int cells : {4, 8}) {
        if (cells > 4 && extent == Extent::quick) break;
        all.push_back(within(format("G / Gc, arms of %d cells", cells), splittingRelease(cells), 1, kLimit));
    }
    return all;
}

}  // namespace vdbfrac::lab::verify
