// The [study] table: what it holds, what is complained about, that it reads back as it was written.
#include <vdbfrac/lab/study/study_table.h>

#include "scene_texts.h"

#include <cstddef>

namespace vdbfrac::lab::study {
namespace {

using test::contains, test::Details, test::kGood;

scene::Scene parse(const std::string& text) { return test::parse(text, {}, vocabulary()); }
Details errorsOf(const std::string& text) { return test::errorsOf(text, {}, vocabulary()); }
InputError::Detail onlyError(const std::string& text, const std::string& place)
{
    return test::onlyError(text, place, vocabulary());
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

TEST(StudyTable, IsReadWithWhatCanBeLeftOut)
{
    const Spec s = *specOf(parse(kGood + kStudy));
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
    EXPECT_FALSE(specOf(parse(kGood)));
    EXPECT_EQ(specOf(parse(kGood + "[study]\n"))->rounds, Spec().rounds);
}

TEST(StudyTable, ReadsBackAsItWasWritten)
{
    scene::Scene scene = parse(kGood + kStudy);
    const std::string written = writeScene(scene, vocabulary());
    EXPECT_EQ(writeScene(parse(written), vocabulary()), written);
    scene.notes = {tableOf(*specOf(scene))};
    EXPECT_EQ(writeScene(scene, vocabulary()), written);
    EXPECT_TRUE(contains(written, "values = [1, 2.5, \"auto\", true]")) << written;
    EXPECT_TRUE(contains(written, "tied = [{ key = \"time.fps\", values = [1, 2, 3, 4] }]")) << written;
    EXPECT_TRUE(contains(written, "exact = 0\n")) << written;
}

TEST(StudyTable, AMeasureHasWhatItsQuantityNeedsAndNothingElse)
{
    EXPECT_EQ(onlyError(withStudy("\"load_peak\"", "\"load_peek\""), "dir/s.toml:39:12").hint,
              "did you mean 'load_peak'?");
    EXPECT_TRUE(
        contains(onlyError(withStudy("point = [0, 1, 0]\n", ""), "dir/s.toml:31:1").what, "lacks the key 'point'"));
    EXPECT_TRUE(contains(onlyError(withStudy("\"load_peak\"", "\"volume\"\ngrip = \"grip1\""), "dir/s.toml:40:8").what,
                         "means nothing"));
    EXPECT_EQ(onlyError(withStudy("\"load_peak\"", "\"load_peak\"\ngrip = \"grip2\""), "dir/s.toml:40:8").hint,
              "did you mean 'grip1'?");
    onlyError(withStudy("scale = 0.5\n", ""), "dir/s.toml:36:9");
    onlyError(withStudy("\"load_peak\"", "\"load_peak\"\nname = \"tip\""), "dir/s.toml:40:8");
}

TEST(StudyTable, AmongSeveralGripsTheOneIsNamed)
{
    const std::string grip = "[[grip]]\nbody = \"left\"\nregion.sphere.radius = 1\nmove.force = [1, 0, 0]\n";
    const Details d = errorsOf(kGood + grip + kStudy);
    ASSERT_EQ(d.size(), 1u);
    EXPECT_TRUE(contains(d[0].what, "lacks the key 'grip'")) << d[0].what;
    EXPECT_EQ(d[0].allowed, "one of grip1, grip2");
}

TEST(StudyTable, ASeriesHasValuesAndWhatIsTiedToItHasAsMany)
{
    onlyError(withStudy("values = [1, 2.5, \"auto\", true]", "values = 1"), "dir/s.toml:27:10");
    onlyError(withStudy("values = [1, 2.5, \"auto\", true]", "values = [1, 2, 3, [4]]"), "dir/s.toml:27:20");
    EXPECT_TRUE(contains(onlyError(withStudy("[1, 2, 3, 4]", "[1, 2]"), "dir/s.toml:28:9").what, "has 2 values"));
    EXPECT_EQ(onlyError(withStudy("refines = \"up\"", "refines = \"upp\""), "dir/s.toml:29:11").hint,
              "did you mean 'up'?");
    EXPECT_EQ(onlyError(withStudy("[[study.series]]", "[[study.serie]]"), "dir/s.toml:23:9").hint,
              "did you mean 'series'?");
    EXPECT_TRUE(contains(onlyError(kGood + "[study]\nseries = 3\n", "dir/s.toml:21:10").allowed, "table"));
}

}  // namespace
}  // namespace vdbfrac::lab::study
