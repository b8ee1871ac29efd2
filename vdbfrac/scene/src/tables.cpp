// The tables of the scene itself; a new key is one line here.
#include "tables.h"

#include <algorithm>

namespace vdbfrac::scene::tables {

namespace {

constexpr double kManyTimes = 1e6;  // more iterations or substeps than anyone waits for

const Key kRoot[] = {
    {.name = "version",
     .member = Type::integer,
     .doc = "Version of the scene format.",
     .defaultText = "1",
     .min = 1,
     .max = 1},
    {.name = "name", .member = {Type::label, &Scene::name}, .doc = "Name of the scene; output files carry it."},
};

const Key kTime[] = {
    {.name = "frames",
     .member = {&Time::firstFrame, &Time::lastFrame},
     .doc = "First and last frame; the first is the rest state at t = 0.",
     .min = 0,
     .max = 999999},
    {.name = "fps", .member = &Time::fps, .unit = "1/s", .doc = "Frames per second.", .min = 0, .minOpen = true},
    {.name = "substeps",
     .member = {Type::autoInteger, &Time::substeps},
     .doc = "Time steps a frame; \"auto\" follows the two limits below.",
     .min = 1,
     .max = kManyTimes},
    {.name = "node_cfl",
     .member = &Time::nodeCfl,
     .unit = "cells",
     .doc = "With \"auto\": how far a node may move in a step, relative to its neighbours.",
     .min = 0,
     .minOpen = true},
    {.name = "front_cfl",
     .member = &Time::frontCfl,
     .unit = "voxels",
     .doc =
         "How far a crack front may move in a step: with \"auto\" steps are as short as that, fixed ones hold it back.",
     .min = 0,
     .max = 1,
     .minOpen = true},
};

const Key kGrid[] = {
    {.name = "voxel_size",
     .member = &Grid::voxelSize,
     .unit = "m",
     .doc = "Edge of a voxel of the level set.",
     .defaultText = kRequired,
     .min = 0,
     .minOpen = true},
    {.name = "lattice",
     .member = &Grid::lattice,
     .doc = "Tetrahedra: six or five in a lattice cube, or a Delaunay mesh.",
     .choices = {{"six", LatticeKind::six}, {"five", LatticeKind::five}, {"delaunay", LatticeKind::delaunay}}},
    {.name = "coarsening",
     .member = &Grid::coarsening,
     .unit = "voxels",
     .doc = "Lattice spacing in voxels; only 1 with the lattice \"five\".",
     .min = 1,
     .max = 19},
    {.name = "half_width",
     .member = &Grid::halfWidth,
     .unit = "voxels",
     .doc = "Half width of the narrow band around the surface.",
     .min = 3,
     .max = 10},
    {.name = "grading",
     .member = &Grid::grading,
     .doc = "Delaunay only: how many times larger tetrahedra below the narrow band may be.",
     .min = 1,
     .max = 16},
    {.name = "surface",
     .member = {Type::choice, &Grid::wholeTets},
     .doc = "Tetrahedra are cut by the surface, or stay whole and come and go with their voxels, which leaves a jagged "
            "surface.",
     .choices = {{"cut_planes", false}, {"whole_tets", true}}},
};

const Key kBody[] = {
    {.name = "name",
     .member = {Type::label, &Body::name},
     .doc = "Name that grips refer to; no two bodies share one.",
     .defaultText = kRequired},
    {.name = "shape",
     .member = Type::shape,
     .doc = "The solid the body starts from, a surface mesh, or a level set.",
     .defaultText = kRequired},
    {.name = "add", .member = Type::solids, .doc = "Bounded solids united with the shape.", .defaultText = "[]"},
    {.name = "cut", .member = Type::solids, .doc = "Solids then taken away, such as a notch.", .defaultText = "[]"},
    {.name = "material",
     .member = &Body::material,
     .doc = "Name of a [material.NAME] table.",
     .defaultText = kRequired},
    {.name = "velocity", .member = &Body::velocity, .unit = "m/s", .doc = "Velocity at t = 0."},
    {.name = "angular_velocity",
     .member = &Body::angularVelocity,
     .unit = "rad/s",
     .doc = "Angular velocity at t = 0 about the center of mass."},
};

const Key kMaterial[] = {
    {.name = "youngs_modulus",
     .member = &Material::youngsModulus,
     .unit = "Pa",
     .doc = "Stiffness E.",
     .defaultText = kRequired,
     .min = 0,
     .minOpen = true},
    {.name = "poisson_ratio",
     .member = &Material::poissonRatio,
     .doc = "Sideways contraction nu; 0.5 would be incompressible.",
     .defaultText = kRequired,
     .min = -1,
     .max = 0.5,
     .minOpen = true,
     .maxOpen = true},
    {.name = "density",
     .member = &Material::density,
     .unit = "kg/m^3",
     .doc = "Mass per volume rho.",
     .defaultText = kRequired,
     .min = 0,
     .minOpen = true},
    {.name = "colour",
     .member = &Material::colour,
     .doc = "Red, green, blue, as a screen shows them, of its outer surface in the .mtl and in pictures, where the "
            "body's mesh has no "
            "material of its own.",
     .min = 0,
     .max = 1},
    {.name = "torn_colour",
     .member = &Material::tornColour,
     .doc = "The same of torn faces: in the .mtl and in pictures they have a material of their own then, "
            "inside_NAME.",
     .min = 0,
     .max = 1},
};

const Key kGrip[] = {
    {.name = "name",
     .member = {Type::label, &Grip::name},
     .doc = "Name in the output; \"grip1\", \"grip2\", ... without one.",
     .defaultText = kOptional},
    {.name = "body", .member = &Grip::body, .doc = "Name of the body it holds.", .defaultText = kRequired},
    {.name = "region",
     .member = Type::solid,
     .doc = "Holds the part of the body that lies in this solid at rest.",
     .defaultText = kRequired},
    {.name = "move", .member = Type::motion, .doc = "A velocity, keyed poses, or a force.", .defaultText = kRequired},
    {.name = "until",
     .member = &Grip::until,
     .unit = "s",
     .doc = "When it lets go; without it, never.",
     .min = 0,
     .minOpen = true},
};

const Key kCollider[] = {
    {.name = "name",
     .member = {Type::label, &Collider::name},
     .doc = "Name in the output; \"collider1\", \"collider2\", ... without one.",
     .defaultText = kOptional},
    {.name = "shape",
     .member = Type::anyShape,
     .doc = "The solid as it is at t = 0: a floor at y = 0 is { halfspace = { normal = [0, -1, 0] } }.",
     .defaultText = kRequired},
    {.name = "move",
     .member = Type::path,
     .doc = "A velocity or keyed poses; stands still without.",
     .defaultText = "{ velocity = [0, 0, 0] }"},
    {.name = "friction",
     .member = &Collider::friction,
     .doc = "Coefficient of Coulomb friction between it and the bodies.",
     .min = 0},
    {.name = "stiffness",
     .member = &Collider::stiffness,
     .doc = "Contact stiffness: pressure per metre of penetration, in units of E / h.",
     .min = 0,
     .minOpen = true},
    {.name = "untangle_speed",
     .member = &Collider::untangleSpeed,
     .unit = "m/s",
     .doc = "Speed at which material that starts inside is pushed out; 0: never.",
     .min = 0},
};

const Key kSolver[] = {
    {.name = "integrator",
     .member = &Solver::integrator,
     .doc = "How time steps are made: backward_euler damps, midpoint keeps energy, sdirk2 is exact to second order and "
            "damps only what a step does not resolve, the other two are explicit and need short steps; static leaves "
            "inertia out.",
     .choices = {{"backward_euler", Integrator::backwardEuler},
                 {"midpoint", Integrator::midpoint},
                 {"sdirk2", Integrator::sdirk2},
                 {"symplectic_euler", Integrator::symplecticEuler},
                 {"forward_euler", Integrator::forwardEuler},
                 {"static", Integrator::statics}}},
    {.name = "strain",
     .member = &Solver::strain,
     .doc = "Strain the elastic energy is a square of: corotational for all uses; linear only for small turns; green "
            "(St. Venant-Kirchhoff) stiffens in tension and collapses in compression.",
     .choices = {{"corotational", Strain::corotational}, {"linear", Strain::linear}, {"green", Strain::green}}},
    {.name = "tangent",
     .member = &Solver::tangent,
     .doc = "Matrix of Newton's method: exact (made definite only where it is not), always projected, or warped linear "
            "elasticity.",
     .choices = {{"exact", Tangent::exact}, {"projected", Tangent::projected}, {"warped", Tangent::warped}}},
    {.name = "newton_tolerance",
     .member = &Solver::newtonTolerance,
     .doc = "Residual at which a step is solved, relative to the largest force.",
     .min = 0,
     .max = 1,
     .minOpen = true,
     .maxOpen = true},
    {.name = "newton_iterations",
     .member = &Solver::newtonIterations,
     .doc = "Largest number of Newton iterations per step.",
     .min = 1,
     .max = kManyTimes},
    {.name = "linear_solver",
     .member = &Solver::linearSolver,
     .doc = "How the linear systems are solved; auto picks jacobi or multigrid by the time step, and direct for small "
            "static scenes.",
     .choices = {{"auto", LinearSolver::automatic},
                 {"jacobi", LinearSolver::jacobi},
                 {"multigrid", LinearSolver::multigrid},
                 {"direct", LinearSolver::direct}}},
    {.name = "linear_tolerance",
     .member = &Solver::linearTolerance,
     .doc = "Relative residual of the linear solves; looser where a Newton iteration needs less.",
     .min = 0,
     .max = 1,
     .minOpen = true,
     .maxOpen = true},
    {.name = "linear_iterations",
     .member = &Solver::linearIterations,
     .doc = "Largest number of iterations of a linear solve.",
     .min = 1,
     .max = kManyTimes},
    {.name = "precision",
     .member = &Solver::precision,
     .doc = "mixed: block-Jacobi iterations with tolerances of 1e-4 and looser keep their vectors in single precision; "
            "double: none does.",
     .choices = {{"mixed", Precision::mixed}, {"double", Precision::doubles}}},
    {.name = "volumetric",
     .member = {Type::choice, &Solver::cellDilation},
     .doc = "Volume change averaged over each lattice cell, which keeps nearly incompressible solids from locking, or "
            "not.",
     .choices = {{"cell", true}, {"none", false}}},
    {.name = "mean_strain",
     .member = &Solver::meanStrain,
     .doc = "Share of the shear energy that each lattice cell has from its mean strain rather than from its "
            "tetrahedra, which alone are too stiff in bending and torsion; with volumetric = \"cell\".",
     .min = 0,
     .max = 0.95},
};

std::string checkGrid(const Values& v)
{
    if (v.text("lattice") == "five" && v.integer("coarsening") != 1)
        return "the lattice \"five\" goes with coarsening = 1 only";
    if (v.text("lattice") != "delaunay" && v.number("grading") != 1)
        return "grading goes with the lattice \"delaunay\" only";
    constexpr double kLargestTets = 24;  // voxels: in larger ones some voxels would have no tet to have stress from
    if (v.text("lattice") == "delaunay" && double(v.integer("coarsening")) * v.number("grading") > kLargestTets)
        return "coarsening times grading can be at most 24: tetrahedra of so many voxels are too large to be torn";
    if (v.text("lattice") == "delaunay" && v.text("surface") != "cut_planes")
        return "whole_tets goes with the lattices \"six\" and \"five\" only";
    return "";
}

const TableSpec kRootSpec = {"", "Keys outside of any table.", kRoot};
const TableSpec kTimeSpec = {"time", "What is simulated of it.", kTime};
const TableSpec kGridSpec = {"grid", "Resolution of the level set and of the lattice of tetrahedra.", kGrid, checkGrid};
const TableSpec kBodySpec = {"body", "A solid; one table each.", kBody};
const TableSpec kMaterialSpec = {"material", "An elastic material; bodies name it.", kMaterial};
const TableSpec kGripSpec = {"grip", "Holds or pulls a part of a body; any number of tables.", kGrip};
const TableSpec kColliderSpec = {"collider", "A solid that bodies bump into; any number of tables.", kCollider};
const TableSpec kSolverSpec = {"solver", "How time steps are made, and when one counts as solved.", kSolver};

/// The name of an enum's value, by the key that takes it.
const std::string& nameOf(const TableSpec& spec, std::string_view key, long long value)
{
    return choiceName(*std::find_if(spec.keys.begin(), spec.keys.end(), [&](const Key& k) { return key == k.name; }),
                      value);
}

}  // namespace

const TableSpec& root() { return kRootSpec; }
const TableSpec& time() { return kTimeSpec; }
const TableSpec& grid() { return kGridSpec; }
const TableSpec& body() { return kBodySpec; }
const TableSpec& material() { return kMaterialSpec; }
const TableSpec& grip() { return kGripSpec; }
const TableSpec& collider() { return kColliderSpec; }
const TableSpec& solver() { return kSolverSpec; }

std::vector<Section> sections(const Output& output, const Vocabulary& vocabulary)
{
    using enum Section::Form;
    std::vector<Section> all{
        {time()}, {grid(), single, true}, {body(), list, true}, {material(), byName}, {grip(), list}};
    if (vocabulary.colliders) all.push_back({collider(), list});
    all.push_back({solver()});
    all.push_back({output.spec()});
    return all;
}

std::vector<std::string> namesOf(std::span<const TableSpec> specs)
{
    std::vector<std::string> names;
    for (const TableSpec& spec : specs) names.emplace_back(spec.name);
    return names;
}

std::vector<std::string> namesOf(std::span<const Key> keys)
{
    std::vector<std::string> names;
    for (const Key& key : keys) names.emplace_back(key.name);
    return names;
}

}  // namespace vdbfrac::scene::tables

namespace vdbfrac::scene {

std::vector<TableSpec> Vocabulary::all() const
{
    std::vector<TableSpec> both = notes;
    both.insert(both.end(), tables.begin(), tables.end());
    return both;
}

const std::string& nameOf(Integrator integrator)
{
    return tables::nameOf(tables::solver(), "integrator", static_cast<long long>(integrator));
}

const std::string& nameOf(Strain strain)
{
    return tables::nameOf(tables::solver(), "strain", static_cast<long long>(strain));
}

}  // namespace vdbfrac::scene
