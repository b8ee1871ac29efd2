// Torture that has a formula: a plane that moves through a mesh, a body that spins until it tears itself apart.
#include "cases.h"

#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/lab/samples/surface_measures.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <complex>

namespace vdbfrac::lab::verify {

namespace {

/// Part of a tet in which a linear function is negative, from its values at the corners: products of the parts of
/// edges.
double negativePart(std::array<double, 4> f)
{
    std::sort(f.begin(), f.end());
    const auto part = [&](std::size_t in, std::size_t out) { return f[in] / (f[in] - f[out]); };
    switch (std::count_if(f.begin(), f.end(), [](double v) { return v < 0; })) {
    case 0: return 0;
    case 1: return part(0, 1) * part(0, 2) * part(0, 3);
    case 2:
        return part(0, 2) * part(0, 3) + part(0, 2) * part(1, 3) * (1 - part(0, 3)) +
               part(1, 2) * part(1, 3) * (1 - part(0, 2));
    case 3: return 1 - part(3, 0) * part(3, 1) * part(3, 2);
    default: return 1;
    }
}

/// Voxels from 0 to kVoxels - 1 along each axis, a margin of one about the body.
constexpr int kVoxels = 10;

template <class Visit>
void eachVoxel(int upper, const Visit& visit)
{
    for (int z = 0; z <= upper; ++z)
        for (int y = 0; y <= upper; ++y)
            for (int x = 0; x <= upper; ++x) visit(Coord{x, y, z});
}

/// Volume of the material, tet by tet of voxels of edge 1.
double volumeOf(const tetmesh::CutMesh& mesh)
{
    double sum = 0;
    eachVoxel(kVoxels - 1, [&](Coord c) {
        const auto& tets = tetmesh::cellTets(mesh.lattice().shapeOf(c));
        for (int t = 0; t < tets.count; ++t) {
            std::array<double, 4> f;
            for (std::size_t a = 0; a < 4; ++a)
                f[a] = mesh.seenPhi(c + tetmesh::cornerOffset(tets.corner[std::size_t(t)][a]));
            sum += negativePart(f) * tets.volume[std::size_t(t)];
        }
    });
    return sum;
}

struct Flaws {
    double updates = 0, badEdges = 0, surface = 0, volume = 0;
};

/// A plane with normal n eats through a box, `parts` updates a voxel. All values are exact in floats.
void sweep(tetmesh::Lattice::Kind kind, const Vec3& n, int parts, Flaws& flaws)
{
    const auto box = [](Coord c) { return std::max({2. - c.x, c.x - 8., 2. - c.y, c.y - 8., 2. - c.z, c.z - 8.}); };
    tetmesh::CutMesh mesh(tetmesh::Lattice{kind, 1, 1.}, sample({0, 0, 0}, {kVoxels, kVoxels, kVoxels}, 1, [&](Vec3 p) {
                              return box({int(p.x()), int(p.y()), int(p.z())});
                          }));
    const double first = mesh.volume(), far = 8 * n.cwiseAbs().sum();
    for (double shift = -far; shift <= far; shift += 1. / parts) {
        std::vector<VoxelPhi> changes;
        eachVoxel(kVoxels, [&](Coord c) {
            const float plane = std::min(float(n.dot(c.toVec()) + shift), 3.f);
            if (plane > mesh.phi()(c)) changes.emplace_back(c, plane);
        });
        if (changes.empty()) continue;
        mesh.update(changes);
        const BadEdges bad = badEdges(mesh.surface());
        ++flaws.updates;
        flaws.badEdges += double(bad.open + bad.crowded);
        flaws.surface = std::max(flaws.surface, std::abs(enclosedVolume(mesh) - mesh.volume()) / first);
        flaws.volume = std::max(flaws.volume, std::abs(volumeOf(mesh) - mesh.volume()) / first);
    }
}

constexpr const char* kSpinning = R"(version = 1
name = "spinning"
[time]
frames = [1, 121]
fps = 240
substeps = 1
[grid]
voxel_size = 0.1
[[body]]
name = "bar"
shape = { box = { size = [1.2, 0.4, 0.3] } }
angular_velocity = [0, 0, 10]
material = "m"
[material.m]
youngs_modulus = 1e7
density = 1000
[solver]
newton_tolerance = 1e-9
newton_iterations = 50
[fracture]
kappa = 1e3
keys = [{ time = 0.2, scale = 1 }, { time = 0.3, scale = 1e-3 }]
)";

/// Momenta of a body, about the origin.
struct Momenta {
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
    double linearScale = 0, angularScale = 0;  ///< sums of m |v| and of m |x| |v|
};

Momenta momentaOf(const core::Simulation& s)
{
    Momenta p;
    const auto mass = s.elastic().mass();
    for (std::size_t i = 0; i < mass.size(); ++i) {
        const Vec3 mv = mass[i] * s.v()[i];
        p.linear += mv, p.angular += s.x()[i].cross(mv);
        p.linearScale += mv.norm(), p.angularScale += s.x()[i].norm() * mv.norm();
    }
    return p;
}

/// Sees each step after its solve and before material goes.
class Witness : public core::Effect, public core::Observer {
public:
    std::string name() const override { return "witness"; }
    void join(core::Stages& stages) override { stages.observers.push_back(this); }
    void watch(const core::Simulation& simulation)
    {
        simulation_ = &simulation, before_.assign(simulation.v().begin(), simulation.v().end());
    }
    void observe(const core::SolvedStep& step) override
    {
        solved = momentaOf(*simulation_);
        damped.setZero();
        const auto mass = simulation_->elastic().mass();
        for (std::size_t i = 0; i < mass.size(); ++i)
            damped += step.dt * mass[i] * before_[i].cross(simulation_->v()[i]);
    }

