// A host that has set a locale with decimal commas: scenes, meshes and runs are read and written as ever.
#include "notched_bar.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/core/branch.h>
#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/scene/reader.h>
#include <vdbfrac/tetmesh/surface_file.h>
#include <vdbfrac/tetmesh/surface_input.h>
#include <vdbfrac/tetmesh/tet_file.h>

#include <gtest/gtest.h>

#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <locale>
#include <map>
#include <sstream>

#include <unistd.h>

using namespace vdbfrac;
using lab::SceneRun;
namespace fs = std::filesystem;

namespace {

using Texts = std::map<std::string, std::string>;

/// 1234567.5 is 1.234.567,5.
class Commas : public std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
};

/// Sets a locale of C with a decimal comma: one that is installed, or one that localedef makes in `folder` where the
/// package `locales` is there. False where there is none.
bool setCommasOfC(const fs::path& folder)
{
    const auto set = [](const char* name) {
        return std::setlocale(LC_ALL, name) && *std::localeconv()->decimal_point == ',';
    };
    for (const char* name :
         {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "fr_FR.utf8", "it_IT.UTF-8", "pl_PL.UTF-8", "ru_RU.UTF-8"})
        if (set(name)) return true;
    const std::string made = folder / "de_DE.UTF-8";
    if (std::system(("localedef --no-archive -i de_DE -f UTF-8 '" + made + "' >/dev/null 2>&1").c_str()) != 0)
        return false;
    ::setenv("LOCPATH", folder.c_str(), 1);
    return set("de_DE.UTF-8");
}

class Locales : public testing::Test {
protected:
    Locales() : classic_(std::locale())
    {
        fs::remove_all(folder_);
        fs::create_directories(folder_ / "locales");
    }
    ~Locales() override
    {
        std::locale::global(classic_);
        std::setlocale(LC_ALL, "C");
        fs::remove_all(folder_);
    }

    void setCommas() const
    {
        std::locale::global(std::locale(std::locale::classic(), new Commas));
        const bool ofC = setCommasOfC(folder_ / "locales");
        if (!ofC) std::printf("no locale with a decimal comma is installed: only streams of C++ have commas here\n");
        std::ostringstream stream;
        stream << 1234.5;
        ASSERT_EQ(stream.str(), "1.234,5") << "the locale is not in force";
        char text[16];
        std::snprintf(text, sizeof text, "%.1f", 1.5);
        ASSERT_EQ(text, std::string(ofC ? "1,5" : "1.5"));
    }

    /// The same texts made in the locale "C" and under commas.
    template <class Make>
    void expectSame(const Make& make) const
    {
        const Texts usual = make();
        setCommas();
        const Texts commas = make();
        ASSERT_EQ(commas.size(), usual.size());
        for (const auto& [name, text] : usual) {
            EXPECT_FALSE(text.empty()) << name;
            ASSERT_TRUE(commas.contains(name)) << name;
            EXPECT_TRUE(commas.at(name) == text) << name << ", with commas:\n"
                                                 << commas.at(name).substr(0, 2000) << "\nwithout:\n"
                                                 << text.substr(0, 2000);
        }
    }

    fs::path folder_ = fs::temp_directory_path() / ("vdbfrac-locale-" + std::to_string(::getpid()));

private:
    std::locale classic_;
};

/// A notched bar that tears within some frames.
const std::string kBar =
    test::NotchedBar{.youngsModulus = "1.234567e5", .density = "1000.5"}.text(std::string(test::kTear) + R"([output]
vdb = ["phi", "energy", "surface", "vel"]
obj = true
)");

/// stats.csv without the columns of seconds.
std::string withoutSeconds(const std::string& csv)
{
    std::istringstream lines(csv);
    std::vector<bool> kept;
    std::string text;
    for (std::string line; std::getline(lines, line); text += '\n') {
        std::istringstream cells(line);
        std::size_t column = 0;
        for (std::string cell; std::getline(cells, cell, ','); ++column) {
            if (kept.size() == column) kept.push_back(!cell.ends_with("_s") || cell == "time_s" || cell == "dt_s");
            if (column < kept.size() && kept[column]) text += cell + ",";
        }
    }
    return text;
}

/// run.json without the checksums of .vdb files, which carry a number of their own each.
std::string withoutChecksums(const std::string& manifest)
{
    std::istringstream lines(manifest);
    std::string text;
    for (std::string line; std::getline(lines, line);)
        if (line.find("\"xxh3\"") == std::string::npos) text += line + '\n';
    return text;
}

