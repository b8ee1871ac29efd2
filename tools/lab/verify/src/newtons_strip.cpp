// Strips between clamps: the energy ahead of a crack is known, whatever its length.
#include "newtons.h"
#include "reference_values.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/lab/verify/calibration.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace vdbfrac::lab::verify {

namespace {

constexpr double kWidth = .2, kSlit = .8;  // m; heights are 1 m

struct PoissonRatio {
    double nu, energy;  // w / (E e^2)
};
constexpr PoissonRatio kRatios[] = {{0, kStrip20Nu00}, {.3, kStrip20Nu30}, {.45, kStrip20Nu45}};

struct Strip {
    Division division;
    PoissonRatio ratio = kRatios[1];
    double width = kWidth, length = 2.8, slit = kSlit;  // m; slit 0: none
    bool between = false;                               // of two planes of voxels, not round one
    std::string law = slowToughness();

    double h() const { return 1. / division.cells; }
    double dx() const { return h() / division.coarsening; }
    /// m, of the grips at the toughness.
    double opening() const { return std::sqrt(kToughness / (ratio.energy * kYoungsModulus)); }
    double energyRelease(double opening) const { return ratio.energy * kYoungsModulus * opening * opening; }  // J/m^2

    /// m; a Delaunay mesh is whole across what is much narrower than its tets.
    double gap() const { return (between ? 1.2 : division.lattice == std::string("delaunay") ? 1.5 : .6) * dx(); }
    /// m, of a crack that is measured: many cells, as it goes on by cells, and leaves bridges that part later.
    double way() const { return std::max(1.4, 28 * h()); }
    Specimen specimen() const
    {
        Specimen s;
        s.h = h(), s.division = division, s.nu = ratio.nu;
        s.shape = boxKeys({length, 1 + 4 * h(), width}, {length / 2, 0, 0});
        // Its end is in the middle between voxels. 1 m more on the other side.
        if (slit > 0)
            s.shape += cutKeys({slit + 1 - dx() / 2, gap(), 1}, {(slit - 1 - dx() / 2) / 2, between ? dx() / 2 : 0, 0});
        return s;
    }
    std::string grips(double opening, const Ramp& ramp) const
    {
        const Vec3 way(0, opening / 2, 0);
        return grip("top", halfspace(Vec3::UnitY(), .5), ramp.keys(way)) +
               grip("bottom", halfspace(-Vec3::UnitY(), .5), ramp.keys(-way));
    }
    const char* place() const { return between ? ", slit between voxels" : ""; }
};

/// w / (E e^2) of a strip without ends: of the difference of two lengths.
double energyOf(Strip strip)
{
    constexpr double kOpening = 1e-3;
    std::array<double, 2> energy{};
    for (std::size_t i : {0, 1}) {
        strip.length = 2. + double(i), strip.slit = 0;
        Specimen s = strip.specimen();
        s.rest = strip.grips(kOpening, {1, 2});
        SceneRun run(s.text());
        run.toEnd();
        energy[i] = run.steps.back().elasticEnergy;
    }
    return (energy[1] - energy[0]) / (strip.width * kYoungsModulus * kOpening * kOpening);
}

/// What a crack takes on its way from .3 m ahead of its slit, in units of the toughness.
struct Run {
    double release = NAN;     // G of the strip, mean over the way
    double dissipated = NAN;  // per area
};

Run runThrough(Strip strip)
{
    constexpr Ramp kRamp{.45, 130};
    constexpr double kMost = 1.75;  // of the opening at the toughness
    strip.length = 2.1 + strip.way();
    Specimen s = strip.specimen();
    s.frames = int(kRamp.seconds), s.substeps = "\"auto\"";
    s.rest = strip.grips(kMost * strip.opening(), kRamp) + strip.law;
    SceneRun run(s.text());
    const Crack crack(run.simulation);
    const double from = strip.slit + .3, to = from + strip.way();
    double tip = strip.slit, weighted = 0, way = 0, work = 0;
    std::vector<Eigen::Vector2d> lost;  // J over m; a slope, as the crack goes on by cells, several at once
    while (!run.atEnd() && tip < to) {
        const core::StepRecord& step = run.step();
        work += workOf(step);
        const double now = strip.slit - strip.dx() / 2 + crack.meanLength(run.simulation), gone = now - tip;
        tip = now;
        if (gone <= 0 || now < from) continue;
        if (!lost.empty())
            way += gone, weighted += gone * strip.energyRelease(kMost * strip.opening() * kRamp.share(step.time));
        lost.emplace_back(now, work - step.elasticEnergy);
    }
    if (tip < to) return {};
    return {weighted / way / kToughness, slopeOf(lost) / (strip.width * kToughness)};
}

/// Speed [m/s] of the front where G is `load` times the toughness from the start. Nothing may tear before the load is
/// there and still.
double speedAt(double load, double frontCfl, const Strip& strip)
{
    constexpr double kLoaded = .1, kFree = .2, kEnd = .6, kFrame = .005;  // s
    Specimen s = strip.specimen();
    s.fps = 1 / kFrame, s.frames = int(kEnd / kFrame), s.solver = "newton_tolerance = 1e-3";
    s.substeps = format("\"auto\"\nfront_cfl = %g", frontCfl);
    const double way = strip.opening() * std::sqrt(load) / 2;
    for (double side : {1., -1.})
        s.rest += grip(side > 0 ? "top" : "bottom", halfspace(side * Vec3::UnitY(), .5),
                       format("keys = [{ time = 0 }, { time = %g, translate = [0, %.17g, 0] }]", kLoaded, side * way));
    s.rest +=
        toughness() + format("keys = [{ time = %g, scale = 100 }, { time = %g, scale = 1 }]\n", kFree - 1e-6, kFree);
    SceneRun run(s.text());
    const Crack crack(run.simulation);
    std::optional<std::pair<double, double>> start;  // s, m
    while (!run.atEnd()) {
        const core::StepRecord& step = run.step();
        const double tip = crack.tip(run.simulation, Vec3::UnitX(), 0);
        if (!start && tip >= strip.slit + .2) start = {step.time, tip};
        if (tip >= strip.slit + .7) return (tip - start->second) / (step.time - start->first);
    }
    return NAN;
}

void addRun(Measurements& all, const Strip& strip)
{
    const double limit = strip.division.cells < 20 ? .1 : .05;
    const Run run = runThrough(strip);
    const std::string name = strip.division.name() + strip.place() + ", " + at(strip.ratio.nu);
    all.push_back(within(name + "G / Gc", run.release, 1, limit));
    all.push_back(within(name + "dissipated / (area Gc)", run.dissipated, 1, limit));
}

}  // namespace

