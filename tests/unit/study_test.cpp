// From runs to errors, costs and advice, on data whose answers are known; and from a scene to runs.
#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/lab/study/analysis.h>
#include <vdbfrac/lab/study/one_run.h>
#include <vdbfrac/lab/study/output.h>
#include <vdbfrac/lab/study/plan.h>

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include <unistd.h>

namespace vdbfrac::lab::study {
namespace {

constexpr double kRounding = 1e-9;  // of pow and log

/// A study of one measure whose runs have these values: series by series, value = f(h) of each h.
class AnalysisTest : public testing::Test {
protected:
    AnalysisTest()
    {
        study_.name = "test";
        study_.spec.measures.push_back({});
        study_.spec.measures[0].name = study_.spec.measures[0].quantity = "volume";
    }
    void addSeries(const std::string& key, const std::vector<std::pair<double, double>>& valuesOfH,
                   std::optional<std::size_t> firstIsRun = {})
    {
        Spec::Series series;
        series.name = key;
        series.key = key;
        series.refines = "down";
        for (std::size_t level = 0; level < valuesOfH.size(); ++level) {
            const auto [h, value] = valuesOfH[level];
            series.values.push_back(std::to_string(h));
            if (level > 0 || !firstIsRun) addRun(value, std::int64_t(1000 / h));
            const std::size_t run = level == 0 && firstIsRun ? *firstIsRun : study_.runs.size() - 1;
            study_.settings.push_back({study_.spec.series.size(), level, run, key + " = " + series.values.back()});
        }
        study_.spec.series.push_back(series);
    }
    void addRun(double value, std::int64_t work)
    {
        study_.runs.emplace_back();
        study_.runs.back().result.values = {{{value}}};
        study_.runs.back().result.work = {{"evaluated_tets", work}};
    }
    Study study_;
};

TEST_F(AnalysisTest, ErrorsAreRelativeToTheExactValue)
{
    study_.spec.measures[0].exact = 2;
    addSeries("h", {{1, 3}, {.5, 2.5}, {.25, 2.25}});
    const Analysis a = analyse(study_, 0);
    EXPECT_EQ(a.references[0].kind, Reference::Kind::exact);
    EXPECT_EQ(a.errors[0][0].value, .5);
    EXPECT_EQ(a.errors[2][0].value, .125);
    EXPECT_NEAR(*a.orders[0][0].fit, 1, kRounding);
    EXPECT_NEAR(*a.orders[0][0].own, 1, kRounding);
    EXPECT_EQ(a.front, (std::vector<std::size_t>{0, 1, 2}));
    EXPECT_EQ(cheapestFor(study_, a, 0, .3), 1u);
    EXPECT_FALSE(cheapestFor(study_, a, 0, .1));
    study_.spec.measures[0].scale = 4;
    EXPECT_EQ(analyse(study_, 0).errors[0][0].value, .25);
}

TEST_F(AnalysisTest, WithoutOneTheReferenceIsExtrapolatedAndNearErrorsAreWeak)
{
    addSeries("h", {{1, 3}, {.5, 2.5}, {.25, 2.25}, {.125, 2.125}, {.0625, 2.0625}});
    addSeries("another key", {{1, 2.001}});
    const Analysis a = analyse(study_, 0);
    EXPECT_EQ(a.references[0].kind, Reference::Kind::extrapolated);
    EXPECT_NEAR(a.references[0].value.numbers[0], 2, 10 * kRounding);
    for (std::size_t level = 0; level < 5; ++level) EXPECT_FALSE(a.errors[level][0].weak) << level;
    EXPECT_TRUE(a.errors[5][0].weak);
}

/// Where errors change their sign, a coarse setting is near by chance: no choice goes by it.
TEST_F(AnalysisTest, WhatIsNearByChanceIsNotChosen)
{
    study_.spec.measures[0].exact = 2;
    addSeries("h", {{1, 3}, {.5, 2.001}, {.25, 1.8}, {.125, 1.9}});
    const Analysis a = analyse(study_, 0);
    EXPECT_FALSE(a.errors[0][0].byChance);
    EXPECT_TRUE(a.errors[1][0].byChance);
    EXPECT_FALSE(a.errors[2][0].byChance);
    EXPECT_EQ(a.errors[1][0].trusted(), a.errors[2][0].value);
    EXPECT_EQ(cheapestFor(study_, a, 0, .06), 3u);
    EXPECT_EQ(cheapestFor(study_, a, 0, .2), 1u);
}

TEST_F(AnalysisTest, OfSeriesOfOneKeyTheSurestLimitIsTheReference)
{
    addSeries("h", {{1, 4}, {.5, 3.2}, {.25, 2.7}});
    addSeries("h", {{1, 3}, {.5, 2.5}, {.25, 2.25}, {.125, 2.125}});
    addSeries("h", {{1, 2.4}, {.5, 2.3}, {.25, 2.24}, {.125, 2.2}, {.0625, 2.17}});  // most work
    const Analysis a = analyse(study_, 0);
    EXPECT_EQ(a.references[0].series, std::vector<std::size_t>{1});
    EXPECT_NEAR(a.references[0].value.numbers[0], 2, 10 * kRounding);
}

TEST_F(AnalysisTest, ThreeLevelsLeaveAllErrorsWeak)
{
    addSeries("h", {{1, 3}, {.5, 2.5}, {.25, 2.25}});
    const Analysis a = analyse(study_, 0);
    EXPECT_EQ(a.references[0].kind, Reference::Kind::extrapolated);
    for (const auto& errors : a.errors) EXPECT_TRUE(errors[0].weak);
    EXPECT_FALSE(a.orders[0][0].fit);  // of weak errors there is no slope
    EXPECT_TRUE(a.orders[0][0].own);
}

TEST_F(AnalysisTest, SeriesOfAnotherKeyCorrectTheReference)
{
    // f = 2 + h + k: with k = 1 the limit in h is 3, and k would take 1 off
    addSeries("h", {{1, 4}, {.5, 3.5}, {.25, 3.25}, {.125, 3.125}});
    addSeries("k", {{1, 4}, {.5, 3.5}, {.25, 3.25}}, 0);
    const Analysis a = analyse(study_, 0);
    EXPECT_EQ(a.references[0].series, (std::vector<std::size_t>{0, 1}));
    EXPECT_NEAR(a.references[0].value.numbers[0], 2, 100 * kRounding);
    study_.spec.series[1].key = "h";  // another way through the same key counts once
    EXPECT_NEAR(analyse(study_, 0).references[0].value.numbers[0], 3, 100 * kRounding);
}

TEST_F(AnalysisTest, ElseItIsTheRunOfMostWorkWhichHasNoErrorThen)
{
    addSeries("h", {{1, 3}, {.5, 1}, {.25, 2}});
    const Analysis a = analyse(study_, 0);
    EXPECT_EQ(a.references[0].kind, Reference::Kind::finest);
    EXPECT_EQ(a.references[0].run, 2u);
    EXPECT_FALSE(a.errors[2][0].value);
    EXPECT_EQ(a.errors[0][0].value, .5);
}

TEST_F(AnalysisTest, RunsThatFailedOrDidNotConvergeAreNotCompared)
{
    study_.spec.measures[0].exact = 2;
    addSeries("h", {{1, 3}, {.5, 2.5}, {.25, 2}});
    study_.runs[0].result.failure = "crashed";
    study_.runs[2].result.cappedSteps = 3;
    const Analysis a = analyse(study_, 0);
    EXPECT_FALSE(a.errors[0][0].value);
    EXPECT_FALSE(a.errors[2][0].value);
    EXPECT_EQ(a.front, (std::vector<std::size_t>{1}));
    EXPECT_NE(tableText(study_, a).find("failed: crashed"), std::string::npos);
    EXPECT_NE(tableText(study_, a).find("3 of 0 steps did not converge"), std::string::npos);
    const std::string svg = svgText(study_, a);
    const std::size_t reason = svg.find("Not shown: h, h = 1.000000: crashed");
    EXPECT_NE(reason, std::string::npos);
    EXPECT_LT(svg.find("Reference: exact"), reason);
}

TEST_F(AnalysisTest, AnAnswerIsNearForSure)
{
    addSeries("h", {{1, 2.9}, {.5, 2.45}, {.25, 2.23}, {.125, 2.12}});  // to about 2
    const Analysis a = analyse(study_, 0);
    const Error& finest = a.errors[3][0];
    ASSERT_TRUE(finest.value);
    EXPECT_GT(finest.atMost, *finest.value);
    EXPECT_FALSE(cheapestFor(study_, a, 0, *finest.value));
    EXPECT_EQ(cheapestFor(study_, a, 0, finest.atMost), 3u);
}

TEST_F(AnalysisTest, WhatComesApartOtherwiseIsNoAnswer)
{
    study_.spec.measures[0].exact = 2;
    study_.spec.measures.push_back({});
    study_.spec.measures[1].name = study_.spec.measures[1].quantity = "fragments";
    addSeries("h", {{1, 2.001}, {.5, 2.1}, {.25, 2.2}});
    for (std::size_t i = 0; i < 3; ++i) study_.runs[i].result.values.push_back({{i == 0 ? 1. : 2.}});
    const Analysis a = analyse(study_, 0);
    EXPECT_EQ(cheapestFor(study_, a, 0, .2), 1u);
    EXPECT_EQ(a.front, (std::vector<std::size_t>{1}));
}

TEST_F(AnalysisTest, TimesAreComparedWithinARound)
{
    study_.spec.measures[0].exact = 2;
    addSeries("h", {{1, 3}, {.5, 2.5}});
    study_.runs[0].seconds = {1, 10, 2, 1, 1};  // the machine was busy in the second round
    study_.runs[1].seconds = {3, 30, 6, 3, 3.5};
    const Analysis a = analyse(study_, 0);
    EXPECT_EQ(a.cost[1]->median, 3);
    EXPECT_EQ(a.cost[1]->high, 3.5);
    EXPECT_EQ(a.cost[0]->median, 1);
}

TEST_F(AnalysisTest, ARoundThatDidNotEndCostsOnlyItsOwnTime)
{
    study_.spec.measures[0].exact = 2;
    addSeries("h", {{1, 3}, {.5, 2.5}, {.25, 2.2}});
    study_.runs[0].seconds = {1, 1, 10};
    study_.runs[1].seconds = {2, NAN, 20};
    study_.runs[2].seconds = {3, 3, 30};
    const Analysis a = analyse(study_, 0);
    EXPECT_EQ(a.cost[1]->median, 2);
    EXPECT_EQ(a.cost[1]->high, 2);  // by its place among those left the third round of one is the second of the other
    EXPECT_EQ(a.cost[2]->median, 3);
    EXPECT_EQ(study_.runs[1].timed(), (std::vector<double>{2, 20}));
    study_.runs[1].seconds = {NAN, NAN, NAN};
    EXPECT_FALSE(analyse(study_, 0).cost[1]);
}

TEST_F(AnalysisTest, TimesAreRelativeToTheFirstThatWasSolved)
{
    study_.spec.measures[0].exact = 2;
    addSeries("h", {{1, 3}, {.5, 2.5}, {.25, 2.2}});
    study_.runs[0].result.failure = "crashed";
    study_.runs[1].seconds = {2, 2, 2};
    study_.runs[2].seconds = {6, 6, 6};
    const Analysis a = analyse(study_, 0);
    EXPECT_FALSE(a.cost[0]);
    EXPECT_EQ(a.cost[1]->median, 1);
    EXPECT_EQ(a.cost[2]->median, 3);
    EXPECT_NE(tableText(study_, a).find("relative to the first setting that was solved, h = 0.5"), std::string::npos);
}

TEST_F(AnalysisTest, WhereNobodySaysWhichValuesAreFinerItIsThoseOfMoreWork)
{
    addSeries("h", {{1, 3}, {.5, 2.5}});
    study_.spec.series[0].refines = "auto";
    EXPECT_EQ(analyse(study_, 0).h[1], .5);
    std::swap(study_.runs[0].result.work, study_.runs[1].result.work);
    EXPECT_EQ(analyse(study_, 0).h[1], 2);
}

TEST_F(AnalysisTest, TextsHaveErrorsButNoOrder)
{
    study_.spec.measures[0].exact = 2;
    addSeries("solver", {{1, 3}, {.5, 2.5}, {.25, 2.25}});
    study_.spec.series[0].values = {"\"a\"", "\"b\"", "true"};
    const Analysis a = analyse(study_, 0);
    EXPECT_EQ(a.errors[0][0].value, .5);
    EXPECT_FALSE(a.h[0]);
    EXPECT_FALSE(a.orders[0][0].fit || a.orders[0][0].own);
    EXPECT_TRUE(refinementsOfBase(study_, a).empty());
}

TEST_F(AnalysisTest, MassesAreComparedAsLists)
{
    study_.spec.measures[0].quantity = "fragment_masses";
    addSeries("h", {{1, 0}, {.5, 0}});
    study_.runs[0].result.values = {{{4}}};
    study_.runs[1].result.values = {{{3, 1}}};
    const Analysis a = analyse(study_, 0);
    EXPECT_EQ(a.references[0].kind, Reference::Kind::finest);
    EXPECT_EQ(a.errors[0][0].value, .25);
}

TEST_F(AnalysisTest, TheKeyThatMattersMostComesFirst)
{
    study_.spec.measures[0].exact = 2;
    addSeries("h", {{1, 4}, {.5, 3.9}});
    addSeries("k", {{1, 4}, {.5, 3}}, 0);
    const auto r = refinementsOfBase(study_, analyse(study_, 0));
    ASSERT_EQ(r.size(), 2u);
    EXPECT_EQ(r[0].series, 1u);
    EXPECT_EQ(r[0].after, .5);
}

TEST(StudyResult, ReadsBackAsItWasWritten)
{
    Result r;
    r.fingerprint = "abc", r.stateHash = "0123", r.cappedSteps = 2, r.seconds = .1, r.peakBytes = 1 << 20,
    r.threads = 2;
    r.values = {{{1. / 3}}, {{3, 2, 1}}, {{}, "after a split"}};
    r.work = {{"steps", 12}, {"evaluated_tets", 1LL << 40}};
    r.stages = {{"solve", .25}};
    const Result back = resultOf(Json::parse(toJson(r).dump()));
    EXPECT_EQ(back.values, r.values);
    EXPECT_EQ(back.work, r.work);
    EXPECT_EQ(back.stages, r.stages);
    EXPECT_EQ(toJson(back), toJson(r));
}

/// What is made of scene and command line.
class PlanTest : public testing::Test {
protected:
    PlanTest() { input_.scene = file_; }
    ~PlanTest() override { std::filesystem::remove(file_); }
    Study plan(const std::string& study = "")
    {
        writeText(file_, kScene + study);
        return makePlan(input_);
    }

