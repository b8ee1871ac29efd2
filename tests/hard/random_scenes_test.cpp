// Scenes by the dice under the laws that hold for all of them, and those that once broke one.
#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/lab/verify/energy_witness.h>
#include <vdbfrac/lab/verify/random_scene.h>
#include <vdbfrac/lab/verify/scene_laws.h>

#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

using namespace vdbfrac;
using namespace vdbfrac::lab::verify;

namespace {

constexpr std::uint64_t kFirstSeed = 1;
constexpr int kScenes = 40, kTests = 8;  // so that ctest can run them side by side

class RandomScenes : public testing::TestWithParam<int> {};

TEST_P(RandomScenes, KeepTheLaws)
{
    for (int n = GetParam(); n < kScenes; n += kTests) {
        const std::uint64_t seed = kFirstSeed + std::uint64_t(n);
        const SceneOutcome outcome = runUnderLaws(randomScene(seed), n % 10 == 0);
        EXPECT_EQ(outcome.broken, "") << "seed " << seed;
        EXPECT_FALSE(outcome.refused) << "seed " << seed << ": " << outcome.refusal;
        EXPECT_GT(outcome.steps, 0) << "seed " << seed;
    }
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomScenes, testing::Range(0, kTests));

TEST(RandomScene, IsTheSameForASeedAndAnotherForAnother)
{
    std::set<std::string> scenes;
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
        EXPECT_EQ(randomScene(seed), randomScene(seed));
        scenes.insert(randomScene(seed));
    }
    EXPECT_EQ(scenes.size(), 50u);
}

std::vector<std::string> sceneFiles()
{
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(VDBFRAC_SOURCE "/tests/hard/scenes"))
        names.push_back(entry.path().stem());
    return names;
}

class OnceBroken : public testing::TestWithParam<std::string> {};

TEST_P(OnceBroken, KeepsTheLaws)
{
    const auto outcome = runUnderLaws(readText(VDBFRAC_SOURCE "/tests/hard/scenes/" + GetParam() + ".toml"), true);
    EXPECT_EQ(outcome.broken, "");
    EXPECT_FALSE(outcome.refused) << outcome.refusal;
}

INSTANTIATE_TEST_SUITE_P(Scenes, OnceBroken, testing::ValuesIn(sceneFiles()),
                         [](const auto& info) { return info.param; });

/// Compressed tets of a cell turn apart until their rotations have no mean worth the name. Multigrid, which has nothing
/// else, must not follow a direction that only the mean takes for soft: steps would be halved without end.
TEST(OnceLost, MultigridWhereTheTetsOfACellTurnApart)
{
    constexpr std::size_t kMax = 150;  // steps; 60 are needed
    lab::SceneRun run(readText(VDBFRAC_SOURCE "/tests/hard/scenes/compressed_and_turning.toml"),
                      {"solver.linear_solver=\"multigrid\""});
    while (!run.atEnd() && run.steps.size() < kMax) run.step();
    EXPECT_TRUE(run.atEnd()) << run.simulation.framesDone() << " frames in " << run.steps.size() << " steps";
}

/// A bar that swings: energy goes to and fro between speed and strain.
const std::string kSwinging = R"(
[time]
frames = [1, 20]
fps = 24
substeps = 1
[grid]
voxel_size = 0.1
[[body]]
name = "bar"
shape = { box = { size = [0.4, 1, 0.4] } }
velocity = [2, 0, 0]
material = "m"
[material.m]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
[[grip]]
body = "bar"
region = { halfspace = { normal = [0, -1, 0], offset = 0.4 } }
move = { velocity = [0, 0, 0] }
)";

TEST(SceneLaws, HoldForASceneThatIsSolved)
{
    const SceneOutcome outcome = runUnderLaws(kSwinging);
    EXPECT_EQ(outcome.broken, "");
    EXPECT_EQ(outcome.converged, 19);
}

/// What grips give to a step is energy from nowhere to a witness who does not know them.
TEST(EnergyWitness, SeesEnergyThatNoWorkAccountsFor)
{
    const std::string pushed = kSwinging + R"([[grip]]
body = "bar"
region = { halfspace = { normal = [0, 1, 0], offset = 0.4 } }
move = { force = [300, 0, 0] }
)";
    const auto growth = [&](bool knowsGrips) {
        EnergyWitness witness;
        lab::SceneRun run(pushed, {"body.bar.velocity=[0, 0, 0]"}, &witness);
        scene::Scene known = run.scene;
        if (!knowsGrips) known.grips.clear();
        witness.watch(run.simulation, known);
        run.step();
        EXPECT_GT(witness.balance().turnover, 0);
        return witness.balance().growth / witness.balance().turnover;
    };
    EXPECT_LE(growth(true), 0);  // backward Euler loses a part
    EXPECT_GT(growth(false), .5);
}

TEST(SceneLaws, CountScenesThatAreRefused)
{
    const SceneOutcome outcome = runUnderLaws(kSwinging + "[nonsense]\n");
    EXPECT_TRUE(outcome.refused);
    EXPECT_NE(outcome.refusal.find("nonsense"), std::string::npos) << outcome.refusal;
    EXPECT_EQ(outcome.broken, "");
}

}  // namespace
