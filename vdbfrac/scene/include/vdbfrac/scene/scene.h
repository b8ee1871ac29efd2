// A scene as checked plain structs. SI units, y up. Nothing here simulates.
#pragma once

#include <vdbfrac/base/primitive.h>
#include <vdbfrac/base/vec.h>
#include <vdbfrac/scene/values.h>

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace vdbfrac::scene {

struct Time {
    int firstFrame = 1;  ///< the rest state, t = 0
    int lastFrame = 96;
    double fps = 24;
    int substeps = 0;       ///< time steps a frame; 0 is "auto"
    double nodeCfl = 1;     ///< "auto": lattice cells a node may move in a step, relative to its neighbours' mean
    double frontCfl = 0.5;  ///< "auto": voxels the crack front may move in a step
};

enum class LatticeKind { six, five, delaunay };

struct Grid {
    double voxelSize = 0;  ///< dx [m]
    LatticeKind lattice = LatticeKind::six;
    int coarsening = 1;      ///< lattice spacing h = coarsening * dx
    int halfWidth = 3;       ///< of the narrow band [voxels]
    double grading = 1;      ///< delaunay: times that tets deep inside may be larger
    bool wholeTets = false;  ///< surface = "whole_tets"; false is "cut_planes"
};

struct MeshFile {
    std::filesystem::path file;  ///< already resolved against the scene's folder: absolute
    double scale = 1;
    Vec3 rotate = Vec3::Zero();     ///< degrees about x, then y, then z
    Vec3 translate = Vec3::Zero();  ///< m; applied last
};

struct VdbFile {
    std::filesystem::path file;
    std::string grid;  ///< name; empty takes the first level set
};

struct Body {
    std::string name;
    std::variant<Primitive, MeshFile, VdbFile> shape;
    std::vector<Primitive> add;  ///< united with the shape
    std::vector<Primitive> cut;  ///< then taken away
    std::string material;
    Vec3 velocity = Vec3::Zero();         ///< at t = 0 [m/s]
    Vec3 angularVelocity = Vec3::Zero();  ///< at t = 0 about the centre of mass [rad/s]
    std::string place;                    ///< file:line:column, for later complaints
};

struct Material {
    std::string name;
    double youngsModulus = 0;  ///< E [Pa]
    double poissonRatio = 0;   ///< nu
    double density = 0;        ///< rho [kg/m^3]
};

struct PoseKey {
    double time = 0;                ///< s
    Vec3 translate = Vec3::Zero();  ///< m from the rest position
    Vec3 rotate = Vec3::Zero();     ///< degrees about x, then y, then z, round the grip's pivot
};

struct Velocity {
    Vec3 velocity = Vec3::Zero();  ///< m/s
};
struct Keys {
    std::vector<PoseKey> keys;  ///< at least one, times strictly rising; held before the first and after the last
    Vec3 pivot = Vec3::Zero();  ///< m
};
struct Force {
    Vec3 force = Vec3::Zero();  ///< total on the region [N]
    double ramp = 0;            ///< s from 0 to the full force
};

struct Grip {
    std::string name;  ///< given, or "grip1", "grip2", ...
    std::string body;
    Primitive region;
    std::variant<Velocity, Keys, Force> move;
    std::string place;
};

struct Solver {
    /// Or "midpoint", "sdirk2", "symplectic_euler", "forward_euler", "static".
    std::string integrator = "backward_euler";
    std::string strain = "corotational";  ///< or "linear", "green"
    std::string tangent = "exact";        ///< or "projected", "warped"
    double newtonTolerance = 1e-3;        ///< of the residual, relative to the largest force
    int newtonIterations = 20;
    std::string linearSolver = "auto";  ///< or "jacobi", "multigrid", "direct"
    double linearTolerance = 1e-2;
    int linearIterations = 2000;
    std::string precision = "mixed";  ///< or "double"
    bool cellDilation = true;         ///< volumetric = "cell"; false is "none"
};

struct Output {
    std::vector<std::string> vdb = {"phi"};  ///< of phi, energy, arrival, surface, vel, fragment_id
    bool obj = true;
};

/// What 'vdbfrac study' runs and measures. A simulation takes no notice of it.
struct Study {
    /// A key that changes along with that of its series.
    struct Tied {
        std::string key;
        std::vector<std::string> values;  ///< TOML texts, as many as the series has
    };
    /// Settings that differ in one key: a curve of error against cost.
    struct Series {
        std::string name;
        std::vector<std::string> set;  ///< "key=value", before the key is varied
        std::string key;
        std::vector<std::string> values;  ///< TOML texts, at least one
        std::vector<Tied> tied;
        std::string refines = "auto";  ///< "up", "down": which values are finer; "auto": those that take more work
        std::optional<double> order;   ///< of convergence, as expected
    };
    /// A number that is taken of each run. Which members have a meaning, the quantity says; `body` and `grip` are
    /// filled in where the quantity needs them.
    struct Measure {
        std::string name, quantity, body, grip;
        std::optional<Vec3> point;   ///< m, at rest
        std::optional<Vec3> axis;    ///< of unit length
        std::optional<double> rest;  ///< m: the value that an oscillation is about
        /// m, of the standing wave along `axis`, 0 at `point`, that alone is looked at.
        std::optional<double> wavelength;
        std::optional<double> exact;  ///< the true value, in the unit of the quantity
        std::string source;           ///< of `exact`
        std::optional<double> scale;  ///< what errors are relative to, instead of the true value
        std::optional<double> order;  ///< of convergence, as expected in all series instead of theirs; 0: none is
    };
    std::string about;
    int rounds = 5;  ///< of timing
    std::vector<Series> series;
    std::vector<Measure> measures;
};

struct EffectTable {
    std::string name;
    Values values;
};

struct Scene {
    std::filesystem::path file;  ///< it was read from; no part of what is simulated
    std::string name = "scene";
    Time time;
    Grid grid;
    std::vector<Body> bodies;
    std::vector<Material> materials;
    std::vector<Grip> grips;
    Solver solver;
    Output output;
    std::vector<EffectTable> effects;  ///< those the scene names, in the order of the effect list
    std::optional<Study> study;

    /// The material the body names; that it exists was checked on reading.
    const Material& materialOf(const Body& body) const;
};

}  // namespace vdbfrac::scene