Measurements stripEnergy(Extent extent)
{
    constexpr double kLimit = .02;
    constexpr PoissonRatio kThin[] = {{.3, kStrip10Nu30}, {.45, kStrip10Nu45}};
    Measurements all;
    const auto add = [&](const Strip& strip) {
        all.push_back(within(format("B / H = %g, ", strip.width) + at(strip.ratio.nu) + strip.division.name(),
                             energyOf(strip), strip.ratio.energy, kLimit * strip.ratio.energy));
    };
    for (int cells : {10, 20}) {
        if (cells > 10 && extent == Extent::quick) break;
        for (const PoissonRatio& ratio : kRatios) add({{cells}, ratio});
        for (const PoissonRatio& ratio : kThin)  // two cells thick or more
            if (cells > 10) add({{cells}, ratio, kWidth / 2});
    }
    return all;
}

Measurements runningCrack(Extent extent)
{
    Measurements all;
    if (extent == Extent::quick) {
        for (const PoissonRatio& ratio : kRatios) addRun(all, {{10}, ratio});
        addRun(all, {{10, "five"}});
        return all;
    }
    for (int cells : {10, 20}) {
        for (const PoissonRatio& ratio : kRatios) addRun(all, {{cells}, ratio});
        Strip between{{cells}};
        between.between = true;
        addRun(all, between);
        for (const Division& d : {Division{cells, "five"}, {cells, "delaunay"}, {cells, "six", 2}}) addRun(all, {d});
    }
    addRun(all, {{40}});
    return all;
}

Measurements crackSpeed(Extent extent)
{
    constexpr double kSteps = .1, kRho = 1000;
    Measurements all;
    for (double load : {2., 3.}) {
        if (load > 2 && extent == Extent::quick) break;
        // So fine that the material ahead of the crack does not fail by itself; four cells thick.
        Strip strip{{load > 2 ? 40 : 30}, kRatios[0]};
        strip.width = 4 * strip.h(), strip.slit = .6, strip.length = 1.9;
        const double rayleigh = .862 * std::sqrt(kYoungsModulus / 2 / kRho);  // nu = 0
        const double coarse = speedAt(load, .5, strip), fine = speedAt(load, .25, strip);
        const std::string name = format("G = %g Gc, ", load) + strip.division.name();
        all.push_back(atMost(name + ": speed / c_R, front_cfl = .5", coarse / rayleigh, 1 - 1 / load));
        all.push_back(atMost(name + ": speed / c_R, front_cfl = .25", fine / rayleigh, 1 - 1 / load));
        all.push_back(within(name + ": speed at one over that at the other", coarse / fine, 1, kSteps));
    }
    return all;
}

Calibration calibrate(const CalibrationStrip& c)
{
    constexpr double kAverage = 3, kAbout = .36;  // lattice cells; A, so that the crack runs near the toughness
    const auto ratio = std::find_if(std::begin(kRatios), std::end(kRatios),
                                    [&](const PoissonRatio& r) { return r.nu == c.poissonRatio; });
    if (ratio == std::end(kRatios))
        throw InputError({"calibration", format("there is no strip for nu = %g", c.poissonRatio), "0, 0.3, 0.45", ""});
    Strip strip{{c.cells, c.lattice.c_str()}, *ratio};
    const double l = kAverage * strip.h(), kappa = kAbout * kToughness / l;
    strip.law = format("[fracture]\nkappa = %.17g\naverage = %g\ndriver = \"%s\"\nfront_speed = 100\n", kappa, kAverage,
                       c.driver.c_str());
    const Run run = runThrough(strip);
    return {kappa * l / (run.release * kToughness), kappa * l / (run.dissipated * kToughness)};
}

}  // namespace vdbfrac::lab::verify
