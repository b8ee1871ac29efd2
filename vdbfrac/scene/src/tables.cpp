#include "tables.h"

#include <climits>

namespace vdbfrac::scene::tables {

namespace {

constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr double kManyTimes = 1e6;  // more iterations or substeps than anyone waits for

const std::vector<Key> kRoot = {
    {"version", Type::integer, "", "Version of the scene format.", "1", 1, 1},
    {"name", Type::label, "", "Name of the scene; output files carry it.", "\"scene\""},
};

const std::vector<Key> kTime = {
    {"frames", Type::range, "", "First and last frame; the first is the rest state at t = 0.", "[1, 96]", 0, 999999},
    {"fps", Type::number, "1/s", "Frames per second.", "24", 0, kEndless, true},
    {"substeps", Type::autoInteger, "", "Time steps a frame; \"auto\" follows the two limits below.", "\"auto\"", 1,
     kManyTimes},
    {"node_cfl", Type::number, "cells", "With \"auto\": how far a node may move in a step, relative to its neighbours.",
     "1", 0, kEndless, true},
    {"front_cfl", Type::number, "voxels", "With \"auto\": how far a crack front may move in a step.", "0.5", 0, 2,
     true},
};

const std::vector<Key> kGrid = {
    {"voxel_size", Type::number, "m", "Edge of a voxel of the level set.", nullptr, 0, kEndless, true},
    {"lattice",
     Type::choice,
     "",
     "Tetrahedra: six or five in a lattice cube, or a Delaunay mesh.",
     "\"six\"",
     -kEndless,
     kEndless,
     false,
     false,
     {"six", "five", "delaunay"}},
    {"coarsening", Type::integer, "voxels", "Lattice spacing in voxels; only 1 with the lattice \"five\".", "1", 1, 19},
    {"half_width", Type::integer, "voxels", "Half width of the narrow band around the surface.", "3", 3, 10},
    {"grading", Type::number, "", "Delaunay only: how many times larger tetrahedra below the narrow band may be.", "1",
     1, 16},
    {"surface",
     Type::choice,
     "",
     "Tetrahedra are cut by the surface, or stay whole and come and go with their voxels, which leaves a jagged "
     "surface.",
     "\"cut_planes\"",
     -kEndless,
     kEndless,
     false,
     false,
     {"cut_planes", "whole_tets"}},
};

const std::vector<Key> kBody = {
    {"name", Type::label, "", "Name that grips refer to; no two bodies share one.", nullptr},
    {"shape", Type::shape, "", "The solid the body starts from, a surface mesh, or a level set.", nullptr},
    {"add", Type::solids, "", "Bounded solids united with the shape.", "[]"},
    {"cut", Type::solids, "", "Solids then taken away, such as a notch.", "[]"},
    {"material", Type::text, "", "Name of a [material.NAME] table.", nullptr},
    {"velocity", Type::vector, "m/s", "Velocity at t = 0.", "[0, 0, 0]"},
    {"angular_velocity", Type::vector, "rad/s", "Angular velocity at t = 0 about the centre of mass.", "[0, 0, 0]"},
};

const std::vector<Key> kMaterial = {
    {"youngs_modulus", Type::number, "Pa", "Stiffness E.", nullptr, 0, kEndless, true},
    {"poisson_ratio", Type::number, "", "Sideways contraction nu; 0.5 would be incompressible.", nullptr, -1, 0.5, true,
     true},
    {"density", Type::number, "kg/m^3", "Mass per volume rho.", nullptr, 0, kEndless, true},
};

const std::vector<Key> kGrip = {
    {"name", Type::label, "", "Name in the output; \"grip1\", \"grip2\", ... without one.", ""},
    {"body", Type::text, "", "Name of the body it holds.", nullptr},
    {"region", Type::solid, "", "Holds the part of the body that lies in this solid at rest.", nullptr},
    {"move", Type::motion, "", "A velocity, keyed poses, or a force.", nullptr},
};

const std::vector<Key> kSolver = {
    {"integrator",
     Type::choice,
     "",
     "How time steps are made: backward_euler damps, midpoint keeps energy, sdirk2 is exact to second order and damps "
     "only what a "
     "step does not resolve, the other two are explicit and need short steps; static leaves inertia out.",
     "\"backward_euler\"",
     -kEndless,
     kEndless,
     false,
     false,
     {"backward_euler", "midpoint", "sdirk2", "symplectic_euler", "forward_euler", "static"}},
    {"strain",
     Type::choice,
     "",
     "Strain the elastic energy is a square of: corotational for all uses; linear only for small turns; green (St. "
     "Venant-Kirchhoff) "
     "stiffens in tension and collapses in compression.",
     "\"corotational\"",
     -kEndless,
     kEndless,
     false,
     false,
     {"corotational", "linear", "green"}},
    {"tangent",
     Type::choice,
     "",
     "Matrix of Newton's method: exact (made definite only where it is not), always projected, or warped linear "
     "elasticity.",
     "\"exact\"",
     -kEndless,
     kEndless,
     false,
     false,
     {"exact", "projected", "warped"}},
    {"newton_tolerance", Type::number, "", "Residual at which a step is solved, relative to the largest force.",
     "0.001", 0, 1, true, true},
    {"newton_iterations", Type::integer, "", "Most Newton iterations a step.", "20", 1, kManyTimes},
    {"linear_solver",
     Type::choice,
     "",
     "How the linear systems are solved; auto picks jacobi or multigrid by the time step, and direct for small static "
     "scenes.",
     "\"auto\"",
     -kEndless,
     kEndless,
     false,
     false,
     {"auto", "jacobi", "multigrid", "direct"}},
    {"linear_tolerance", Type::number, "",
     "Relative residual of the linear solves; looser where a Newton iteration needs less.", "0.01", 0, 1, true, true},
    {"linear_iterations", Type::integer, "", "Most iterations of a linear solve.", "2000", 1, kManyTimes},
    {"precision",
     Type::choice,
     "",
     "mixed: block-Jacobi iterations with tolerances of 1e-4 and looser keep their vectors in single precision; "
     "double: none does.",
     "\"mixed\"",
     -kEndless,
     kEndless,
     false,
     false,
     {"mixed", "double"}},
    {"volumetric",
     Type::choice,
     "",
     "Volume change averaged over each lattice cell, which keeps nearly incompressible solids from locking, or not.",
     "\"cell\"",
     -kEndless,
     kEndless,
     false,
     false,
     {"cell", "none"}},
};

const std::vector<Key> kOutput = {
    {"vdb",
     Type::choices,
     "",
     "Grids written each frame: phi, energy and arrival at rest, surface, vel and fragment_id as deformed.",
     "[\"phi\"]",
     -kEndless,
     kEndless,
     false,
     false,
     {"phi", "energy", "arrival", "surface", "vel", "fragment_id"}},
    {"obj", Type::boolean, "", "Whether the deformed surface is written as .obj each frame.", "true"},
};

const std::vector<Key> kStudy = {
    {"about", Type::text, "", "What it shows, in a sentence.", "\"\""},
    {"rounds", Type::integer, "", "How often each setting is timed; 0: values and work only.", "5", 0, 1000},
    {"series", Type::series, "", "What is varied, each a curve; [[study.series]] tables.", "[]"},
    {"measure", Type::measures, "", "What is measured; [[study.measure]] tables.", "[]"},
};
const std::vector<Key> kSeries = {
    {"name", Type::text, "", "Name in table and plot; no two series share one.", nullptr},
    {"set", Type::texts, "", "Keys that are changed in all of it, as in --set: \"key=value\".", "[]"},
    {"key", Type::text, "", "The key that is varied, as in --set.", nullptr},
    {"values", Type::scalars, "", "Its values.", nullptr},
    {"tied", Type::tied, "", "Keys that change along with it, each with as many values.", "[]"},
    {"refines",
     Type::choice,
     "",
     "Which values are finer: higher ones, lower ones, or those that take more work.",
     "\"auto\"",
     -kEndless,
     kEndless,
     false,
     false,
     {"auto", "up", "down"}},
    {"order", Type::number, "", "Order of convergence that is expected.", "", 0, 20, true},
};
const std::vector<Key> kTied = {
    {"key", Type::text, "", "The key.", nullptr},
    {"values", Type::scalars, "", "Its values, one for each of the series.", nullptr},
};

const std::vector<Quantity> kQuantities = {
    {"displacement", {"body", "point"}, {"axis"}},
    {"period", {"body", "point", "axis"}, {"rest", "wavelength"}},
    {"damping", {"body", "point", "axis"}, {"rest", "wavelength"}},
    {"energy_norm", {}},
    {"peak_energy", {}},
    {"load_peak", {"grip"}, {"axis"}},
    {"load_end", {"grip"}, {"axis"}},
    {"load_work", {"grip"}},
    {"onset", {}},
    {"dissipated", {}},
    {"energy_balance", {}},
    {"kinetic_energy", {}},
    {"momentum", {}},
    {"angular_momentum", {}},
    {"angular_velocity", {"body"}},
    {"volume", {}},
    {"fragments", {}},
    {"fragment_masses", {}},
};

std::vector<const char*> quantityNames()
{
    std::vector<const char*> names;
    for (const Quantity& q : kQuantities) names.push_back(q.name);
    return names;
}

const std::vector<Key> kMeasure = {
    {"name", Type::label, "", "Name of its column; that of the quantity without one.", ""},
    {"quantity", Type::choice, "", "What is measured; docs/commands.md explains each.", nullptr, -kEndless, kEndless,
     false, false, quantityNames()},
    {"body", Type::text, "", "Name of the body; can be left out where there is one.", ""},
    {"grip", Type::text, "", "Name of the grip; can be left out where there is one.", ""},
    {"point", Type::vector, "m", "A point of the body, at rest.", ""},
    {"axis", Type::direction, "", "The component that counts; without it the magnitude.", ""},
    {"rest", Type::number, "m", "Displacement that an oscillation is about; its mean without one.", ""},
    {"wavelength", Type::number, "m", "Of the standing wave along the axis, 0 at the point, that alone counts.", "", 0,
     kEndless, true},
    {"exact", Type::number, "", "The true value, where it is known.", ""},
    {"source", Type::text, "", "Where the true value is from.", "\"\""},
    {"scale", Type::number, "", "What errors are relative to, instead of the true value.", "", 0, kEndless, true},
    {"order", Type::number, "",
     "Order of convergence that is expected of it in all series, instead of theirs; 0: none.", "", 0, 20},
};

const Key kCenter = {"center", Type::vector, "m", "Centre.", "[0, 0, 0]"};
const Key kRadius = {"radius", Type::number, "m", "Radius.", nullptr, 0, kEndless, true};
const Key kAxis = {"axis", Type::direction, "", "Direction of the axis.", "\"y\""};

const std::vector<Key> kBox = {
    {"size", Type::vector, "m", "Edge lengths.", nullptr, 0, kEndless, true},
    kCenter,
};
const std::vector<Key> kSphere = {kRadius, kCenter};
const std::vector<Key> kCylinder = {
    kAxis,
    kRadius,
    kCenter,
    {"height", Type::number, "m", "Length along the axis; 0 is endless, as only cut and region can be.", "0", 0},
};
const std::vector<Key> kCapsule = {
    kAxis,
    kRadius,
    kCenter,
    {"height", Type::number, "m", "Distance between the centres of the two caps.", nullptr, 0},
};
const std::vector<Key> kTorus = {
    kAxis,
    {"radius", Type::number, "m", "Radius of the ring.", nullptr, 0, kEndless, true},
    {"tube", Type::number, "m", "Radius of the tube.", nullptr, 0, kEndless, true},
    kCenter,
};
const std::vector<Key> kHalfspace = {
    {"normal", Type::direction, "", "Direction into the solid.", nullptr},
    {"offset", Type::number, "m", "Distance of its plane from the origin, along the normal.", "0"},
};

const std::vector<Key> kMeshFile = {
    {"file", Type::text, "", "A closed surface (.obj, .ply, .stl, .off), relative to the scene's folder.", nullptr},
    {"scale", Type::number, "", "Factor on all lengths, applied first.", "1", 0, kEndless, true},
    {"rotate", Type::vector, "degrees", "Turn about x, then y, then z.", "[0, 0, 0]"},
    {"translate", Type::vector, "m", "Shift, applied last.", "[0, 0, 0]"},
};
const std::vector<Key> kVdbFile = {
    {"file", Type::text, "", "A .vdb file with a level set, relative to the scene's folder.", nullptr},
    {"grid", Type::text, "", "Name of the grid; empty takes the first level set.", "\"\""},
};

const std::vector<Key> kVelocity = {
    {"velocity", Type::vector, "m/s", "Constant velocity of the region.", nullptr},
};
const std::vector<Key> kKeys = {
    {"keys", Type::poses, "", "Poses over time, held before the first and after the last.", nullptr},
    {"pivot", Type::vector, "m", "Point the rotations turn about.", "[0, 0, 0]"},
};
const std::vector<Key> kForce = {
    {"force", Type::vector, "N", "Total force on the region.", nullptr},
    {"ramp", Type::number, "s", "Time from 0 to the full force.", "0", 0},
};
const std::vector<Key> kPose = {
    {"time", Type::number, "s", "When; later than the key before.", nullptr},
    {"translate", Type::vector, "m", "Shift from the rest position.", "[0, 0, 0]"},
    {"rotate", Type::vector, "degrees", "Turn about x, then y, then z, round the pivot.", "[0, 0, 0]"},
};

std::string checkGrid(const Values& v)
{
    if (v.text("lattice") == "five" && v.integer("coarsening") != 1)
        return "the lattice \"five\" goes with coarsening = 1 only";
    if (v.text("lattice") != "delaunay" && v.number("grading") != 1)
        return "grading goes with the lattice \"delaunay\" only";
    if (v.text("lattice") == "delaunay" && v.text("surface") != "cut_planes")
        return "whole_tets goes with the lattices \"six\" and \"five\" only";
    return "";
}

const TableSpec kRootSpec = {"", "Keys outside of any table.", kRoot};
const TableSpec kMeshFileSpec = {"mesh", "A surface mesh.", kMeshFile};
const TableSpec kVdbFileSpec = {"vdb", "A level set.", kVdbFile};
const TableSpec kPoseSpec = {"pose", "A pose at a time.", kPose};
const TableSpec kSeriesSpec = {"series", "Settings that differ in one key.", kSeries};
const TableSpec kTiedSpec = {"tied", "A key that changes along.", kTied};
const TableSpec kMeasureSpec = {"measure", "A number that is taken of each run.", kMeasure};

const std::vector<Section> kSections = {
    {{"time", "What is simulated of it.", kTime}},
    {{"grid", "Resolution of the level set and of the lattice of tetrahedra.", kGrid, checkGrid},
     Section::Form::single,
     true},
    {{"body", "A solid; one table each.", kBody}, Section::Form::list, true},
    {{"material", "An elastic material; bodies name it.", kMaterial}, Section::Form::byName},
    {{"grip", "Holds or pulls a part of a body; any number of tables.", kGrip}, Section::Form::list},
    {{"solver", "How time steps are made, and when one counts as solved.", kSolver}},
    {{"output", "What is written each frame.", kOutput}},
    {{"study", "Settings that 'vdbfrac study' compares; a simulation takes no notice of it.", kStudy},
     Section::Form::optional},
};

const std::vector<TableSpec> kSolids = {
    {"box", "A box along the axes.", kBox},
    {"sphere", "A ball.", kSphere},
    {"cylinder", "A cylinder with flat ends, or endless.", kCylinder},
    {"capsule", "A cylinder with round ends.", kCapsule},
    {"torus", "A ring.", kTorus},
    {"halfspace", "All points X with normal . X >= offset.", kHalfspace},
};

const std::vector<TableSpec> kMotions = {
    {"velocity", "A constant velocity.", kVelocity},
    {"keys", "Keyed poses.", kKeys},
    {"force", "A force.", kForce},
};

}  // namespace

const TableSpec& root() { return kRootSpec; }
const TableSpec& time() { return kSections[0].spec; }
const TableSpec& grid() { return kSections[1].spec; }
const TableSpec& body() { return kSections[2].spec; }
const TableSpec& material() { return kSections[3].spec; }
const TableSpec& grip() { return kSections[4].spec; }
const TableSpec& solver() { return kSections[5].spec; }
const TableSpec& output() { return kSections[6].spec; }
const TableSpec& study() { return kSections[7].spec; }
std::span<const Section> sections() { return kSections; }

std::span<const TableSpec> solids() { return kSolids; }
const TableSpec& meshFile() { return kMeshFileSpec; }
const TableSpec& vdbFile() { return kVdbFileSpec; }
std::span<const TableSpec> motions() { return kMotions; }
const TableSpec& pose() { return kPoseSpec; }
const TableSpec& series() { return kSeriesSpec; }
const TableSpec& tied() { return kTiedSpec; }
const TableSpec& measure() { return kMeasureSpec; }
std::span<const Quantity> quantities() { return kQuantities; }

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
