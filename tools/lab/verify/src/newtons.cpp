#include "newtons.h"

#include <vdbfrac/lab/scenes/rod.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace vdbfrac::lab::verify {

namespace {

constexpr HardCase kNewtons[] = {
    {1, "strip_energy", "energy of a clamped strip", "locking; grips that hold too much or too little", stripEnergy,
     "plane strain of the cross-section by finite elements, tests/python/references.py"},
    {2, "running_crack", "a crack that runs through a clamped strip",
     "the toughness that is given is not the one that is honoured, and drifts with the resolution", runningCrack,
     "G = w H, w of strip_energy: exact far from the ends"},
    {3, "turned_plate", "a notched plate, turned in the lattice", "cracks follow the lattice instead of the load",
     turnedPlate, "plane finite elements, tests/python/references.py; the slope is 0 by symmetry"},
    {4, "three_point_bend", "a notched beam in three-point bending", "stiff elements bear more than the material",
     threePointBend, "Srawley 1976, plane stress"},
    {5, "double_cantilever", "a double cantilever with a groove",
     "the energy that a crack takes depends on where it is", doubleCantilever,
     "plane finite elements, tests/python/references.py"},
    {6, "shear_kink", "a notched square in shear, either way", "cracks run into what is compressed", shearKink,
     "Erdogan & Sih 1963: 70.5 degrees towards the tension"},
    {7, "crack_speed", "speed of a crack in a strip under more than it takes", "the time step sets the speed",
     crackSpeed, "Freund 1990: at most c_R (1 - Gc / G)"},
    {8, "bar_stiffness", "a square bar stretched, bent, twisted", "bending locks; edges are lost", barStiffness,
     "E a^2, E a^4 / 12, .140577 a^4 mu, by the difference of two lengths"},
    {9, "free_beam", "first frequency of a free beam", "edges that are lost take mass and stiffness along", freeBeam,
     "Timoshenko: 1.9791 rad/s for 10 x 1 x 1 m, E = 1e6, nu = 0, rho = 1000"},
    {10, "rest_volume", "volume of solids at rest", "edges and rims are rounded off", restVolume, "closed forms"},
    {11, "slits", "meshes with narrow slits", "slits are filled without a word", slits,
     "the distance to the solid, in closed form"},
    {12, "smooth_bar", "a smooth bar under `strength`", "a strength that depends on the grid", smoothBar,
     "the strength that is given"},
    {13, "ledger", "work put in, and where it went", "energy that no account names", energyLedger,
     "conservation of energy"},
    {14, "symmetric_block", "a symmetric block torn in two", "halves that differ", symmetricBlock, "symmetry"},
};

}  // namespace

std::span<const HardCase> newtonCases() { return kNewtons; }

std::string Division::name() const
{
    const std::string coarse = coarsening > 1 ? format(", coarsening %d", coarsening) : "";
    return format("%s%s, %d cells", lattice, coarse, cells);
}

std::string Specimen::text() const
{
    return format("version = 1\nname = \"newtons\"\n[time]\nframes = [1, %d]\nfps = %.17g\nsubsteps = %s\n", frames + 1,
                  fps, substeps) +
           format("[grid]\nvoxel_size = %.17g\nlattice = \"%s\"\ncoarsening = %d\n[solver]\n%s\n", dx(),
                  division.lattice, division.coarsening, solver) +
           format("[[body]]\nname = \"body\"\nmaterial = \"m\"\n%s\n[material.m]\nyoungs_modulus = %.17g\n", shape, E) +
           format("poisson_ratio = %.17g\ndensity = %.17g\n", nu, rho) + rest;
}

namespace {

std::string exact(const Vec3& v) { return format("[%.17g, %.17g, %.17g]", v.x(), v.y(), v.z()); }

}  // namespace

std::string toughness(double value) { return format("[fracture]\ntoughness = %g\n", value); }

std::string slowToughness(double value) { return toughness(value) + "front_speed = 100\n"; }

std::string boxKeys(const Vec3& size, const Vec3& center)
{
    return "shape = { box = { size = " + exact(size) + ", center = " + exact(center) + " } }\n";
}

std::string cutKeys(const Vec3& size, const Vec3& center)
{
    return "cut = [{ box = { size = " + exact(size) + ", center = " + exact(center) + " } }]\n";
}

std::string halfspace(const Vec3& normal, double offset)
{
    return format("halfspace = { normal = %s, offset = %.17g }", exact(normal), offset);
}

std::string grip(const char* name, const std::string& region, const std::string& move)
{
    return format("[[grip]]\nname = \"%s\"\nbody = \"body\"\nregion = { %s }\nmove = { %s }\n", name, region, move);
}

double Ramp::share(double time) const
{
    return time < 1 ? knee * time : knee + (1 - knee) * (time - 1) / (seconds - 1);
}

std::string Ramp::keys(const Vec3& translate) const
{
    return format("keys = [{ time = 0 }, { time = 1, translate = %s }, { time = %.17g, translate = %s }]",
                  exact(knee * translate), seconds, exact(translate));
}

Crack::Crack(const core::Simulation& simulation) : start_(materialPhi(simulation.bodies()[0])) {}

std::vector<Vec3> Crack::voxels(const core::Simulation& simulation) const
{
    const core::Body& body = simulation.bodies()[0];
    std::vector<Vec3> gone;
    for (const auto& [c, phi] : start_)
        if (body.mesh->phi()(c) >= 0) gone.push_back(body.phi.voxelSize() * Vec3(c.x, c.y, c.z));
    return gone;
}

double Crack::tip(const core::Simulation& simulation, const Vec3& direction, double none) const
{
    for (const Vec3& X : voxels(simulation)) none = std::max(none, X.dot(direction));
    return none;
}

double Crack::meanLength(const core::Simulation& simulation) const
{
    const core::Body& body = simulation.bodies()[0];
    std::set<int> rows;                     // z
    std::set<std::pair<int, int>> columns;  // x, z
    for (const auto& [c, phi] : start_) {
        if (c.y == 0) rows.insert(c.z);
        if (body.mesh->phi()(c) >= 0) columns.emplace(c.x, c.z);
    }
    return body.phi.voxelSize() * double(columns.size()) / double(rows.size());
}

double slopeOf(std::span<const Eigen::Vector2d> points)
{
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& p : points) mean += p / double(points.size());
    double xx = 0, xy = 0;
    for (const Eigen::Vector2d& p : points)
        xx += std::pow(p.x() - mean.x(), 2), xy += (p.x() - mean.x()) * (p.y() - mean.y());
    return xy / xx;
}

double flowOf(const core::StepRecord& step, const std::string& name)
{
    const auto it = step.energyFlow.find(name);
    return it == step.energyFlow.end() ? 0 : it->second;
}

double workOf(const core::StepRecord& step)
{
    double sum = 0;
    for (const auto& [name, amount] : step.energyFlow)
        if (name.starts_with("work_") || name.ends_with("_work")) sum += amount;
    return sum;
}

}  // namespace vdbfrac::lab::verify
