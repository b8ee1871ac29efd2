// Notched plates and blocks: at which load they tear, and which way.
#include "newtons.h"
#include "reference_values.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/lab/machine/scratch.h>
#include <vdbfrac/lab/samples/slit_block.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vdbfrac::lab::verify {

namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A plate 1 m wide, 1.2 m between grips at x = -.6 and .6 of its own, .4 m thick, with a slit of .4 m in its top:
/// turned about its middle in the lattice.
struct TurnedPlate {
    Division division;
    double degrees = 0;
    Vec3 axis = Vec3::UnitZ();

    static constexpr double kBetween = 1.2, kThick = .4, kSlit = .4, kTip = .5 - kSlit;  // m

    double h() const { return 1. / division.cells; }
    SlitBlock block() const
    {
        constexpr double kWidth = 1.5;  // voxels: open however it is turned
        const Mat3 turn = Eigen::AngleAxisd(degrees * kDegree, axis).toRotationMatrix();
        return {kWidth * h() / division.coarsening, kSlit, turn, h() * Vec3(.13, -.21, .34),
                Vec3(kBetween + 4 * h(), 1, kThick)};
    }
    static double opening() { return std::sqrt(kToughness / (kPlateRelease * kYoungsModulus)); }  // m
    static double load() { return kPlateStiffness * kYoungsModulus * kThick * opening(); }        // N
    std::string name() const
    {
        return division.name() + format(", turned by %g about %s", degrees, axis.z() > 0 ? "z" : "y");
    }
};

struct Tearing {
    double peak = 0;     // N
    double slope = NAN;  // degrees
};

Tearing tear(const TurnedPlate& plate)
{
    constexpr Ramp kRamp{.4, 120};
    constexpr double kWay = .4, kMost = 2;  // m of crack to see; of the opening that tears it
    const SlitBlock block = plate.block();
    const ScratchFolder folder;
    writeText(folder.path() / "plate.obj", objText(block.mesh()));
    Specimen s;
    s.h = plate.h(), s.division = plate.division, s.frames = int(kRamp.seconds), s.substeps = "\"auto\"";
    s.shape = "shape = { mesh = \"" + (folder.path() / "plate.obj").string() + "\" }\n";
    const Vec3 pull = block.turn.col(0);
    for (double side : {1., -1.})
        s.rest += grip(side > 0 ? "right" : "left",
                       halfspace(side * pull, .5 * TurnedPlate::kBetween + side * pull.dot(block.at)),
                       kRamp.keys(side * kMost * TurnedPlate::opening() / 2 * pull));
    s.rest += slowToughness();
    SceneRun run(s.text());
    const Crack crack(run.simulation);
    const auto ahead = [&] {
        return crack.tip(run.simulation, -block.turn.col(1), -TurnedPlate::kTip) + block.turn.col(1).dot(block.at) +
               TurnedPlate::kTip;
    };
    Tearing tearing;
    while (!run.atEnd() && ahead() < kWay) tearing.peak = std::max(tearing.peak, run.step().gripLoad[0].dot(pull));
    if (ahead() < kWay) return {};
    std::vector<Eigen::Vector2d> way;  // x over -y
    for (const Vec3& X : crack.voxels(run.simulation)) {
        const Vec3 local = block.turn.transpose() * (X - block.at);
        way.emplace_back(-local.y(), local.x());
    }
    tearing.slope = std::atan(slopeOf(way)) / kDegree;
    return tearing;
}

void addPlates(Measurements& all, const std::vector<TurnedPlate>& plates)
{
    constexpr double kLoad = .07;
    std::vector<double> peaks;
    for (const TurnedPlate& plate : plates) {
        const Tearing tearing = tear(plate);
        all.push_back(
            within(plate.name() + ": peak load, N", tearing.peak, TurnedPlate::load(), kLoad * TurnedPlate::load()));
        all.push_back(within(plate.name() + ": slope, degrees", tearing.slope, 0, plate.division.cells < 40 ? 5 : 3));
        peaks.push_back(tearing.peak);
    }
    const auto [least, most] = std::minmax_element(peaks.begin(), peaks.end());
    all.push_back(
        atMost(plates[0].division.name() + ": largest over smallest peak load, less 1", *most / *least - 1, kLoad));
}