    Momenta solved;
    Vec3 damped = Vec3::Zero();  ///< angular momentum that backward Euler takes: dt sum m v_n x v_n+1

private:
    const core::Simulation* simulation_ = nullptr;
    std::vector<Vec3> before_;
};

/// Angular momentum of a rigid body under backward Euler. A step turns it to where x + dt v points: in the plane, with
/// x_n-1 = e^(-i a) x_n, that is 2 - e^(-i a), and v has the moment sin(a) / dt (docs/physics.md).
class RigidSpin {
public:
    RigidSpin(double speed, double dt) : next_(1, speed * dt), dt_(dt) {}
    /// Over that at the start times its speed.
    double step()
    {
        const double angle = std::arg(next_);
        next_ = 2. - std::polar(1., -angle);
        return std::sin(angle) / dt_;
    }

private:
    std::complex<double> next_;
    double dt_;
};

struct Spin {
    double drift = 0;      ///< of momentum, but for what goes with material
    double torque = 0;     ///< largest that the law of backward Euler leaves, of the angular momentum at the start
    double fromRigid = 0;  ///< largest difference from a rigid body until it tears, relative
    double growth = 0;     ///< largest in a step, of the angular momentum at the start
    double kept = 1;       ///< part of the angular momentum that is left when it tears
    double fragments = 0, capped = 0, notFinite = 0;  ///< fragments at the end
};

Spin spin(double nu)
{
    Witness witness;
    SceneRun bar(kSpinning, {"material.m.poisson_ratio=" + std::to_string(nu)}, &witness);
    const double speed = bar.scene.bodies[0].angularVelocity.norm(), dt = 1 / bar.scene.time.fps;
    const Momenta start = momentaOf(bar.simulation);
    const double size = start.angular.norm();
    RigidSpin rigid(speed, dt);
    Spin result;
    Vec3 drift = Vec3::Zero();
    while (!bar.atEnd()) {
        const Momenta before = momentaOf(bar.simulation);
        witness.watch(bar.simulation);
        result.capped += bar.step().outcome != core::Outcome::converged;
        const Momenta& solved = witness.solved;
        const Vec3 change = solved.angular - before.angular;
        drift += solved.linear - before.linear;
        result.drift = std::max(result.drift, drift.norm() / start.linearScale);
        result.torque = std::max(result.torque, (change + witness.damped).norm() / size);
        const double grown = momentaOf(bar.simulation).angular.norm() - before.angular.norm();
        result.growth = std::max(result.growth, grown / size);
        result.notFinite += notFiniteNodes(bar.simulation);
        if (bar.simulation.volume() < bar.simulation.startVolume()) continue;
        result.kept = solved.angular.norm() / size;
        result.fromRigid = std::max(result.fromRigid, std::abs(result.kept / (rigid.step() / speed) - 1));
    }
    result.fragments = double(bar.simulation.fragments());
    return result;
}

}  // namespace

Measurements planeThroughNodes(Extent extent)
{
    constexpr double kVolume = 1e-12;
    const int parts = extent == Extent::full ? 32 : 4;
    Measurements all;
    for (auto [kind, name] : {std::pair{tetmesh::Lattice::Kind::six, "six tets a cell: "},
                              std::pair{tetmesh::Lattice::Kind::five, "five: "}}) {
        Flaws flaws;
        for (const Vec3& n :
             {Vec3(1, 0, 0), Vec3(0, 1, 1), Vec3(1, -1, 0), Vec3(1, 1, 1), Vec3(2, -1, 0), Vec3(1, 2, -3)})
            sweep(kind, n, parts, flaws);
        all.push_back(atLeast(std::string(name) + "updates of the cut", flaws.updates, 100));
        all.push_back(
            atMost(std::string(name) + "edges at which a surface is not a closed 2-manifold", flaws.badEdges, 0));
        all.push_back(atMost(std::string(name) + "volume of a surface against that of the pieces, relative",
                             flaws.surface, kVolume));
        all.push_back(atMost(std::string(name) + "volume against the formula, relative", flaws.volume, kVolume));
    }
    return all;
}

Measurements spunApart(Extent)
{
    constexpr double kMomentum = 1e-10, kLaw = 1e-9, kRigid = .005, kGrowth = 1e-10;
    Measurements all;
    for (double nu : kPoissonRatios) {
        const Spin s = spin(nu);
        all.push_back(atMost(at(nu) + "numbers that are not finite", s.notFinite, 0));
        all.push_back(atLeast(at(nu) + "fragments", s.fragments, 2));
        all.push_back(
            atMost(at(nu) + "drift of momentum but for what goes with material, relative", s.drift, kMomentum));
        all.push_back(
            atMost(at(nu) + "angular momentum of a step against the law of backward Euler, relative", s.torque, kLaw));
        all.push_back(
            atMost(at(nu) + "angular momentum until it tears against a rigid body's, relative", s.fromRigid, kRigid));
        all.push_back(atMost(at(nu) + "part of the angular momentum left when it tears", s.kept, .95));
        all.push_back(atMost(at(nu) + "largest growth of angular momentum in a step, relative", s.growth, kGrowth));
        all.push_back(atMost(at(nu) + "steps that are cut back or capped", s.capped, 0));
    }
    return all;
}

}  // namespace vdbfrac::lab::verify
