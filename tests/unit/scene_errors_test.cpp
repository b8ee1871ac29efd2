// Laws of the scene reader: what is complained about, where, and with which hint.
#include "scene_texts.h"

namespace vdbfrac::scene {
namespace {

using namespace test;

TEST(SceneReader, ACheckOfSeveralKeysComplainsAtTheTable)
{
    const auto d = onlyError(kGood + "[pull]\nrate = 6\nmode = \"hard\"\n", "dir/s.toml:20:1");
    EXPECT_TRUE(contains(d.what, "goes with mode")) << d.what;
    onlyError(with("voxel_size = 0.05", "voxel_size = 0.05\nlattice = \"five\"\ncoarsening = 2"), "dir/s.toml:6:1");
}

TEST(SceneReader, CoarserLatticesThanThereAreNameTheLimit)
{
    for (const char* much : {"20", "40", "1024", "0"}) {
        const auto d = onlyError(with("voxel_size = 0.05", std::string("voxel_size = 0.05\ncoarsening = ") + much),
                                 "dir/s.toml:8:14");
        EXPECT_EQ(d.what, std::string("grid.coarsening is ") + much);
        EXPECT_TRUE(contains(d.allowed, "1 to 19")) << d.allowed;
    }
    EXPECT_EQ(parse(with("voxel_size = 0.05", "voxel_size = 0.05\ncoarsening = 19")).grid.coarsening, 19);
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
    EXPECT_EQ(broken[0].hint, "");
    const auto lines = onlyError(with("size = [1, 2, 1]", "size = [1, 2, 1],\n"), "dir/s.toml:10:36");
    EXPECT_TRUE(contains(lines.hint, "ends on the line it begins on")) << lines.hint;
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
    EXPECT_EQ(places,
              (std::vector<std::string>{"dir/s.toml:1:11", "dir/s.toml:5:1", "dir/s.toml:7:14", "dir/s.toml:11:12",
                                        "dir/s.toml:15:11", "dir/s.toml:18:35", "--set time.frames"}));
}

}  // namespace
}  // namespace vdbfrac::scene