TEST_F(Locales, ARunWritesTheSameFiles)
{
    expectSame([&] {
        Texts texts;
        SceneRun run(kBar);
        core::RunFolder out(folder_ / "run", run.scene, run.simulation, core::ExistingRun::replace);
        const std::string settings = scene::writeScene(run.scene, effects::vocabulary());
        for (int frame = 1; frame <= run.scene.time.lastFrame; ++frame) {
            run.toFrame(frame);
            for (std::size_t i = out.steps().size(); i < run.steps.size(); ++i) out.addStep(run.steps[i]);
            out.writeFrame(run.simulation, frame);
        }
        out.finish(run.simulation, "done");
        EXPECT_GT(run.work.countOf("cut", "cells"), 0) << "nothing tears";
        texts["scene"] = settings;
        texts["stats.csv"] = withoutSeconds(readText(folder_ / "run/stats.csv"));
        texts["run.json"] = withoutChecksums(readText(folder_ / "run/run.json"));
        for (const auto& entry : fs::directory_iterator(folder_ / "run/obj"))
            texts[entry.path().filename()] = readText(entry.path());
        EXPECT_GE(texts.size(), 3u + 8u);
        // A body made of what was written.
        const SceneRun again(kBar, {"body.0.shape={ vdb = { file = \"" + (folder_ / "run/vdb/bar.0001.vdb").string() +
                                        "\", grid = \"phi\" } }",
                                    "body.0.cut=[]"});
        texts["state of a .vdb"] = std::to_string(again.simulation.stateHash());
        return texts;
    });
}

TEST_F(Locales, ARunGoesOnFromACheckpointOfAnotherLocale)
{
    const auto settings = [](const SceneRun& run) { return scene::writeScene(run.scene, effects::vocabulary()); };
    std::uint64_t end = 0;
    {
        SceneRun run(kBar);
        core::RunFolder out(folder_ / "run", run.scene, run.simulation, core::ExistingRun::refuse);
        out.writeCheckpoint(run.simulation, settings(run));  // of the bodies at rest
        for (int frame = 1; frame <= 3; ++frame) run.toFrame(frame), out.writeFrame(run.simulation, frame);
        for (const core::StepRecord& step : run.steps) out.addStep(step);
        out.writeCheckpoint(run.simulation, settings(run));
        out.finish(run.simulation, "stopped");
        run.toFrame(5);
        end = run.simulation.stateHash();
    }
    setCommas();
    SceneRun run(kBar);
    core::RunFolder out(folder_ / "run", run.scene, run.simulation, core::ExistingRun::keep);
    std::vector<std::string> notes;
    ASSERT_TRUE(out.resume(run.simulation, {settings(run)}, notes));
    EXPECT_EQ(run.simulation.framesDone(), 2);
    run.toFrame(5);
    EXPECT_EQ(run.simulation.stateHash(), end);
}

TEST_F(Locales, ABranchMayHalveItsVoxels)
{
    setCommas();
    const auto settings = [](const std::string& voxel) {
        return scene::writeScene(SceneRun(kBar, {"grid.voxel_size=" + voxel}).scene, effects::vocabulary());
    };
    EXPECT_TRUE(core::branchBetween(settings("0.1"), settings("0.05")).isFiner);
}

TEST_F(Locales, ScenesReadAndWriteTheSame)
{
    expectSame([] {
        const std::vector<std::string> set = {"grid.voxel_size=0.0333", "fracture.keys=[{ time = 0.25, scale = 1.5 }]",
                                              "body.0.velocity=[1234567.25, -1e-7, 0.1]"};
        const scene::Scene scene = scene::parseScene(kBar, "s.toml", effects::vocabulary(), set);
        EXPECT_EQ(scene.grid.voxelSize, 0.0333);
        EXPECT_EQ(scene.bodies[0].velocity, Vec3(1234567.25, -1e-7, 0.1));
        Texts texts = {{"scene", scene::writeScene(scene, effects::vocabulary())},
                       {"defaults", scene::defaultsText(effects::vocabulary())},
                       {"schema", scene::schemaText(effects::vocabulary())}};
        try {
            scene::parseScene(kBar, "s.toml", effects::vocabulary(),
                              {"grid.voxel_size=-0.25", "material.m.poisson_ratio=0.75", "time.substeps=1234567"});
        } catch (const InputError& e) {
            texts["complaint"] = e.what();
        }
        return texts;
    });
}

