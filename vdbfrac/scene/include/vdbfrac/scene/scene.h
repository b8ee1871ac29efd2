// A scene as checked plain structs. SI units, y up. Nothing here simulates.
#pragma once

#include <vdbfrac/base/primitive.h>
#include <vdbfrac/base/rotation.h>
#include <vdbfrac/base/vec.h>
#include <vdbfrac/scene/values.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
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

    double end() const { return (lastFrame - firstFrame) / fps; }  ///< s: of the last frame
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
    std::string grid;               ///< name; empty takes the first level set
    double scale = 1;               ///< these as of a mesh
    Vec3 rotate = Vec3::Zero();     ///< degrees
    Vec3 translate = Vec3::Zero();  ///< m
};

/// Where the scene puts what a file holds.
struct FilePlace {
    double scale = 1;
    Mat3 turn = Mat3::Identity();
    Vec3 shift = Vec3::Zero();

    Vec3 operator()(const Vec3& X) const { return turn * (scale * X) + shift; }
    bool isMoved() const { return scale != 1 || turn != Mat3::Identity() || !shift.isZero(0); }
};
template <class File>
FilePlace placeOf(const File& file)
{
    return {file.scale, rotationOf(file.rotate), file.translate};
}

using Shape = std::variant<Primitive, MeshFile, VdbFile>;
/// The file that a shape is read from; null of an analytic solid.
inline std::filesystem::path* fileOf(Shape& shape)
{
    if (auto* mesh = std::get_if<MeshFile>(&shape)) return &mesh->file;
    auto* vdb = std::get_if<VdbFile>(&shape);
    return vdb ? &vdb->file : nullptr;
}
inline const std::filesystem::path* fileOf(const Shape& shape) { return fileOf(const_cast<Shape&>(shape)); }

struct Body {
    std::string name;
    Shape shape;
    std::vector<Primitive> add;  ///< united with the shape
    std::vector<Primitive> cut;  ///< then taken away
    std::string material;
    Vec3 velocity = Vec3::Zero();         ///< at t = 0 [m/s]
    Vec3 angularVelocity = Vec3::Zero();  ///< at t = 0 about the center of mass [rad/s]
    std::string place;                    ///< file:line:column, for later complaints
};

struct Material {
    std::string name;
    double youngsModulus = 0;  ///< E [Pa]
    double poissonRatio = 0;   ///< nu
    double density = 0;        ///< rho [kg/m^3]
    Vec3 colour = kGrey;       ///< red, green, blue: what is drawn where a body's own surface has no material
    Vec3 tornColour = kRed;    ///< of faces that fracture makes

    static inline const Vec3 kGrey{0.72, 0.71, 0.68}, kRed{0.8, 0.1, 0.07};
    bool hasColour() const { return colour != kGrey; }
    bool hasTornColour() const { return tornColour != kRed; }
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
    bool isSmooth = false;      ///< between keys: without jumps of velocity
};
struct Force {
    Vec3 force = Vec3::Zero();  ///< total on the region [N]
    double ramp = 0;            ///< s from 0 to the full force
};

/// How a region or a collider goes through space.
using Path = std::variant<Velocity, Keys>;

struct Grip {
    std::string name;  ///< given, or "grip1", "grip2", ...
    std::string body;
    Primitive region;
    std::variant<Velocity, Keys, Force> move;
    std::optional<double> until;  ///< s; when it lets go: never without it
    std::string place;
};

/// A solid that bodies cannot enter. It moves by itself and is not moved.
struct Collider {
    std::string name;  ///< given, or "collider1", "collider2", ...
    Shape shape;
    Path move;
    double friction = 0.5;     ///< coefficient of Coulomb friction
    double stiffness = 10;     ///< of a touch, over that of a cell
    double untangleSpeed = 0;  ///< m/s
    std::string place;
};

enum class Integrator { backwardEuler, midpoint, sdirk2, symplecticEuler, forwardEuler, statics };
enum class Strain { corotational, linear, green };
enum class Tangent { exact, projected, warped };
enum class LinearSolver { automatic, jacobi, multigrid, direct };
enum class Precision { mixed, doubles };

/// As the text of a scene has them.
const std::string& nameOf(Integrator integrator);
const std::string& nameOf(Strain strain);

struct Solver {
    Integrator integrator = Integrator::backwardEuler;
    Strain strain = Strain::corotational;
    Tangent tangent = Tangent::exact;
    double newtonTolerance = 1e-3;  ///< of the residual, relative to the largest force
    int newtonIterations = 20;
    LinearSolver linearSolver = LinearSolver::automatic;
    double linearTolerance = 1e-2;
    int linearIterations = 2000;
    Precision precision = Precision::mixed;
    bool cellDilation = true;  ///< volumetric = "cell"; false is "none"
    double meanStrain = 0.75;  ///< share of the shear energy taken from the mean strain of a cell
};

struct Output {
    std::vector<std::string> vdb = {"phi"};  ///< out of Vocabulary::fields
    bool obj = true;
    bool ply = false;
    bool motion = false;                        ///< positions of all nodes, for surfaces of one topology
    std::vector<std::string> pointCache;        ///< such surfaces, after the last frame: "mdd", "usda"
    double tornDetail = 0, tornDetailSize = 0;  ///< m: roughness of torn faces, and of its features; size 0: 3 voxels
    int tornDetailSeed = 0;
    bool lipsClosed = true;  ///< lips = "closed"; false is "as_simulated"
    bool movedOut = true;    ///< in_colliders = "moved_out"; false is "as_simulated"

    bool followsNodes() const { return motion || !pointCache.empty(); }
};

/// A table that the scene has, of those that a vocabulary brings.
struct NamedValues {
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
    std::vector<Collider> colliders;
    Solver solver;
    Output output;
    std::vector<NamedValues> tables;  ///< of Vocabulary::tables, in their order
    std::vector<NamedValues> notes;   ///< of Vocabulary::notes; no part of what is simulated

    /// The material the body names. Throws InputError where there is none.
    const Material& materialOf(const Body& body) const;
    /// The values of one of `tables`, or null where the scene does not have it.
    const Values* table(std::string_view name) const;
};

}  // namespace vdbfrac::scene
