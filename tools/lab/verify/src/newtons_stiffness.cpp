// Bars and beams that only deform: their stiffness and what they swing at.
#include "newtons.h"

#include <vdbfrac/solver/linear_solver.h>

#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>

namespace vdbfrac::lab::verify {

namespace {

constexpr double kSmall = 1e-3;  // m or rad: far below what would be nonlinear

struct Bar {
    const char* lattice;
    double nu;

    std::string name() const { return format("%s, nu = %g", lattice, nu); }
};
constexpr Bar kUsual = {"six", .3};
constexpr Bar kOthers[] = {{"six", .49}, {"five", .3}, {"five", .49}, {"delaunay", .3}, {"delaunay", .49}};

/// A way to load a bar of 1 m^2 along x by moving its right end, its left end the opposite way.
struct Load {
    const char *name, *move;      // keys of a pose, for the value kSmall / 2
    double (*stiffness)(double);  // of a metre, in closed form, for nu
    double ofFour, ofEight;       // largest error [%] of bars of 4 and 8 cells
};
const Load kLoads[] = {
    {"EA", "translate = [%.17g, 0, 0]", [](double) { return kYoungsModulus; }, 1, 1},
    {"EI", "rotate = [0, 0, %.17g]", [](double) { return kYoungsModulus / 12; }, 4, 1},
    {"GJ", "rotate = [%.17g, 0, 0]", [](double nu) { return .140577 * kYoungsModulus / (2 * (1 + nu)); }, 8, 2},
};

/// How much the ends of a bar give, per force or moment.
double compliance(const Load& load, const Bar& bar, int cells, const Vec3& center, double length)
{
    Specimen s;
    s.h = 1. / cells, s.nu = bar.nu, s.division.lattice = bar.lattice;
    s.shape = boxKeys({length + 4 * s.h, 1, 1}, center);
    const bool turns = load.move[0] == 'r';
    for (double side : {1., -1.}) {
        const Vec3 end = center + side * length / 2 * Vec3::UnitX();
        const double way = side * kSmall / 2 * (turns ? 180 / std::numbers::pi : 1);
        s.rest += grip(side > 0 ? "right" : "left", halfspace(side * Vec3::UnitX(), side * end.x()),
                       "keys = [{ time = 0 }, { time = 1, " + format(load.move, way) +
                           format(" }], pivot = [%.17g, %.17g, %.17g]", end.x(), end.y(), end.z()));
    }
    SceneRun run(s.text());
    run.toEnd();
    return kSmall * kSmall / (2 * run.steps.back().elasticEnergy);
}

/// Of the stiffness of a metre, relative. The difference of two lengths has no ends.
double stiffnessError(const Load& load, const Bar& bar, int cells, const Vec3& shift)
{
    const Vec3 center = shift / cells;
    const double ofMetre = 2 / (compliance(load, bar, cells, center, 4) - compliance(load, bar, cells, center, 2));
    return ofMetre / load.stiffness(bar.nu) - 1;
}

using Modes = std::vector<std::vector<Vec3>>;

double massProduct(std::span<const double> mass, const std::vector<Vec3>& a, const std::vector<Vec3>& b)
{
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += mass[i] * a[i].dot(b[i]);
    return sum;
}

void removeFrom(std::vector<Vec3>& u, const Modes& modes, std::span<const double> mass)
{
    for (const auto& mode : modes) {
        const double share = massProduct(mass, mode, u);
        for (std::size_t i = 0; i < u.size(); ++i) u[i] -= share * mode[i];
    }
}

/// Translations and turns, orthonormal by mass.
Modes rigidModes(std::span<const Vec3> x, std::span<const double> mass)
{
    Modes modes;
    for (int k = 0; k < 6; ++k) {
        std::vector<Vec3> mode;
        for (const Vec3& X : x) mode.push_back(k < 3 ? Vec3::Unit(k) : Vec3(Vec3::Unit(k - 3).cross(X)));
        removeFrom(mode, modes, mass);
        const double norm = std::sqrt(massProduct(mass, mode, mode));
        for (Vec3& m : mode) m /= norm;
        modes.push_back(std::move(mode));
    }
    return modes;
}

/// rad/s, of the first bending of a free beam, by inverse iteration.
double freeFrequency(int cells, const Vec3& shift)
{
    constexpr int kIterations = 8;
    constexpr double kMassFactor = .5;  // 1/s^2: keeps the system definite
    Specimen s;
    s.h = 1. / cells;
    s.shape = boxKeys({10, 1, 1}, shift / cells);
    const SceneRun run(s.text());
    const solver::ElasticOperator& elastic = run.simulation.elastic();
    const std::span<const Vec3> x = run.simulation.x();
    const auto mass = elastic.mass();
    const Modes rigid = rigidModes(x, mass);
    const std::vector<std::uint8_t> fixed(x.size(), 0);
    solver::Tangent tangent;
    elastic.evaluate(x, {}, &tangent);
    solver::LinearSolver linear(elastic, solver::LinearMethod::multigrid);
    std::vector<Vec3> u, load(x.size());
    for (const Vec3& X : x) u.push_back(X.x() * X.x() * Vec3::UnitY());
    double quotient = 0;
    for (int n = 0; n < kIterations; ++n) {
        removeFrom(u, rigid, mass);
        const double norm = std::sqrt(massProduct(mass, u, u));
        for (std::size_t i = 0; i < u.size(); ++i) u[i] /= norm, load[i] = mass[i] * u[i];
        quotient = elastic.multiply<Vec3>(tangent, u).energy;
        (void)linear.solve({elastic, tangent, kMassFactor, fixed}, load, u, {1e-5, 1000}, n > 0);
    }
    return std::sqrt(quotient);
}

const std::pair<Vec3, const char*> kPlaces[] = {{Vec3(0, 0, 0), "on"}, {Vec3(0, .2, .45), "off"}};

}  // namespace

Measurements barStiffness(Extent extent)
{
    constexpr double kOrder = 1.8, kRounding = .05;  // %: below this there is no order to see
    Measurements all;
    const auto name = [](const Load& load, const Bar& bar, const char* place, int cells) {
        return format("%s, %s, faces %s voxel planes, %d cells: error, %%", load.name, bar.name().c_str(), place,
                      cells);
    };
    for (const Load& load : kLoads)
        for (const auto& [shift, place] : kPlaces) {
            double coarse = NAN;
            for (int cells : {2, 4, 8, 16}) {
                if (extent == Extent::quick && (cells < 4 || cells > 8)) continue;
                const double error = 100 * stiffnessError(load, kUsual, cells, shift);
                if (std::isfinite(coarse))
                    all.push_back(within(name(load, kUsual, place, cells), error, 0,
                                         std::abs(coarse) / std::exp2(kOrder) + kRounding));
                coarse = error;
            }
        }
    if (extent == Extent::quick) return all;
    for (const Bar& bar : kOthers)
        for (const Load& load : kLoads)
            for (const auto& [shift, place] : kPlaces)
                for (int cells : {4, 8})
                    all.push_back(within(name(load, bar, place, cells), 100 * stiffnessError(load, bar, cells, shift),
                                         0, cells < 8 ? load.ofFour : load.ofEight));
    return all;
}

Measurements freeBeam(Extent extent)
{
    constexpr double kFrequency = 1.9791, kLimit = .03;  // rad/s
    Measurements all;
    for (int cells : {4, 8}) {
        if (cells < 8 && extent == Extent::quick) continue;
        for (const auto& [shift, place] : kPlaces)
            all.push_back(within(format("faces %s voxel planes, %d cells: rad/s", place, cells),
                                 freeFrequency(cells, shift), kFrequency, kLimit * kFrequency));
    }
    return all;
}

}  // namespace vdbfrac::lab::verify
