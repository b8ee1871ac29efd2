// Laws of the scene reader and writer: what is accepted, what is complained about and where.
#include <vdbfrac/base/error.h>
#include <vdbfrac/scene/reader.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>

namespace vdbfrac::scene {
namespace {

using Details = std::vector<InputError::Detail>;

const std::vector<Key> kPullKeys = {
    {"rate", Type::number, "1/s", "How fast.", nullptr, 0, 10, true},
    {"mode", Type::choice, "", "How.", "\"soft\"", 0, 0, false, false, {"soft", "hard"}},
    {"limit", Type::number, "N", "Where it ends.", ""},
    {"count", Type::integer, "", "How often.", "3", 1},
    {"direction", Type::direction, "", "Where to.", "[0, 0, 2]"},
    {"label", Type::text, "", "A note.", "\"\""},
    {"on", Type::boolean, "", "Whether.", "true"},
    {"keys", Type::curve, "", "How much, over time.", "", 0, 5, true},
};
const std::vector<Key> kDragKeys = {{"air", Type::vector, "m/s", "Wind.", "[0, 0, 0]"}};

std::string checkPull(const Values& v)
{
    return v.number("rate") > 5 && v.text("mode") == "hard" ? "a rate above 5 goes with mode = \"soft\" only" : "";
}

const std::vector<TableSpec> kEffects = {{"pull", "Pulls.", kPullKeys, checkPull}, {"drag", "Drags.", kDragKeys}};

// Line numbers in the tests below count from here.
const std::string kGood = R"(version = 1
name = "block"
[time]
frames = [1, 12]
fps = 25
[grid]
voxel_size = 0.05
[[body]]
name = "left"
shape = { box = { size = [1, 2, 1] } }
material = "gel"
[material.gel]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
[[grip]]
body = "left"
region = { halfspace = { normal = [0, 2, 0], offset = 0.5 } }
move = { velocity = [0, 0.1, 0] }
)";

Scene parse(const std::string& text, const std::vector<std::string>& overrides = {})
{
    return parseScene(text, "dir/s.toml", kEffects, overrides);
}

Details errorsOf(const std::string& text, const std::vector<std::string>& overrides = {})
{
    try {
        parse(text, overrides);
    } catch (const InputError& e) {
        return e.details();
    }
    return {};
}

/// kGood with one piece of text exchanged.
std::string with(const std::string& from, const std::string& to)
{
    std::string text = kGood;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

/// The only complaint of kGood with one piece exchanged; its place is `place`.
InputError::Detail onlyError(const std::string& text, const std::string& place)
{
    const Details details = errorsOf(text);
    EXPECT_EQ(details.size(), 1u) << text;
    if (details.empty()) return {};
    EXPECT_EQ(details[0].place, place) << details[0].what;
    return details[0];
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::filesystem::path absolute(const std::string& file) { return std::filesystem::absolute(file); }

void expectEqual(const Primitive& a, const Primitive& b)
{
    EXPECT_EQ(a.kind, b.kind);
    EXPECT_EQ(a.center, b.center);
    EXPECT_EQ(a.size, b.size);
    EXPECT_EQ(a.axis, b.axis);
    EXPECT_EQ(a.radius, b.radius);
    EXPECT_EQ(a.height, b.height);
    EXPECT_EQ(a.tube, b.tube);
    EXPECT_EQ(a.offset, b.offset);
}

void expectEqual(const std::vector<Primitive>& a, const std::vector<Primitive>& b)
{
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) expectEqual(a[i], b[i]);
}

void expectEqual(const Body& a, const Body& b)
{
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.material, b.material);
    EXPECT_EQ(a.velocity, b.velocity);
    EXPECT_EQ(a.angularVelocity, b.angularVelocity);
    expectEqual(a.add, b.add);
    expectEqual(a.cut, b.cut);
    ASSERT_EQ(a.shape.index(), b.shape.index());
    if (const auto* solid = std::get_if<Primitive>(&a.shape)) expectEqual(*solid, std::get<Primitive>(b.shape));
    if (const auto* mesh = std::get_if<MeshFile>(&a.shape)) {
        const MeshFile& other = std::get<MeshFile>(b.shape);
        EXPECT_EQ(mesh->file, other.file);
        EXPECT_EQ(mesh->scale, other.scale);
        EXPECT_EQ(mesh->rotate, other.rotate);
        EXPECT_EQ(mesh->translate, other.translate);
    }
    if (const auto* vdb = std::get_if<VdbFile>(&a.shape)) {
        EXPECT_EQ(vdb->file, std::get<VdbFile>(b.shape).file);
        EXPECT_EQ(vdb->grid, std::get<VdbFile>(b.shape).grid);
    }
}

void expectEqual(const Grip& a, const Grip& b)
{
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.body, b.body);
    expectEqual(a.region, b.region);
    ASSERT_EQ(a.move.index(), b.move.index());
    if (const auto* m = std::get_if<Velocity>(&a.move)) {
        EXPECT_EQ(m->velocity, std::get<Velocity>(b.move).velocity);
    }
    if (const auto* m = std::get_if<Force>(&a.move)) {
        EXPECT_EQ(m->force, std::get<Force>(b.move).force);
        EXPECT_EQ(m->ramp, std::get<Force>(b.move).ramp);
    }
    if (const auto* m = std::get_if<Keys>(&a.move)) {
        const Keys& other = std::get<Keys>(b.move);
        EXPECT_EQ(m->pivot, other.pivot);
        ASSERT_EQ(m->keys.size(), other.keys.size());
        for (std::size_t i = 0; i < m->keys.size(); ++i) {
            EXPECT_EQ(m->keys[i].time, other.keys[i].time);
            EXPECT_EQ(m->keys[i].translate, other.keys[i].translate);
            EXPECT_EQ(m->keys[i].rotate, other.keys[i].rotate);
        }
    }
}

