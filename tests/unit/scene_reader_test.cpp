// Laws of the scene reader: what is accepted, and what it fills.
#include "scene_equality.h"
#include "scene_texts.h"

#include <filesystem>

namespace vdbfrac::scene {
namespace {

using namespace test;

TEST(SceneReader, KeysFillTheStructs)
{
    const Scene s = parse(kGood);
    EXPECT_EQ(s.name, "block");
    EXPECT_EQ(s.time.lastFrame, 12);
    EXPECT_EQ(s.time.fps, 25);
    EXPECT_EQ(s.grid.voxelSize, 0.05);
    ASSERT_EQ(s.bodies.size(), 1u);
    EXPECT_EQ(std::get<Primitive>(s.bodies[0].shape).size, Vec3(1, 2, 1));
    EXPECT_EQ(s.bodies[0].place, "dir/s.toml:8:1");
    EXPECT_EQ(s.materialOf(s.bodies[0]).density, 1000);
    ASSERT_EQ(s.grips.size(), 1u);
    EXPECT_EQ(s.grips[0].name, "grip1");
    EXPECT_EQ(s.grips[0].region.axis, Vec3(0, 1, 0));
    EXPECT_EQ(std::get<Velocity>(s.grips[0].move).velocity, Vec3(0, 0.1, 0));
    EXPECT_TRUE(s.tables.empty());
}

TEST(SceneReader, WhatIsLeftOutHasTheDefaultsOfTheStructs)
{
    const Scene s = parse(with("name = \"block\"\n[time]\nframes = [1, 12]\nfps = 25\n", ""));
    Scene expected;
    expected.grid.voxelSize = 0.05;
    expectEqualSettings(s, expected);
}

TEST(SceneReader, EveryKindOfTableIsRead)
{
    const Scene s = parse(kRich);
    EXPECT_EQ(s.time.substeps, 7);
    EXPECT_EQ(s.grid.lattice, LatticeKind::five);
    EXPECT_FALSE(s.solver.cellDilation);
    const MeshFile& mesh = std::get<MeshFile>(s.bodies[0].shape);
    EXPECT_EQ(mesh.file, std::filesystem::absolute("meshes/a b.obj"));
    EXPECT_EQ(mesh.scale, 0.1);
    EXPECT_EQ(std::get<VdbFile>(s.bodies[1].shape).file, "/data/c.vdb");
    EXPECT_NEAR(s.bodies[0].add[0].axis.norm(), 1, 1e-15);
    EXPECT_EQ(s.bodies[0].cut[0].height, 0);
    EXPECT_EQ(s.materials[0].name, "odd name");  // in the order of the text
    const Keys& keys = std::get<Keys>(s.grips[0].move);
    EXPECT_EQ(keys.keys[1].rotate, Vec3(0, 90, 0));
    EXPECT_EQ(keys.pivot, Vec3(0, 1, 0));
    EXPECT_EQ(std::get<Force>(s.grips[1].move).ramp, 0.25);
    EXPECT_EQ(s.output.vdb, (std::vector<std::string>{"vel", "phi", "fragment_id"}));
}

TEST(SceneReader, EffectsComeInTheOrderOfTheListWithTheirDefaults)
{
    const Scene s = parse(kRich);
    ASSERT_EQ(s.tables.size(), 2u);
    EXPECT_EQ(s.tables[0].name, "pull");  // though the text has drag first
    const Values& v = s.tables[0].values;
    EXPECT_EQ(v.number("rate"), 2);
    EXPECT_EQ(v.text("mode"), "soft");
    EXPECT_EQ(v.integer("count"), 3);
    EXPECT_EQ(v.vector("direction"), Vec3(0, 0, 1));
    EXPECT_TRUE(v.boolean("on"));
    EXPECT_TRUE(v.has("limit"));
    EXPECT_FALSE(parse(kGood + "[pull]\nrate = 1\n").tables[0].values.has("limit"));
}

TEST(SceneReader, ACurveIsAListOfTimesAndScalesThatRises)
{
    const std::string pull = kGood + "[pull]\nrate = 1\nkeys = ";
    const Scene s = parse(pull + "[{ time = -1, scale = 1 }, { time = 1, scale = 5 }]\n");
    const Curve& curve = s.tables[0].values.curve("keys");
    EXPECT_EQ(curve, (Curve{{{-1, 1}, {1, 5}}}));
    for (const auto& [time, scale] : {std::pair{-9., 1.}, {-1., 1.}, {0., 3.}, {.5, 4.}, {1., 5.}, {9., 5.}})
        EXPECT_EQ(curve.at(time), scale);
    EXPECT_EQ(Curve().at(3), 1);
    EXPECT_EQ(parse(writeScene(s, kVocabulary)).tables[0].values.curve("keys"), curve);
    EXPECT_EQ(onlyError(pull + "[{ time = 0, scale = 6 }]\n", "dir/s.toml:22:29").allowed,
              "a list of tables {time, scale}, times rising, each scale greater than 0 and not more than 5");
    onlyError(pull + "[]\n", "dir/s.toml:22:8");
    onlyError(pull + "{ time = 0, scale = 1 }\n", "dir/s.toml:22:8");
    onlyError(pull + "[{ time = 0, scale = 0 }]\n", "dir/s.toml:22:29");
    onlyError(pull + "[{ time = nan, scale = 1 }]\n", "dir/s.toml:22:18");
    onlyError(pull + "[{ time = 0 }]\n", "dir/s.toml:22:9");
    onlyError(pull + "[{ time = 0, scale = 1, scael = 1 }]\n", "dir/s.toml:22:9");
    onlyError(pull + "[{ time = 1, scale = 1 }, { time = 1, scale = 2 }]\n", "dir/s.toml:22:43");
}

TEST(SceneReader, IntegersAreTakenForNumbers)
{
    EXPECT_EQ(parse(with("voxel_size = 0.05", "voxel_size = 2")).grid.voxelSize, 2.0);
}

TEST(SceneOverrides, SetWhatTheTextSetsAndWhatItLeavesOut)
{
    const Scene s = parse(
        kGood, {"grid.voxel_size=0.02", "name=strip", "material.gel.poisson_ratio = 0.49", "body.0.velocity=[0,1,0]",
                "body.left.angular_velocity=[1,0,0]", "solver.newton_iterations=3", "pull.rate=1", "time.substeps=auto",
                "body.0.shape={ sphere = { radius = 2 } }", "body.0.shape.sphere.radius=3"});
    EXPECT_EQ(s.grid.voxelSize, 0.02);
    EXPECT_EQ(s.name, "strip");
    EXPECT_EQ(s.materials[0].poissonRatio, 0.49);
    EXPECT_EQ(s.bodies[0].velocity, Vec3(0, 1, 0));
    EXPECT_EQ(s.bodies[0].angularVelocity, Vec3(1, 0, 0));
    EXPECT_EQ(s.solver.newtonIterations, 3);
    EXPECT_EQ(s.tables.size(), 1u);
    EXPECT_EQ(std::get<Primitive>(s.bodies[0].shape).radius, 3);
}

/// Files can be given by their names alone.
TEST(SceneOverrides, SetKeysBesideTheShortNameOfAFile)
{
    const Scene mesh = parse(kGood, {"body.0.shape={ mesh = \"cow.obj\" }", "body.0.shape.mesh.scale=2"});
    EXPECT_EQ(std::get<MeshFile>(mesh.bodies[0].shape).file.filename(), "cow.obj");
    EXPECT_EQ(std::get<MeshFile>(mesh.bodies[0].shape).scale, 2);
    const Scene vdb = parse(kGood, {"body.0.shape={ vdb = \"cow.vdb\" }", "body.0.shape.vdb.translate=[0,1,0]"});
    EXPECT_EQ(std::get<VdbFile>(vdb.bodies[0].shape).file.filename(), "cow.vdb");
    EXPECT_EQ(std::get<VdbFile>(vdb.bodies[0].shape).translate, Vec3(0, 1, 0));
}

/// A grip without a name is grip1 in columns, notes and measures.
TEST(SceneOverrides, CallWhatHasNoNameAsOutputsDo)
{
    const Scene s = parse(kGood, {"grip.grip1.move.velocity=[0,0,3]"});
    EXPECT_EQ(s.grips[0].name, "grip1");
    EXPECT_EQ(std::get<Velocity>(s.grips[0].move).velocity, Vec3(0, 0, 3));
    EXPECT_EQ(errorsOf(kGood, {"grip.grip2.move.velocity=[0,0,3]"}).size(), 1u);
    EXPECT_EQ(errorsOf(with("[[grip]]", "[[grip]]\nname = \"top\""), {"grip.grip1.move.velocity=[0,0,3]"}).size(), 1u);
}

TEST(SceneOverrides, TakeANameThatIsANumberForTheName)
{
    const std::string scene =
        with("[[grip]]",
             "[[grip]]\nname = \"0\"\nbody = \"left\"\nregion = { halfspace = { normal = \"y\" } }\n"
             "move = { velocity = [0, 0, 0] }\n\n[[grip]]\nname = \"7\"");
    const Scene s = parse(scene, {"grip.0.move.velocity=[0,0,3]", "grip.7.move.velocity=[0,0,4]", "grip.1.until=2"});
    EXPECT_EQ(std::get<Velocity>(s.grips[0].move).velocity, Vec3(0, 0, 3));
    EXPECT_EQ(std::get<Velocity>(s.grips[1].move).velocity, Vec3(0, 0, 4));
    EXPECT_EQ(s.grips[1].until, 2.);
}

TEST(SceneOverrides, TakeNumbersAsTheyAreTyped)
{
    EXPECT_EQ(parse(kGood, {"grid.voxel_size=.036"}).grid.voxelSize, .036);
    EXPECT_EQ(parse(kGood, {"material.gel.poisson_ratio=-.25"}).materials[0].poissonRatio, -.25);
    EXPECT_EQ(parse(kGood, {"grid.voxel_size=2."}).grid.voxelSize, 2);
    EXPECT_EQ(parse(kGood, {"name=v1.5"}).name, "v1.5");
}

TEST(SceneOverrides, ErrorsNameTheOverride)
{
    const auto placeOf = [](const std::string& override) {
        const Details d = errorsOf(kGood, {override});
        EXPECT_EQ(d.size(), 1u) << override;
        return d.empty() ? "" : d[0].place;
    };
    EXPECT_EQ(placeOf("grid.voxel_size=-1"), "--set grid.voxel_size");
    EXPECT_EQ(placeOf("grid.voxel_size=small"), "--set grid.voxel_size");
    EXPECT_EQ(placeOf("grid.voxel=1"), "--set grid.voxel");
    EXPECT_EQ(placeOf("body.1.velocity=[0,0,0]"), "--set body.1.velocity");
    EXPECT_EQ(placeOf("body.right.velocity=[0,0,0]"), "--set body.right.velocity");
    EXPECT_EQ(placeOf("grid.voxel_size.x=1"), "--set grid.voxel_size.x");
    EXPECT_EQ(placeOf("grid.voxel_size"), "--set grid.voxel_size");
    EXPECT_EQ(placeOf("=3"), "--set ");
    EXPECT_EQ(placeOf("a b=3"), "--set a b");
    EXPECT_EQ(placeOf("time.fps=1\nsubsteps=3"), "--set time.fps");
}

}  // namespace
}  // namespace vdbfrac::scene