/// A tet with corners that are not whole numbers, in all formats that are text.
const std::map<std::string, std::string> kTets = {
    {"a.obj", "v 0.5 0 0\nv 1.25e0 0 0\nv 0 1234.5 0\nv 0 0 1.5\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"},
    {"a.off", "OFF\n4 4 6\n0.5 0 0\n1.25e0 0 0\n0 1234.5 0\n0 0 1.5\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"},
    {"a.ply",
     "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\nelement face "
     "4\n"
     "property list uchar int vertex_indices\nend_header\n0.5 0 0\n1.25e0 0 0\n0 1234.5 0\n0 0 1.5\n3 0 2 1\n3 0 1 "
     "3\n3 0 3 2\n3 1 2 3\n"},
    {"a.stl",
     "solid a\n"
     "facet normal 0 0 0\nouter loop\nvertex 0.5 0 0\nvertex 0 1234.5 0\nvertex 1.25e0 0 0\nendloop\nendfacet\n"
     "facet normal 0 0 0\nouter loop\nvertex 0.5 0 0\nvertex 1.25e0 0 0\nvertex 0 0 1.5\nendloop\nendfacet\n"
     "facet normal 0 0 0\nouter loop\nvertex 0.5 0 0\nvertex 0 0 1.5\nvertex 0 1234.5 0\nendloop\nendfacet\n"
     "facet normal 0 0 0\nouter loop\nvertex 1.25e0 0 0\nvertex 0 1234.5 0\nvertex 0 0 "
     "1.5\nendloop\nendfacet\nendsolid a\n"}};

TEST_F(Locales, MeshesReadAndWriteTheSame)
{
    expectSame([&] {
        Texts texts;
        for (const auto& [name, content] : kTets) {
            writeText(folder_ / name, content);
            const tetmesh::PolygonSoup soup = tetmesh::readSurface(folder_ / name);
            EXPECT_EQ(soup.points.size(), 4u) << name;
            const tetmesh::SurfaceReport report = tetmesh::examine(soup);
            EXPECT_TRUE(report.closed) << name;
            EXPECT_EQ(report.upper, Vec3(1.25, 1234.5, 1.5)) << name;
        }
        tetmesh::TetMesh mesh;
        mesh.points = {{0.5, 0, 0}, {1.25, 0, 0}, {0, 1234567.5, 0}, {0, 0, 1. / 3}};
        mesh.tets = {{0, 1, 2, 3}};
        mesh.boundary = tetmesh::boundaryOf(mesh.tets);
        using tetmesh::TetFormat;
        for (auto format : {TetFormat::vtu, TetFormat::vtk, TetFormat::gmsh41, TetFormat::gmsh22, TetFormat::medit,
                            TetFormat::tetgen})
            writeTets(folder_ / ("tets" + std::to_string(int(format))), format, mesh,
                      {{{"a", {0.5, 1.5, 1e6, 1e-9}}}, {{"b", {1234.5}}}});
        tetmesh::Surface surface;
        surface.points = mesh.points;
        surface.triangles = mesh.boundary;
        surface.fragment.assign(mesh.boundary.size(), 1234);
        surface.torn.assign(mesh.boundary.size(), 0);
        for (const char* name : {"s.obj", "s.ply", "s.stl"}) tetmesh::writeSurface(folder_ / name, surface);
        for (const auto& entry : fs::directory_iterator(folder_))
            if (entry.is_regular_file()) texts[entry.path().filename()] = readText(entry.path());
        EXPECT_GE(texts.size(), 4u + 6u + 3u);
        return texts;
    });
}

/// What a run notes about a scene is for people, and the same for all of them.
TEST_F(Locales, NotesAreTheSame)
{
    expectSame([] {
        const SceneRun thin(kBar, {"body.0.shape.box.size=[0.11, 1.0, 0.11]", "body.0.cut=[]", "time.substeps=1",
                                   "solver.integrator=\"symplectic_euler\"", "fracture.strength=1e4"});
        std::string notes;
        for (const std::string& note : thin.simulation.stages().notes) notes += note + "\n";
        return Texts{{"notes", notes}};
    });
}

}  // namespace