void expectEqualSettings(const Scene& a, const Scene& b)
{
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.time.firstFrame, b.time.firstFrame);
    EXPECT_EQ(a.time.lastFrame, b.time.lastFrame);
    EXPECT_EQ(a.time.fps, b.time.fps);
    EXPECT_EQ(a.time.substeps, b.time.substeps);
    EXPECT_EQ(a.time.nodeCfl, b.time.nodeCfl);
    EXPECT_EQ(a.time.frontCfl, b.time.frontCfl);
    EXPECT_EQ(a.grid.voxelSize, b.grid.voxelSize);
    EXPECT_EQ(a.grid.lattice, b.grid.lattice);
    EXPECT_EQ(a.grid.coarsening, b.grid.coarsening);
    EXPECT_EQ(a.grid.halfWidth, b.grid.halfWidth);
    EXPECT_EQ(a.solver.newtonTolerance, b.solver.newtonTolerance);
    EXPECT_EQ(a.solver.newtonIterations, b.solver.newtonIterations);
    EXPECT_EQ(a.solver.linearTolerance, b.solver.linearTolerance);
    EXPECT_EQ(a.solver.linearIterations, b.solver.linearIterations);
    EXPECT_EQ(a.solver.cellDilation, b.solver.cellDilation);
    EXPECT_EQ(a.output.vdb, b.output.vdb);
    EXPECT_EQ(a.output.obj, b.output.obj);
}

/// All but the places, which belong to the text.
void expectEqual(const Scene& a, const Scene& b)
{
    expectEqualSettings(a, b);
    ASSERT_EQ(a.bodies.size(), b.bodies.size());
    for (std::size_t i = 0; i < a.bodies.size(); ++i) expectEqual(a.bodies[i], b.bodies[i]);
    ASSERT_EQ(a.grips.size(), b.grips.size());
    for (std::size_t i = 0; i < a.grips.size(); ++i) expectEqual(a.grips[i], b.grips[i]);
    ASSERT_EQ(a.materials.size(), b.materials.size());
    for (std::size_t i = 0; i < a.materials.size(); ++i) {
        EXPECT_EQ(a.materials[i].name, b.materials[i].name);
        EXPECT_EQ(a.materials[i].youngsModulus, b.materials[i].youngsModulus);
        EXPECT_EQ(a.materials[i].poissonRatio, b.materials[i].poissonRatio);
        EXPECT_EQ(a.materials[i].density, b.materials[i].density);
    }
    ASSERT_EQ(a.effects.size(), b.effects.size());
    for (std::size_t i = 0; i < a.effects.size(); ++i) {
        EXPECT_EQ(a.effects[i].name, b.effects[i].name);
        EXPECT_EQ(a.effects[i].values.all(), b.effects[i].values.all());
    }
}

const std::string kRich = R"(name = "rich"
drag = { }
[time]
frames = [0, 0]
fps = 23.976
substeps = 7
node_cfl = 0.1
[grid]
voxel_size = 3.3333333333333335e-05
lattice = "five"
half_width = 10
[[body]]
name = "b \" \u00e9"
shape.mesh = { file = "../meshes/a b.obj", scale = 0.1, rotate = [0.1, 0.2, 0.3], translate = [-0.0, 1e300, 5e-324] }
add = [{ capsule = { axis = [1, 1, 1], radius = 0.1, height = 0.7 } }, { torus = { radius = 2, tube = 0.3 } }]
cut = [{ cylinder = { axis = "x", radius = 0.35, center = [0.5, 0, 0] } }, { sphere = { radius = 9007199254740993 } }]
material = "odd name"
velocity = [1, 2, 3]
angular_velocity = [0.1, 0, 0]
[[body]]
name = "c"
shape.vdb = "/data/c.vdb"
material = "a"
[[body]]
name = "d"
shape.cylinder = { axis = [3, -4, 1e-3], radius = 0.35, height = 1 }
material = "a"
[material."odd name"]
youngs_modulus = 9223372036854775807
poisson_ratio = -0.999
density = 1e-3
[material.a]
youngs_modulus = 1
poisson_ratio = 0.499999
density = 1
[[grip]]
body = "c"
region = { sphere = { radius = 1 } }
move = { keys = [{ time = 0 }, { time = 0.5, rotate = [0, 90, 0], translate = [0, 0.1, 0] }], pivot = [0, 1, 0] }
[[grip]]
name = "pull"
body = "d"
region.halfspace = { normal = [0.3, -0.1, 0.7], offset = -0.1 }
move = { force = [0, -10, 0], ramp = 0.25 }
[pull]
rate = 2
limit = 0.1
[solver]
newton_tolerance = 1e-6
volumetric = "none"
[output]
vdb = ["vel", "phi", "fragment_id"]
obj = false
)";

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
    EXPECT_TRUE(s.effects.empty());
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
    EXPECT_EQ(mesh.file, absolute("meshes/a b.obj"));
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
    ASSERT_EQ(s.effects.size(), 2u);
    EXPECT_EQ(s.effects[0].name, "pull");  // though the text has drag first
    const Values& v = s.effects[0].values;
    EXPECT_EQ(v.number("rate"), 2);
    EXPECT_EQ(v.text("mode"), "soft");
    EXPECT_EQ(v.integer("count"), 3);
    EXPECT_EQ(v.vector("direction"), Vec3(0, 0, 1));
    EXPECT_TRUE(v.boolean("on"));
    EXPECT_TRUE(v.has("limit"));
    EXPECT_FALSE(parse(kGood + "[pull]\nrate = 1\n").effects[0].values.has("limit"));
}

