// The stages of a step one at a time, on a ball: level set, cut, re-cut of what changed, surface, files.
#include "ball.h"
#include "bench.h"

#include "../scratch.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/grid/vdb_file.h>
#include <vdbfrac/tetmesh/embedding.h>
#include <vdbfrac/tetmesh/fragments.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <fmt/format.h>

#include <chrono>
#include <limits>

namespace vdbfrac::tools::bench {

namespace {

constexpr int kRepetitions = 3;  // the best one counts

/// Times stages and collects the results.
class Stopwatch {
public:
    explicit Stopwatch(const Say& say) : say_(say) {}

    /// Runs `work` on fresh input from `prepare`; work returns how many of `unit` it dealt with.
    template <class Prepare, class Work>
    void measure(const std::string& stage, const std::string& unit, const Prepare& prepare, const Work& work)
    {
        double best = std::numeric_limits<double>::infinity();
        std::int64_t count = 0;
        for (int r = 0; r < kRepetitions; ++r) {
            auto input = prepare();
            const auto start = std::chrono::steady_clock::now();
            count = std::int64_t(work(input));
            best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
        }
        const double each = count > 0 ? 1e9 * best / double(count) : 0;
        results_.push_back(
            {{"stage", stage}, {"unit", unit}, {"count", count}, {"seconds", best}, {"ns_a_unit", each}});
        say_(fmt::format("stage {}: {:.0f} ns a {} ({} of them)", stage, each, unit, count));
    }

    const Json& results() const { return results_; }

private:
    const Say& say_;
    Json results_ = Json::array();
};

struct Nothing {};

/// Half a voxel off the surface within a cap of the ball: about what a crack front does in a step.
grid::PhiChanges raisedCap(const grid::LevelSet& phi)
{
    const double dx = phi.voxelSize();
    const int reach = int(kBallRadius / dx) + 2, low = int(0.35 / dx);  // voxels; the cap is x > .35 m
    std::vector<Coord> voxels;
    for (int z = -reach; z <= reach; ++z)
        for (int y = -reach; y <= reach; ++y)
            for (int x = low; x <= reach; ++x) voxels.push_back({x, y, z});
    grid::PhiChanges raised;
    for (const grid::BandSample& s : grid::sampleBand(phi, voxels))
        if (s.phi < 0 && s.phi > -dx) raised.emplace_back(s.voxel, s.phi + float(0.5 * dx));
    return raised;
}

void measureCut(Stopwatch& watch, const grid::LevelSet& ball, const tetmesh::Lattice& lattice)
{
    watch.measure(
        "cut", "cell", [&] { return grid::sampleNodes(ball); },
        [&](tetmesh::NodeField<float>& phi) { return tetmesh::CutMesh(lattice, std::move(phi)).cells().size(); });

    grid::LevelSet torn = ball.copy();
    grid::RelevelWork ignored;
    const grid::PhiChanges changes = grid::raiseAndRelevel(torn, raisedCap(ball), ignored);
    const tetmesh::CutMesh whole(lattice, grid::sampleNodes(ball));
    watch.measure(
        "re-cut", "changed cell", [&] { return whole; },
        [&](tetmesh::CutMesh& mesh) { return mesh.update(changes).cutCells; });
}

void measureOutput(Stopwatch& watch, const grid::LevelSet& ball, const tetmesh::CutMesh& mesh)
{
    watch.measure(
        "surface", "triangle", [] { return Nothing{}; },
        [&](Nothing) { return tetmesh::extractSurface(mesh).triangles.size(); });

    std::uint32_t nextId = 0;
    const tetmesh::FragmentTracker fragments(mesh, nextId);
    const tetmesh::Surface surface =
        tetmesh::deform(tetmesh::extractSurface(mesh), tetmesh::restPositions(mesh), fragments.ofNode());
    const ScratchFolder folder;
    watch.measure(
        "write .obj", "triangle", [] { return Nothing{}; },
        [&](Nothing) {
            tetmesh::writeObj(folder.path() / "ball.obj", surface, "ball.mtl");
            return surface.triangles.size();
        });
    watch.measure(
        "write .vdb", "voxel",
        [&] {
            std::vector<grid::NamedGrid> grids(1);
            grids[0].name = "phi", grids[0].levelSet = &ball, grids[0].unit = "m";
            return grids;
        },
        [&](const std::vector<grid::NamedGrid>& grids) {
            grid::writeVdb(folder.path() / "ball.vdb", grids, {});
            return ball.activeVoxels();
        });
}

}  // namespace

Json benchStages(int voxels, const Say& say)
{
    const double dx = 2 * kBallRadius / voxels;
    Stopwatch watch(say);
    watch.measure(
        "level set", "voxel", [] { return Nothing{}; }, [&](Nothing) { return makeBall(dx).activeVoxels(); });

    const grid::LevelSet ball = makeBall(dx);
    const grid::PhiChanges raised = raisedCap(ball);
    watch.measure(
        "relevel", "voxel", [&] { return ball.copy(); },
        [&](grid::LevelSet& phi) {
            grid::RelevelWork work;
            (void)grid::raiseAndRelevel(phi, raised, work);
            return work.voxels;
        });
    const tetmesh::Lattice lattice{tetmesh::Lattice::Kind::six, 1, dx};
    measureCut(watch, ball, lattice);
    measureOutput(watch, ball, tetmesh::CutMesh(lattice, grid::sampleNodes(ball)));
    return {{"voxels_across", voxels}, {"threads", threadCount()}, {"stages", watch.results()}};
}

}  // namespace vdbfrac::tools::bench