    const std::string kScene = R"(grid.voxel_size = 0.1
[[body]]
name = "b"
shape = { box = { size = [1, 1, 1] } }
material = "m"
[material.m]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
)";
    std::filesystem::path file_ =
        std::filesystem::temp_directory_path() / ("vdbfrac-plan-" + std::to_string(::getpid()) + ".toml");
    PlanInput input_;
};

TEST_F(PlanTest, SettingsThatAreTheSameSceneShareARun)
{
    const Study s = plan(
        "[study]\n[[study.series]]\nname = \"a\"\nkey = \"time.substeps\"\nvalues = [1, 2]\n"
        "[[study.series]]\nname = \"b\"\nset = [\"time.substeps=2\"]\nkey = \"grid.coarsening\"\nvalues = [1, 2]\n");
    ASSERT_EQ(s.settings.size(), 4u);
    EXPECT_EQ(s.runs.size(), 3u);
    EXPECT_EQ(s.settings[2].run, s.settings[1].run);
    EXPECT_EQ(s.settings[3].label, "grid.coarsening = 2");
    EXPECT_EQ(s.runs[s.settings[3].run].scene->grid.coarsening, 2);
    EXPECT_EQ(s.runs[s.settings[3].run].scene->time.substeps, 2);
}

TEST_F(PlanTest, ASettingThatIsNoSceneIsAFailureAndNotTheEnd)
{
    input_.vary = {"grid.voxel_size=0.1,0"};
    const Study s = plan();
    EXPECT_TRUE(s.runs[0].scene);
    EXPECT_FALSE(s.runs[1].scene);
    EXPECT_NE(s.runs[1].result.failure.find("voxel_size"), std::string::npos);
}

TEST_F(PlanTest, KeysOfTheCommandLineMakeSeriesOrCombineThem)
{
    input_.vary = {"time.substeps=1,2,3", "solver.linear_solver=jacobi,multigrid"};
    EXPECT_EQ(plan().spec.series.size(), 2u);
    EXPECT_EQ(plan().settings.size(), 5u);
    input_.grid = true;
    const Study s = plan();
    EXPECT_EQ(s.spec.series.size(), 2u);
    EXPECT_EQ(s.settings.size(), 6u);
    EXPECT_EQ(s.spec.series[1].name, "time.substeps, solver.linear_solver=\"multigrid\"");
    EXPECT_EQ(s.runs.back().scene->solver.linearSolver, scene::LinearSolver::multigrid);
}

TEST_F(PlanTest, MeasuresOfTheCommandLineAreReadAsThoseOfAScene)
{
    input_.vary = {"time.substeps=1,2"};
    input_.measure = {"volume", "displacement:name=tip,point=[0.5,0,0],axis=y"};
    const Study s = plan();
    ASSERT_EQ(s.spec.measures.size(), 2u);
    EXPECT_EQ(s.spec.measures[1].name, "tip");
    EXPECT_EQ(s.spec.measures[1].body, "b");
    EXPECT_EQ(*s.spec.measures[1].point, Vec3(.5, 0, 0));
    input_.measure = {"displacement"};
    EXPECT_THROW(plan(), InputError);
    input_.measure = {"volume:nonsense"};
    EXPECT_THROW(plan(), InputError);
}

TEST_F(PlanTest, NothingVariedIsAnError)
{
    EXPECT_THROW(plan(), InputError);
    EXPECT_THROW(plan("[study]\n"), InputError);
}

TEST_F(PlanTest, FingerprintsFollowWhatARunDependsOn)
{
    input_.vary = {"time.substeps=1"};
    const std::string before = plan().runs[0].fingerprint;
    EXPECT_EQ(plan("[output]\nobj = false\n").runs[0].fingerprint, before);  // no frames are written
    EXPECT_NE(plan("[gravity]\n").runs[0].fingerprint, before);
    input_.program = "another";
    EXPECT_NE(plan().runs[0].fingerprint, before);
}

}  // namespace
}  // namespace vdbfrac::lab::study