TEST(SceneReader, ACheckOfSeveralKeysComplainsAtTheTable)
{
    const auto d = onlyError(kGood + "[pull]\nrate = 6\nmode = \"hard\"\n", "dir/s.toml:20:1");
    EXPECT_TRUE(contains(d.what, "goes with mode")) << d.what;
    onlyError(with("voxel_size = 0.05", "voxel_size = 0.05\nlattice = \"five\"\ncoarsening = 2"), "dir/s.toml:6:1");
}

// From line 20 on, behind kGood.
const std::string kStudy = R"([study]
about = "what it costs"
rounds = 0
[[study.series]]
name = "steps"
set = ["grid.coarsening=2"]
key = "time.substeps"
values = [1, 2.5, "auto", true]
tied = [{ key = "time.fps", values = [1, 2, 3, 4] }]
refines = "up"
order = 1
[[study.measure]]
name = "tip"
quantity = "displacement"
point = [0, 1, 0]
axis = "y"
exact = 0
scale = 0.5
[[study.measure]]
quantity = "load_peak"
)";

std::string withStudy(const std::string& from, const std::string& to)
{
    std::string text = kGood + kStudy;
    const std::size_t at = text.rfind(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

TEST(SceneStudy, IsReadWithWhatCanBeLeftOut)
{
    const Study s = *parse(kGood + kStudy).study;
    EXPECT_EQ(s.about, "what it costs");
    EXPECT_EQ(s.rounds, 0);
    ASSERT_EQ(s.series.size(), 1u);
    EXPECT_EQ(s.series[0].values, (std::vector<std::string>{"1", "2.5", "\"auto\"", "true"}));
    EXPECT_EQ(s.series[0].tied[0].values, (std::vector<std::string>{"1", "2", "3", "4"}));
    EXPECT_EQ(s.series[0].order, 1);
    ASSERT_EQ(s.measures.size(), 2u);
    EXPECT_EQ(s.measures[0].body, "left");  // the only one
    EXPECT_EQ(*s.measures[0].axis, Vec3(0, 1, 0));
    EXPECT_EQ(s.measures[1].name, "load_peak");
    EXPECT_EQ(s.measures[1].grip, "grip1");
    EXPECT_FALSE(s.measures[1].exact);
    EXPECT_FALSE(parse(kGood).study);
    EXPECT_EQ(parse(kGood + "[study]\n").study->rounds, Study().rounds);
}

TEST(SceneStudy, ReadsBackAsItWasWritten)
{
    const std::string written = writeScene(parse(kGood + kStudy), kEffects);
    EXPECT_EQ(writeScene(parse(written), kEffects), written);
    EXPECT_TRUE(contains(written, "values = [1, 2.5, \"auto\", true]")) << written;
    EXPECT_TRUE(contains(written, "tied = [{ key = \"time.fps\", values = [1, 2, 3, 4] }]")) << written;
    EXPECT_TRUE(contains(written, "exact = 0\n")) << written;
}

TEST(SceneStudy, AMeasureHasWhatItsQuantityNeedsAndNothingElse)
{
    EXPECT_EQ(onlyError(withStudy("\"load_peak\"", "\"load_peek\""), "dir/s.toml:39:12").hint, "did you mean 'load_peak'?");
    EXPECT_TRUE(contains(onlyError(withStudy("point = [0, 1, 0]\n", ""), "dir/s.toml:31:1").what, "lacks the key 'point'"));
    EXPECT_TRUE(contains(onlyError(withStudy("\"load_peak\"", "\"volume\"\ngrip = \"grip1\""), "dir/s.toml:40:8").what, "means nothing"));
    EXPECT_EQ(onlyError(withStudy("\"load_peak\"", "\"load_peak\"\ngrip = \"grip2\""), "dir/s.toml:40:8").hint, "did you mean 'grip1'?");
    onlyError(withStudy("scale = 0.5\n", ""), "dir/s.toml:36:9");
    onlyError(withStudy("\"load_peak\"", "\"load_peak\"\nname = \"tip\""), "dir/s.toml:40:8");
}

TEST(SceneStudy, AmongSeveralGripsTheOneIsNamed)
{
    const std::string grip = "[[grip]]\nbody = \"left\"\nregion.sphere.radius = 1\nmove.force = [1, 0, 0]\n";
    const Details d = errorsOf(kGood + grip + kStudy);
    ASSERT_EQ(d.size(), 1u);
    EXPECT_TRUE(contains(d[0].what, "lacks the key 'grip'")) << d[0].what;
    EXPECT_EQ(d[0].allowed, "one of grip1, grip2");
}

TEST(SceneStudy, ASeriesHasValuesAndWhatIsTiedToItHasAsMany)
{
    onlyError(withStudy("values = [1, 2.5, \"auto\", true]", "values = 1"), "dir/s.toml:27:10");
    onlyError(withStudy("values = [1, 2.5, \"auto\", true]", "values = [1, 2, 3, [4]]"), "dir/s.toml:27:20");
    EXPECT_TRUE(contains(onlyError(withStudy("[1, 2, 3, 4]", "[1, 2]"), "dir/s.toml:28:9").what, "has 2 values"));
    EXPECT_EQ(onlyError(withStudy("refines = \"up\"", "refines = \"upp\""), "dir/s.toml:29:11").hint, "did you mean 'up'?");
    EXPECT_EQ(onlyError(withStudy("[[study.series]]", "[[study.serie]]"), "dir/s.toml:23:9").hint, "did you mean 'series'?");
    EXPECT_TRUE(contains(onlyError(kGood + "[study]\nseries = 3\n", "dir/s.toml:21:10").allowed, "table"));
}

TEST(SceneReader, UnknownKeyNamesPlaceAndNearestKey)
{
    const auto d = onlyError(with("fps = 25", "fps = 25\nsubstep = 3"), "dir/s.toml:6:1");
    EXPECT_EQ(d.what, "unknown key \"substep\" in [time]");
    EXPECT_TRUE(contains(d.allowed, "substeps"));
    EXPECT_EQ(d.hint, "did you mean 'substeps'?");
}

TEST(SceneReader, AMisspeltRequiredKeyIsBothUnknownAndMissing)
{
    const Details d = errorsOf(with("voxel_size", "voxelsize"));
    ASSERT_EQ(d.size(), 2u);
    EXPECT_EQ(d[0].place, "dir/s.toml:6:1");
    EXPECT_EQ(d[0].what, "[grid] lacks the key 'voxel_size'");
    EXPECT_EQ(d[1].place, "dir/s.toml:7:1");
    EXPECT_EQ(d[1].hint, "did you mean 'voxel_size'?");
}

TEST(SceneReader, UnknownTableNamesTheNearestTable)
{
    EXPECT_EQ(onlyError(kGood + "[pul]\nrate = 1\n", "dir/s.toml:20:2").hint, "did you mean 'pull'?");
    EXPECT_EQ(onlyError(kGood + "[zzz]\n", "dir/s.toml:20:2").hint, "");
}

TEST(SceneReader, DuplicateKeysAndSyntaxErrorsNameTheirPlace)
{
    const auto twice = onlyError(with("fps = 25", "fps = 25\nfps = 24"), "dir/s.toml:6:1");
    EXPECT_TRUE(contains(twice.what, "redefine")) << twice.what;
    onlyError(with("size = [1, 2, 1]", "size = [1, 2, 1], size = 3"), "dir/s.toml:10:37");
    onlyError(kGood + "[grid]\n", "dir/s.toml:20:1");
    const Details broken = errorsOf(with("fps = 25", "fps = "));
    ASSERT_EQ(broken.size(), 1u);
    EXPECT_TRUE(broken[0].place.starts_with("dir/s.toml:5:")) << broken[0].place;
}

TEST(SceneReader, WrongTypesTellValueAndWhatIsAllowed)
{
    const auto text = onlyError(with("voxel_size = 0.05", "voxel_size = \"0.05\""), "dir/s.toml:7:14");
    EXPECT_EQ(text.what, "grid.voxel_size is \"0.05\"");
    EXPECT_EQ(text.allowed, "a number greater than 0 (m)");
    EXPECT_EQ(text.hint, "write it without quotes");
    onlyError(with("fps = 25", "fps = [25]"), "dir/s.toml:5:7");
    onlyError(with("fps = 25", "fps = 25\nsubsteps = \"many\""), "dir/s.toml:6:12");
    onlyError(with("fps = 25", "fps = 25\nsubsteps = 0"), "dir/s.toml:6:12");
    onlyError(with("name = \"block\"", "name = 3"), "dir/s.toml:2:8");
    onlyError(with("name = \"block\"", "name = \"../block\""), "dir/s.toml:2:8");
    onlyError(with("name = \"block\"", "name = \"block\"\noutput = { obj = 1 }"), "dir/s.toml:3:18");
    onlyError(with("name = \"block\"", "name = \"block\"\nsolver = 1"), "dir/s.toml:3:10");
    onlyError(with("name = \"block\"", "name = 1979-05-27"), "dir/s.toml:2:8");
    onlyError(with("[1, 2, 1]", "[1, 2]"), "dir/s.toml:10:26");
    onlyError(with("[1, 2, 1]", "[1, \"2\", 1]"), "dir/s.toml:10:30");
    EXPECT_EQ(onlyError(kGood + "[pull]\nrate = 1\ncount = 2.0\n", "dir/s.toml:22:9").hint, "write it without a point");
    EXPECT_EQ(onlyError(kGood + "[pull]\nrate = 1\nmode = \"sofd\"\n", "dir/s.toml:22:8").hint, "did you mean 'soft'?");
    const Details single = errorsOf(with("[[grip]]", "[grip]"));
    ASSERT_EQ(single.size(), 1u);
    EXPECT_EQ(single[0].place, "dir/s.toml:16:1");
    EXPECT_TRUE(contains(single[0].allowed, "[[grip]]"));
}

TEST(SceneReader, RangesAreKeptAndOpenBoundsAreOpen)
{
    for (const char* bad : {"0", "-0.1", "nan", "inf", "-inf", "1e999"}) {
        const Details d = errorsOf(with("voxel_size = 0.05", std::string("voxel_size = ") + bad));
        ASSERT_EQ(d.size(), 1u) << bad;
        EXPECT_TRUE(d[0].place.starts_with("dir/s.toml:7:")) << d[0].place;
    }
    for (const char* bad : {"-1", "0.5", "0.6", "nan"})
        EXPECT_EQ(errorsOf(with("poisson_ratio = 0.3", std::string("poisson_ratio = ") + bad)).size(), 1u) << bad;
    for (const char* good : {"-0.999", "0", "0.4999"})
        EXPECT_TRUE(errorsOf(with("poisson_ratio = 0.3", std::string("poisson_ratio = ") + good)).empty()) << good;
    const auto nu = onlyError(with("poisson_ratio = 0.3", "poisson_ratio = 0.5"), "dir/s.toml:14:17");
    EXPECT_EQ(nu.what, "material.gel.poisson_ratio is 0.5");
    EXPECT_EQ(nu.allowed, "a number greater than -1 and less than 0.5");
    EXPECT_EQ(errorsOf(with("youngs_modulus = 1e5", "youngs_modulus = 0")).size(), 1u);
    EXPECT_EQ(errorsOf(with("density = 1000", "density = -1")).size(), 1u);
    EXPECT_EQ(errorsOf(with("voxel_size = 0.05", "voxel_size = 0.05\nhalf_width = 2")).size(), 1u);
    EXPECT_EQ(errorsOf(with("voxel_size = 0.05", "voxel_size = 0.05\nhalf_width = 11")).size(), 1u);
    EXPECT_EQ(errorsOf(with("[1, 2, 1]", "[1, nan, 1]")).size(), 1u);
    EXPECT_EQ(errorsOf(with("[0, 0.1, 0]", "[0, inf, 0]")).size(), 1u);
}

TEST(SceneReader, FramesDoNotRunBackwards)
{
    const auto d = onlyError(with("[1, 12]", "[12, 1]"), "dir/s.toml:4:10");
    EXPECT_EQ(d.what, "time.frames is [12, 1]");
    EXPECT_EQ(d.hint, "swap them");
    EXPECT_TRUE(errorsOf(with("[1, 12]", "[5, 5]")).empty());
    onlyError(with("[1, 12]", "[1]"), "dir/s.toml:4:10");
    onlyError(with("[1, 12]", "[1, 2.5]"), "dir/s.toml:4:14");
}

TEST(SceneReader, OnlyVersionOneIsRead)
{
    EXPECT_EQ(onlyError(with("version = 1", "version = 2"), "dir/s.toml:1:11").what, "version is 2");
}

TEST(SceneReader, MissingTablesAndKeysAreNamed)
{
    const Details empty = errorsOf("");
    ASSERT_EQ(empty.size(), 2u);
    EXPECT_EQ(empty[0].what, "the scene lacks a table [grid]");
    EXPECT_EQ(empty[1].what, "the scene lacks a table [[body]]");
    EXPECT_EQ(empty[0].place, "dir/s.toml:1:1");
    const auto d = onlyError(with("density = 1000\n", ""), "dir/s.toml:12:1");
    EXPECT_EQ(d.what, "[material.gel] lacks the key 'density'");
    onlyError(with("shape = { box = { size = [1, 2, 1] } }\n", ""), "dir/s.toml:8:1");
    onlyError(with("move = { velocity = [0, 0.1, 0] }\n", ""), "dir/s.toml:16:1");
    EXPECT_EQ(errorsOf("body = []\ngrid.voxel_size = 1").size(), 1u);
}

TEST(SceneReader, NamesThatReferHaveToExist)
{
    const auto material = onlyError(with("material = \"gel\"", "material = \"gell\""), "dir/s.toml:11:12");
    EXPECT_EQ(material.what, "unknown material \"gell\" in body.0");
    EXPECT_EQ(material.allowed, "one of gel");
    EXPECT_EQ(material.hint, "did you mean 'gel'?");
    onlyError(with("body = \"left\"", "body = \"right\""), "dir/s.toml:17:8");
}

TEST(SceneReader, NamesOfBodiesAndGripsAreTheirOwn)
{
    const std::string body = "[[body]]\nname = \"left\"\nmaterial = \"gel\"\nshape.sphere.radius = 1\n";
    EXPECT_TRUE(contains(onlyError(kGood + body, "dir/s.toml:21:8").what, "taken"));
    const std::string unnamed = "[[grip]]\nbody = \"left\"\nregion.sphere.radius = 1\nmove.force = [1, 0, 0]\n";
    const std::string grip = unnamed + "name = \"NAME\"\n";
    EXPECT_EQ(errorsOf(kGood + grip + grip).size(), 1u);
    std::string first = grip;
    first.replace(first.find("NAME"), 4, "grip2");
    const Scene s = parse(kGood + first + unnamed);
    EXPECT_EQ(s.grips[2].name, "grip3");
}

TEST(SceneReader, AShapeIsExactlyOneBoundedSolidOrFile)
{
    const std::string shape = "{ box = { size = [1, 2, 1] } }";
    EXPECT_EQ(onlyError(with(shape, "{ bx = { size = [1, 2, 1] } }"), "dir/s.toml:10:11").hint, "did you mean 'box'?");
    onlyError(with(shape, "{ sphere.radius = 1, vdb = \"a.vdb\" }"), "dir/s.toml:10:30");
    onlyError(with(shape, "{ }"), "dir/s.toml:10:9");
    onlyError(with(shape, "\"box\""), "dir/s.toml:10:9");
    onlyError(with(shape, "{ sphere = { radius = 1 }, extra = 1 }"), "dir/s.toml:10:36");
    onlyError(with(shape, "{ mesh = \"\" }"), "dir/s.toml:10:18");
    onlyError(with(shape, "{ mesh = { scale = 2 } }"), "dir/s.toml:10:18");
    const auto halfspace = onlyError(with(shape, "{ halfspace = { normal = \"y\" } }"), "dir/s.toml:10:23");
    EXPECT_TRUE(contains(halfspace.what, "endless"));
    const auto endless = onlyError(with(shape, "{ cylinder = { radius = 1 } }"), "dir/s.toml:10:22");
    EXPECT_TRUE(contains(endless.hint, "height"));
    EXPECT_TRUE(errorsOf(with(shape, "{ cylinder = { radius = 1, height = 2 } }")).empty());
    const std::string cylinder = "[{ cylinder = { radius = 1 } }]";
    EXPECT_EQ(errorsOf(with("name = \"left\"", "name = \"left\"\nadd = " + cylinder)).size(), 1u);
    EXPECT_TRUE(errorsOf(with("name = \"left\"", "name = \"left\"\ncut = " + cylinder)).empty());
}

TEST(SceneReader, DirectionsAreUnitLengthAndNotZero)
{
    onlyError(with("normal = [0, 2, 0]", "normal = [0, 0, 0]"), "dir/s.toml:18:35");
    onlyError(with("normal = [0, 2, 0]", "normal = \"w\""), "dir/s.toml:18:35");
    for (const char* any : {"[1e-300, 0, 0]", "[1e300, 1e300, 0]", "[5e-324, 5e-324, 5e-324]", "[-3, 4, 0]"}) {
        const Scene s = parse(with("normal = [0, 2, 0]", std::string("normal = ") + any));
        EXPECT_NEAR(s.grips[0].region.axis.norm(), 1, 1e-15) << any;
    }
}

TEST(SceneReader, AMotionIsExactlyOneOfThreeAndItsKeysRise)
{
    const std::string move = "{ velocity = [0, 0.1, 0] }";
    onlyError(with(move, "{ velocity = [0, 0.1, 0], force = [0, 0, 0] }"), "dir/s.toml:19:34");
    onlyError(with(move, "{ velocity = [0, 0.1, 0], ramp = 1 }"), "dir/s.toml:19:34");
    onlyError(with(move, "{ ramp = 1 }"), "dir/s.toml:19:10");
    onlyError(with(move, "{ keys = [] }"), "dir/s.toml:19:17");
    const auto d = onlyError(with(move, "{ keys = [{ time = 1 }, { time = 1 }] }"), "dir/s.toml:19:41");
    EXPECT_EQ(d.what, "grip.0.move.keys.1.time is 1");
    onlyError(with(move, "{ keys = [{ translate = [0, 0, 0] }] }"), "dir/s.toml:19:18");
}

TEST(SceneReader, OutputListsTakeEachGridOnce)
{
    const std::string output = "[output]\nvdb = ";
    EXPECT_EQ(onlyError(kGood + output + "[\"phi\", \"phy\"]\n", "dir/s.toml:21:15").hint, "did you mean 'phi'?");
    EXPECT_EQ(errorsOf(kGood + output + "[\"phi\", \"phi\"]\n").size(), 1u);
    EXPECT_EQ(errorsOf(kGood + output + "\"phi\"\n").size(), 1u);
    EXPECT_TRUE(parse(kGood + output + "[]\n").output.vdb.empty());
}

TEST(SceneReader, ACurveIsAListOfTimesAndScalesThatRises)
{
    const std::string pull = kGood + "[pull]\nrate = 1\nkeys = ";
    const Scene s = parse(pull + "[{ time = -1, scale = 1 }, { time = 1, scale = 5 }]\n");
    const Curve& curve = s.effects[0].values.curve("keys");
    EXPECT_EQ(curve, (Curve{{{-1, 1}, {1, 5}}}));
    for (const auto& [time, scale] : {std::pair{-9., 1.}, {-1., 1.}, {0., 3.}, {.5, 4.}, {1., 5.}, {9., 5.}}) EXPECT_EQ(curve.at(time), scale);
    EXPECT_EQ(Curve().at(3), 1);
    EXPECT_EQ(parse(writeScene(s, kEffects)).effects[0].values.curve("keys"), curve);
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

TEST(SceneReader, EverythingWrongIsReportedAtOnceInTheOrderOfTheText)
{
    std::string text = with("version = 1", "version = 3");
    for (const auto& [from, to] : {std::pair<std::string, std::string>{"fps = 25", "fsp = 25"},
                                   {"voxel_size = 0.05", "voxel_size = -1"},
                                   {"material = \"gel\"", "material = \"jelly\""},
                                   {"density = 1000", "density = nan"},
                                   {"[0, 2, 0]", "[0, 0, 0]"}})
        text.replace(text.find(from), from.size(), to);
    const Details d = errorsOf(text, {"time.frames=[3, 2]"});
    std::vector<std::string> places;
    for (const auto& detail : d) places.push_back(detail.place);
    EXPECT_EQ(places, (std::vector<std::string>{"dir/s.toml:1:11", "dir/s.toml:5:1", "dir/s.toml:7:14",
                                                "dir/s.toml:11:12", "dir/s.toml:15:11", "dir/s.toml:18:35",
                                                "--set time.frames"}));
}

TEST(SceneReader, IntegersAreTakenForNumbers)
{
    EXPECT_EQ(parse(with("voxel_size = 0.05", "voxel_size = 2")).grid.voxelSize, 2.0);
}

TEST(SceneOverrides, SetWhatTheTextSetsAndWhatItLeavesOut)
{
    const Scene s = parse(kGood, {"grid.voxel_size=0.02", "name=strip", "material.gel.poisson_ratio = 0.49",
                                  "body.0.velocity=[0,1,0]", "body.left.angular_velocity=[1,0,0]",
                                  "solver.newton_iterations=3", "pull.rate=1", "time.substeps=auto",
                                  "body.0.shape={ sphere = { radius = 2 } }", "body.0.shape.sphere.radius=3"});
    EXPECT_EQ(s.grid.voxelSize, 0.02);
    EXPECT_EQ(s.name, "strip");
    EXPECT_EQ(s.materials[0].poissonRatio, 0.49);
    EXPECT_EQ(s.bodies[0].velocity, Vec3(0, 1, 0));
    EXPECT_EQ(s.bodies[0].angularVelocity, Vec3(1, 0, 0));
    EXPECT_EQ(s.solver.newtonIterations, 3);
    EXPECT_EQ(s.effects.size(), 1u);
    EXPECT_EQ(std::get<Primitive>(s.bodies[0].shape).radius, 3);
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

TEST(SceneWriter, WhatIsWrittenReadsBackTheSame)
{
    for (const std::string& text : {kGood, kRich, exampleText()}) {
        const Scene scene = parse(text);
        const std::string written = writeScene(scene, kEffects);
        const Scene again = parseScene(written, "elsewhere/t.toml", kEffects);
        expectEqual(scene, again);
        EXPECT_EQ(writeScene(again, kEffects), written);
    }
}

TEST(SceneWriter, AnyDirectionReadsBackToTheSameBits)
{
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    Scene scene = parse(kGood);
    for (int i = 0; i < 200; ++i) {
        const std::string vector = std::to_string(normal(random)) + "," + std::to_string(normal(random)) + ",0.1";
        scene = parse(kGood, {"grip.0.region.halfspace.normal=[" + vector + "]"});
        const Scene again = parse(writeScene(scene, {}));
        ASSERT_EQ(scene.grips[0].region.axis, again.grips[0].region.axis) << vector;
    }
}

TEST(SceneWriter, AnEffectWithoutItsTableOfKeysIsRefused)
{
    EXPECT_THROW(writeScene(parse(kRich), {}), Error);
}

TEST(SceneTexts, DefaultsAreASceneOnceTheRequiredKeysAreGiven)
{
    const std::string text = defaultsText(kEffects);
    EXPECT_GT(errorsOf(text).size(), 3u);
    const Scene s = parse(text, {"grid.voxel_size=0.1", "body.0.name=b", "body.0.shape.sphere.radius=1",
                                 "body.0.material=NAME", "material.NAME.youngs_modulus=1e5",
                                 "material.NAME.poisson_ratio=0.3", "material.NAME.density=1000"});
    Scene expected;
    expected.grid.voxelSize = 0.1;
    expectEqualSettings(s, expected);
    for (const Key& key : kPullKeys) EXPECT_TRUE(contains(text, std::string("\n#") + key.name + " =")) << key.name;
    EXPECT_TRUE(contains(text, "\n#[pull]\n"));
}

TEST(SceneTexts, TheExampleIsAScene)
{
    const Scene s = parseScene(exampleText(), "example.toml", {});
    EXPECT_EQ(s.bodies[0].cut.size(), 1u);
    EXPECT_EQ(s.grips.size(), 2u);
}

TEST(SceneTexts, TheSchemaHasEveryTable)
{
    const std::string text = schemaText(kEffects);
    for (const char* name : {"\"version\"", "\"time\"", "\"grid\"", "\"body\"", "\"material\"", "\"grip\"",
                             "\"solver\"", "\"output\"", "\"pull\"", "\"drag\"", "\"halfspace\""})
        EXPECT_TRUE(contains(text, name)) << name;
    EXPECT_TRUE(contains(text, "http://json-schema.org/draft-07/schema#"));
}

TEST(SceneTexts, DefaultsAreWhatTheirOwnKeysTake)
{
    EXPECT_TRUE(errorsOf(kGood + "[solver]\n[output]\n[pull]\nrate = 1\n[drag]\n").empty());
}

/// A Scene or an InputError; all else escapes.
void readAny(const std::string& text)
{
    try {
        const Scene scene = parse(text);
        (void)writeScene(scene, kEffects);
    } catch (const InputError& e) {
        EXPECT_FALSE(e.details().empty());
    }
}

TEST(SceneFuzz, AnyChangedBytesAreASceneOrAnInputError)
{
    std::mt19937 random(1);
    const std::string pieces = "[]{}\"'=.,#\n\r\t\0\\_-+0123456789einfatruex\xff\xc3\xef\xbb";
    for (int i = 0; i < 2000; ++i) {
        std::string text = i % 2 ? kRich : kGood;
        const int changes = 1 + int(random() % 4);
        for (int c = 0; c < changes; ++c) {
            const std::size_t at = random() % text.size();
            const char byte = random() % 2 ? pieces[random() % pieces.size()] : char(random() % 256);
            if (random() % 3 == 0) text.insert(at, 1, byte);
            else if (random() % 2) text[at] = byte;
            else text.erase(at, random() % 8);
        }
        readAny(text);
    }
}

TEST(SceneFuzz, AnyTruncationIsASceneOrAnInputError)
{
    for (std::size_t length = 0; length <= kRich.size(); ++length) readAny(kRich.substr(0, length));
}

TEST(SceneFuzz, HostileTextsAreInputErrors)
{
    constexpr std::size_t kMany = 1 << 20;
    const auto repeated = [](const std::string& piece, std::size_t bytes) {
        std::string text;
        while (text.size() < bytes) text += piece;
        return text;
    };
    const std::vector<std::string> texts = {
        std::string(10, '\0'), std::string("a = \"\0\"", 7), "\xff\xfe", "\xef\xbb\xbf",
        "a = " + std::string(kMany, '['), "a = " + repeated("{a=", kMany), "a = " + repeated("[{a=", kMany),
        repeated("a.", kMany) + "a = 1", "[" + repeated("a.", kMany) + "a]", "[[" + repeated("a.", kMany) + "a]]",
        "a = {" + repeated("\"b\" . ", kMany) + "a = 1}", std::string(kMany, 'a'), "a = " + std::string(kMany, '1'),
        "a = \"" + std::string(kMany, 'x') + "\"", "a = [" + repeated("0,", kMany) + "]",
        repeated("[[body]]\n", kMany / 8),
        "body = [" + repeated("1,", kMany) + "]", "name = \"\"\"a\"\"\"\"\"\n", "''''''.''.a = 1", "a = '''\\'''",
        std::string(kMany, '#'), std::string(kMany, '"'), std::string(kMany, '\'')};
    for (const std::string& text : texts) EXPECT_FALSE(errorsOf(text).empty()) << text.substr(0, 20);
}

TEST(SceneFuzz, CharactersBeyondAsciiStandInQuotesAndCommentsOnly)
{
    const std::string mark = "\xEF\xBB\xBF";
    const std::string e = "\xC3\xA9";
    const std::string wide = "\xE3\x80\x80\xEF\xBF\xBD\xE2\xBF\xBF\xF0\x9F\x98\x80";
    const std::string label = "[pull]\nrate = 1\nlabel = ";
    EXPECT_TRUE(errorsOf(mark + "# " + e + wide + "\n" + kGood + "# " + e).empty());
    for (const std::string quote : {"\"", "'", "\"\"\"", "'''"}) {
        const Scene s = parse(kGood + label + quote + e + wide + quote + " # " + wide + "\n");
        EXPECT_EQ(s.effects[0].values.text("label"), e + wide);
        expectEqual(s, parse(writeScene(s, kEffects)));
    }
    EXPECT_EQ(onlyError(kGood + "[pull]\n\"" + e + "\" = 1\nrate = 1\n", "dir/s.toml:21:1").hint, "");
    onlyError("a" + e + " = 1\n" + kGood, "dir/s.toml:1:2");
    onlyError(kGood + label + e + "\n", "dir/s.toml:22:9");
    for (const std::string gap : {"", " ", "\n  "})
        EXPECT_EQ(errorsOf(kGood + label + "\"\"\"a\\" + gap + e + "\"\"\"\n").size(), 1u);
    EXPECT_EQ(parse(kGood + label + "\"\"\"" + e + "\\\n  b\"\"\"\n").effects[0].values.text("label"), e + "b");
}

TEST(SceneFuzz, DotsInStringsAndCommentsAreNoDeepKeys)
{
    const std::string dots = "a.b.c.d.e.f.g.h.i.j.k.l.m.n.o.p.q.r.s.t.u.v.w.x.y.z";
    EXPECT_TRUE(errorsOf("# " + dots + "\n" + kGood + "[pull]\nrate = 1\nlabel = \"\\\"" + dots + "\"\n").empty());
    EXPECT_TRUE(errorsOf(kGood + "[pull]\nrate = 1\nlabel = '''\n" + dots + "'''\n").empty());
    onlyError("\n  " + dots + " = 1", "dir/s.toml:2:34");
}

}  // namespace
}  // namespace vdbfrac::scene