/// Degrees from the slit's direction towards y, of the way from its end to what tore, the farther the more weight;
/// shears the top forwards, where `way` is 1, or backwards.
double kinkUnder(double way, const Division& division)
{
    constexpr Ramp kRamp{.2, 120};
    constexpr double kMost = .1, kSee = .3;  // m
    Specimen s;
    s.h = 1. / division.cells, s.division = division, s.nu = .3, s.frames = int(kRamp.seconds), s.substeps = "\"auto\"";
    s.shape = boxKeys({1, 1 + 4 * s.h, .4}, Vec3::Zero()) + cutKeys({1, .6 * s.dx(), 1}, {-.5 - s.dx() / 2, 0, 0});
    for (double side : {1., -1.})
        s.rest += grip(side > 0 ? "top" : "bottom", halfspace(side * Vec3::UnitY(), .5),
                       kRamp.keys({side * way * kMost / 2, 0, 0}));
    s.rest += slowToughness();
    SceneRun run(s.text());
    const Crack crack(run.simulation);
    while (!run.atEnd()) {
        run.step();
        Vec3 sum = Vec3::Zero();
        double reach = 0;
        for (Vec3 X : crack.voxels(run.simulation)) {
            X.x() += s.dx() / 2, X.z() = 0;
            sum += X.norm() * X, reach = std::max(reach, X.norm());
        }
        if (reach >= kSee) return std::atan2(sum.y(), sum.x()) / kDegree;
    }
    return NAN;
}

}  // namespace

Measurements turnedPlate(Extent extent)
{
    Measurements all;
    addPlates(all, {{{10}}, {{10}, 30}, {{10}, -30}});
    if (extent == Extent::quick) return all;
    std::vector<TurnedPlate> plates;
    for (double degrees : {0., 15., 30., 45., 60., 75., 90., -30., -45.}) plates.push_back({{20}, degrees});
    for (double degrees : {30., 45.}) plates.push_back({{20}, degrees, Vec3::UnitY()});
    addPlates(all, plates);
    for (const Division& d : {Division{20, "five"}, {20, "delaunay"}, {20, "six", 2}})
        addPlates(all, {{d}, {d, 45}, {d, -45}});
    addPlates(all, {{{40}}, {{40}, 45}});
    return all;
}

Measurements shearKink(Extent extent)
{
    constexpr double kKink = 70.5, kLimit = 10;  // degrees
    Measurements all;
    for (int cells : {10, 20}) {
        if (cells > 10 && extent == Extent::quick) break;
        const Division division{cells};
        all.push_back(
            within(division.name() + ": kink, top forwards, degrees", kinkUnder(1, division), -kKink, kLimit));
        all.push_back(
            within(division.name() + ": kink, top backwards, degrees", kinkUnder(-1, division), kKink, kLimit));
    }
    return all;
}

/// The notched block of data/scenes/notched_block.toml.
Measurements symmetricBlock(Extent extent)
{
    constexpr double kLimit = .01;
    Measurements all;
    for (int cells : {10, 20}) {
        if (cells > 10 && extent == Extent::quick) break;
        Specimen s;
        s.h = 1. / cells, s.E = 1e6, s.nu = .3, s.frames = 95, s.fps = 24, s.substeps = "\"auto\"",
        s.solver = "newton_tolerance = 1e-3";
        s.shape = boxKeys({1, 1, 1}, Vec3::Zero()) +
                  "cut = [{ cylinder = { axis = \"z\", radius = 0.2, center = [0.5, 0, 0] } }]\n";
        for (double side : {1., -1.})
            s.rest += grip(side > 0 ? "top" : "bottom", halfspace(side * Vec3::UnitY(), .45),
                           format("velocity = [0, %g, 0]", .1 * side));
        s.rest += "[damping]\nstiffness = 0.002\n[fracture]\ntoughness = 2500\n";
        SceneRun run(s.text());
        while (!run.atEnd() && run.simulation.fragments() < 2) run.step();
        std::vector<double> volumes;
        for (const auto& f : run.simulation.bodies()[0].fragments.fragments()) volumes.push_back(f.restVolume);
        std::sort(volumes.rbegin(), volumes.rend());
        const bool isTorn = volumes.size() > 1 && volumes[1] > 0;
        all.push_back(atMost(format("%d cells: larger half over the other, less 1", cells),
                             isTorn ? volumes[0] / volumes[1] - 1 : NAN, kLimit));
    }
    return all;
}

}  // namespace vdbfrac::lab::verify
