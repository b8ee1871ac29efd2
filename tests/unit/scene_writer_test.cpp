// Laws of what is written: scenes read back the same, the texts about scenes are right.
#include "scene_equality.h"
#include "scene_texts.h"

#include <cmath>
#include <random>

namespace vdbfrac::scene {
namespace {

using namespace test;

TEST(SceneWriter, WhatIsWrittenReadsBackTheSame)
{
    const std::string graded = with("voxel_size = 0.05", "voxel_size = 0.05\nlattice = \"delaunay\"\ngrading = 2");
    for (const std::string& text : {kGood, kRich, graded, exampleText()}) {
        const Scene scene = parse(text);
        const std::string written = writeScene(scene, kVocabulary);
        const Scene again = parseScene(written, "elsewhere/t.toml", kVocabulary);
        expectEqual(scene, again);
        EXPECT_EQ(writeScene(again, kVocabulary), written);
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
        const Scene again = parse(writeScene(scene, kVocabulary));
        ASSERT_EQ(scene.grips[0].region.axis, again.grips[0].region.axis) << vector;
    }
}

TEST(SceneWriter, ATableThatTheVocabularyLacksIsRefused) { EXPECT_THROW(writeScene(parse(kRich), {}), Error); }

TEST(SceneWriter, AFilledSceneIsCheckedAsAText)
{
    const Scene good = parse(kRich);
    EXPECT_NO_THROW(requireValid(good, kVocabulary));
    Scene bad = good;
    bad.time.fps = std::nan("");
    bad.bodies[0].material = "no such";
    bad.materials[0].poissonRatio = 0.5;
    try {
        requireValid(bad, kVocabulary);
        ADD_FAILURE() << "not refused";
    } catch (const InputError& e) {
        EXPECT_GE(e.details().size(), 2u) << e.what();
    }
}

TEST(SceneTexts, DefaultsAreASceneOnceTheRequiredKeysAreGiven)
{
    const std::string text = defaultsText(kVocabulary);
    EXPECT_GT(errorsOf(text).size(), 3u);
    const Scene s = parse(
        text, {"grid.voxel_size=0.1", "body.0.name=b", "body.0.shape.sphere.radius=1", "body.0.material=NAME",
               "material.NAME.youngs_modulus=1e5", "material.NAME.poisson_ratio=0.3", "material.NAME.density=1000"});
    Scene expected;
    expected.grid.voxelSize = 0.1;
    expectEqualSettings(s, expected);
    for (const Key& key : kPullKeys) EXPECT_TRUE(contains(text, std::string("\n#") + key.name + " =")) << key.name;
    EXPECT_TRUE(contains(text, "\n#[pull]\n"));
}

TEST(SceneTexts, TheExampleIsAScene)
{
    const Scene s = parseScene(exampleText(), "example.toml", kVocabulary);
    EXPECT_EQ(s.bodies[0].cut.size(), 1u);
    EXPECT_EQ(s.grips.size(), 2u);
}

TEST(SceneTexts, TheSchemaHasEveryTable)
{
    const std::string text = schemaText(kVocabulary);
    for (const char* name : {"\"version\"", "\"time\"", "\"grid\"", "\"body\"", "\"material\"", "\"grip\"",
                             "\"collider\"", "\"solver\"", "\"output\"", "\"pull\"", "\"drag\"", "\"halfspace\""})
        EXPECT_TRUE(contains(text, name)) << name;
    EXPECT_TRUE(contains(text, "http://json-schema.org/draft-07/schema#"));
}

TEST(SceneTexts, DefaultsAreWhatTheirOwnKeysTake)
{
    EXPECT_TRUE(errorsOf(kGood + "[solver]\n[output]\n[pull]\nrate = 1\n[drag]\n").empty());
}

}  // namespace
}  // namespace vdbfrac::scene
