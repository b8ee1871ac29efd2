// Values that a user reads back from the files of a run, where they are known.
#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/lab/scenes/rod.h>
#include <vdbfrac/lab/scenes/saw.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <Eigen/Geometry>
#include <openvdb/openvdb.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <tuple>

#include <unistd.h>

using namespace vdbfrac;
using lab::Rod;
using lab::SceneRun;
namespace fs = std::filesystem;

namespace {

constexpr double kFloat = 1e-6;  // relative: ten roundings of a float

/// The files of a run with one frame, the state at hand.
class Written {
public:
    explicit Written(const SceneRun& run)
        : folder_(fs::temp_directory_path() / ("vdbfrac-read-back-" + std::to_string(::getpid()))),
          name_(run.scene.name)
    {
        core::RunFolder folder(folder_, run.scene, run.simulation, core::ExistingRun::replace);
        for (const core::StepRecord& step : run.steps) folder.addStep(step);
        folder.writeFrame(run.simulation, 1);
        folder.finish(run.simulation, "done");
    }
    ~Written() { fs::remove_all(folder_); }
    Written(const Written&) = delete;

    template <class Grid>
    typename Grid::Ptr grid(const std::string& name) const
    {
        openvdb::initialize();
        openvdb::io::File file((folder_ / "vdb" / (name_ + ".0001.vdb")).string());
        file.open(false);
        return openvdb::gridPtrCast<Grid>(file.readGrid(name));
    }
    fs::path obj() const { return folder_ / "obj" / (name_ + ".0001.obj"); }
    std::string stats() const { return readText(folder_ / "stats.csv"); }

private:
    fs::path folder_;
    std::string name_;
};

std::string ball(const std::string& name, double x, double radius, const std::string& more)
{
    std::ostringstream s;
    s << "[[body]]\nname = \"" << name << "\"\nmaterial = \"m\"\nshape = { sphere = { radius = " << radius
      << ", center = [" << x << ", 0.5, 0] } }\n"
      << more;
    return s.str();
}

const std::string kBalls =
    "version = 1\nname = \"balls\"\n[grid]\nvoxel_size = 0.1\n[material.m]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\n"
    "density = 1000\n[output]\nvdb = [\"surface\", \"vel\", \"fragment_id\"]\nobj = true\n";

Vec3 place(const openvdb::Coord& c, double dx) { return dx * Vec3(c.x(), c.y(), c.z()); }

TEST(VelGrid, HoldsTheVelocityOfTheSurfaceNearby)
{
    constexpr double dx = 0.1;
    const Vec3 velocity(1, -2, 3), spin(0, 2, 1), center(1, 0.5, 0);
    for (const bool spins : {false, true}) {
        const SceneRun run(
            kBalls + ball("one", 1, 0.6,
                          std::string("velocity = [1, -2, 3]\n") + (spins ? "angular_velocity = [0, 2, 1]\n" : "")));
        const Written files(run);
        const auto vel = files.grid<openvdb::Vec3SGrid>("vel");
        const auto surface = files.grid<openvdb::FloatGrid>("surface");
        ASSERT_GT(vel->activeVoxelCount(), 1000u);
        double worst = 0;
        for (auto v = vel->cbeginValueOn(); v; ++v) {
            const Vec3 expected =
                velocity + (spins ? spin : Vec3::Zero().eval()).cross(place(v.getCoord(), dx) - center);
            // The point of the surface that it is of is as far away as the surface.
            const double away = std::abs(surface->tree().getValue(v.getCoord())) + 1e-3 * dx;
            const Vec3 value((*v).x(), (*v).y(), (*v).z());
            worst = std::max(worst, (value - expected).norm());
            EXPECT_LE((value - expected).norm(), kFloat * 4 + (spins ? spin.norm() * away : 0));
        }
        std::printf("vel is off by at most %.2e m/s of %.1f\n", worst, velocity.norm());
    }
}

TEST(FragmentIdGrid, HoldsTheIdOfTheBodyThatIsNearer)
{
    constexpr double dx = 0.1;
    // Mirror images at x = 0, their bands overlap there. Ids are handed out in the order of the bodies.
    const Written files(SceneRun(kBalls + ball("left", -0.6, 0.45, "") + ball("right", 0.6, 0.45, "")));
    const auto ids = files.grid<openvdb::FloatGrid>("fragment_id");
    std::size_t count[2] = {0, 0};
    for (auto id = ids->cbeginValueOn(); id; ++id) {
        const double x = dx * id.getCoord().x();
        if (std::abs(x) < 0.5 * dx) continue;
        EXPECT_EQ(*id, x > 0 ? 1 : 0) << id.getCoord();
        ++count[x > 0];
    }
    EXPECT_GT(count[0], 1000u);
    EXPECT_GT(count[1], 1000u);
    EXPECT_EQ(ids->background(), -1);
}

TEST(EnergyGrid, HoldsTheEnergyOfAUniformStrainInWholeAndInCutVoxels)
{
    constexpr double kSolved = 1e-5;  // of the energy: floats, and the strain as it was solved
    Rod rod;
    rod.shape = "cylinder = { axis = \"y\", radius = 0.17, height = 1.5, center = [0.007, 0, 0.011] }";
    for (const char* setting : {"grid.coarsening=1", "grid.coarsening=2", "grid.lattice=\"five\""}) {
        SceneRun run(rod.text("[output]\nvdb = [\"energy\", \"phi\"]\n"), {setting});
        run.step();
        const double h = run.scene.grid.coarsening * rod.dx;
        const Written files(run);
        const auto energy = files.grid<openvdb::FloatGrid>("energy");
        const auto phi = files.grid<openvdb::FloatGrid>("phi");
        std::size_t inside = 0, outside = 0;
        for (auto v = energy->cbeginValueOn(); v; ++v) {
            const double y = std::abs(rod.dx * v.getCoord().y());
            if (std::abs(y - Rod::kFree) < 1.5 * h) continue;  // sees tets that are strained and tets that are held
            EXPECT_NEAR(*v, y < Rod::kFree ? rod.energy() : 0, kSolved * rod.energy()) << setting << v.getCoord();
            ++(phi->tree().getValue(v.getCoord()) < 0 ? inside : outside);
        }
        EXPECT_GT(inside, 200u) << setting;
        EXPECT_GT(outside, 200u) << setting;
        EXPECT_FALSE(energy->tree().isValueOn(openvdb::Coord(6, 0, 0)));  // the air
    }
}

constexpr double kHalfKerf = 0.14;  // m

/// A block at rest, sawn through at x = 0.
std::string block(const char* lattice)
{
    return std::string("version = 1\nname = \"block\"\n[grid]\nvoxel_size = 0.1\nlattice = \"") + lattice +
           "\"\n[[body]]\nname = \"block\"\nmaterial = \"m\"\nshape = { box = { size = [1.35, 0.95, 0.75] } "
           "}\n[material.m]\n"
           "youngs_modulus = 1e5\npoisson_ratio = 0.3\ndensity = 1000\n";
}

TEST(ObjFaces, AreInsideInAKerfAndOutsideOnTheOldSkin)
{
    constexpr double dx = 0.1;
    const Vec3 half(0.675, 0.475, 0.375);
    for (const char* lattice : {"six", "five", "delaunay"}) {
        lab::Saw saw(0, kHalfKerf);
        SceneRun run(block(lattice), {"output.lips=\"as_simulated\""}, &saw);
        {
            const Written before(run);
            const std::string text = readText(before.obj());
            EXPECT_EQ(text.find("inside"), std::string::npos) << lattice;
            EXPECT_NE(text.find("g fragment_0000_outside\nusemtl outside\nf "), std::string::npos) << lattice;
        }
        run.step();
        const Written after(run);
        EXPECT_NE(readText(after.obj()).find("_inside\nusemtl inside\nf "), std::string::npos) << lattice;
        const tetmesh::Surface surface = tetmesh::readObjFrame(after.obj());
        std::size_t kerf = 0, skin = 0;
        for (std::size_t n = 0; n < surface.triangles.size(); ++n) {
            Vec3 middle = Vec3::Zero();
            for (const std::uint32_t p : surface.triangles[n]) middle += surface.points[p] / 3;
            const double depth = (half - middle.cwiseAbs()).minCoeff();  // below the old skin
            if (depth > dx) {
                EXPECT_EQ(surface.torn[n], 1) << lattice << " at " << middle.transpose();
                EXPECT_NEAR(std::abs(middle.x()), kHalfKerf, 0.5 * dx) << lattice;
                ++kerf;
            } else if (std::abs(middle.x()) > kHalfKerf + dx) {
                EXPECT_EQ(surface.torn[n], 0) << lattice << " at " << middle.transpose();
                ++skin;
            }
        }
        EXPECT_GT(kerf, 200u) << lattice;
        EXPECT_GT(skin, 500u) << lattice;
    }
}

/// Torn faces of a body whose material has a colour for them have a material of their own, and are read as torn.
TEST(ObjFaces, AreOfTheTornColourOfTheirBody)
{
    const auto sawn = [&](const std::vector<std::string>& more) {
        lab::Saw saw(0, kHalfKerf);
        SceneRun run(block("six"), more, &saw);
        run.step();
        const Written files(run);
        return std::tuple(readText(files.obj()), readText(files.obj().parent_path() / "block.mtl"),
                          tetmesh::readObjFrame(files.obj()).torn);
    };
    auto [plainObj, plainMtl, plainTorn] = sawn({});
    const auto [obj, mtl, torn] = sawn({"material.m.torn_colour=[1, 0.9, 0.5]"});
    EXPECT_EQ(torn, plainTorn);
    EXPECT_GT(std::ranges::count(torn, 1), 0);
    EXPECT_NE(mtl.find("newmtl inside_m\nKa 0 0 0\nKd 1 0.9 0.5\n"), std::string::npos) << mtl;
    EXPECT_EQ(plainMtl.find("inside_m"), std::string::npos);
    for (std::size_t at = 0; (at = plainObj.find("usemtl inside\n", at)) != std::string::npos; ++at)
        plainObj.insert(at + 13, "_m");
    EXPECT_EQ(obj, plainObj);
}

/// Closed lips lie in the middle of the gap, all over: nothing is missing.
TEST(ObjFaces, CloseTheLipsOfAKerf)
{
    constexpr double dx = 0.1, kSame = 0.35;  // of a voxel: cut along tets, smoothed
    const Vec3 size(1.35, 0.95, 0.75);
    for (const char* lattice : {"six", "five", "delaunay"}) {
        lab::Saw saw(0, 0.8 * dx);
        SceneRun run(block(lattice), {}, &saw);
        run.step();
        const Written after(run);
        const tetmesh::Surface surface = tetmesh::readObjFrame(after.obj());
        double volume = 0;
        std::size_t torn = 0;
        for (std::size_t n = 0; n < surface.triangles.size(); ++n) {
            const auto& t = surface.triangles[n];
            const Vec3 &a = surface.points[t[0]], &b = surface.points[t[1]], &c = surface.points[t[2]];
            volume += a.dot(b.cross(c)) / 6;
            if (!surface.torn[n]) continue;
            EXPECT_NEAR((a + b + c).x() / 3, 0, kSame * dx) << lattice;
            ++torn;
        }
        EXPECT_GT(torn, 200u) << lattice;
        EXPECT_NEAR(volume / size.prod(), 1, 0.005) << lattice;
    }
}

/// The value of a column of stats.csv, in its last row.
double lastOf(const std::string& stats, const std::string& column)
{
    std::istringstream lines(stats);
    std::string header, line, last, name, value;
    std::getline(lines, header);
    while (std::getline(lines, line)) last = line;
    std::istringstream names(header), values(last);
    while (std::getline(names, name, ',') && std::getline(values, value, ','))
        if (name == column) return std::stod(value);
    ADD_FAILURE() << "no column " << column;
    return NAN;
}

TEST(StatsColumns, LoadsOfAGripCarryTheWeightAlongEachAxis)
{
    constexpr double kRounding = 1e-9;  // relative
    const Vec3 g(1, -2, 4);
    for (const char* scheme : {"backward_euler", "midpoint", "sdirk2", "symplectic_euler", "forward_euler", "static"}) {
        SceneRun run(
            block("six") +
                "[time]\nsubsteps = 1\nfps = 1000\n[gravity]\nacceleration = [1, -2, 4]\n"
                "[[grip]]\nname = \"hold\"\nbody = \"block\"\nregion.sphere.radius = 9\nmove.velocity = [0, 0, 0]\n",
            {std::string("solver.integrator=\"") + scheme + '"'});
        run.step();
        run.step();
        const Written files(run);
        const std::string stats = files.stats();
        const double mass = 1000 * lastOf(stats, "volume_m3");
        EXPECT_GT(mass, 1000 * 0.8 * 1.35 * 0.95 * 0.75);
        const Vec3 load(lastOf(stats, "load_hold_x_N"), lastOf(stats, "load_hold_y_N"), lastOf(stats, "load_hold_z_N"));
        EXPECT_LT((load + mass * g).norm(), kRounding * mass * g.norm()) << scheme;
    }
}

}  // namespace
