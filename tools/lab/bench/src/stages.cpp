// The stages of a step one at a time, on a ball: level set, energy, its transfer, Griffith, re-levelling, cut, re-cut
// of what changed, surface, files; and tets for other programs. Each beside the time in which what it has to read and
// to write once can be moved.
#include "ball.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/griffith.h>
#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/grid/phi_sampler.h>
#include <vdbfrac/grid/transfer.h>
#include <vdbfrac/grid/vdb_file.h>
#include <vdbfrac/lab/bench/bench.h>
#include <vdbfrac/lab/machine/scratch.h>
#include <vdbfrac/mesher/delaunay.h>
#include <vdbfrac/solver/elastic_operator.h>
#include <vdbfrac/tetmesh/cut_mesh_surface.h>
#include <vdbfrac/tetmesh/fragments.h>
#include <vdbfrac/tetmesh/material_tets.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <fmt/format.h>

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <limits>

namespace vdbfrac::lab::bench {

namespace fs = std::filesystem;

namespace {

constexpr int kRepetitions = 3;  // the best one counts

/// Seconds to write so many bytes to a new file, to sync it and to read it back.
double plainFileSeconds(const fs::path& file, std::size_t bytes)
{
    std::string content(bytes, 'x');
    const auto start = std::chrono::steady_clock::now();
    const int f = ::open(file.c_str(), O_RDWR | O_CREAT | O_TRUNC, 0600);
    const bool done = f >= 0 && ::write(f, content.data(), bytes) == ::ssize_t(bytes) && ::fsync(f) == 0 &&
                      ::pread(f, content.data(), bytes, 0) == ::ssize_t(bytes);
    if (f >= 0) ::close(f);
    if (!done) throw FileError(file.string(), "cannot be written and read back");
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Times stages and collects the results.
class Stopwatch {
public:
    Stopwatch(const Floors& floors, const Say& say) : floors_(floors), say_(say) {}

    /// Runs `work` on fresh input from `prepare`; work returns how many of `unit` it dealt with. `each`: bytes that one
    /// of them has to move.
    template <class Prepare, class Work>
    void measure(const std::string& stage, const std::string& unit, const Traffic& each, const Prepare& prepare,
                 const Work& work)
    {
        const auto [best, count] = timed(prepare, work);
        add(stage, unit, best, count,
            floors_.seconds(threadCount(), {double(count) * each.read, double(count) * each.written}));
    }

    /// The same for a file that `work` writes; its floor is a plain file of the same size.
    template <class Work>
    void measureFile(const std::string& stage, const std::string& unit, const fs::path& file, const Work& work)
    {
        const auto [best, count] = timed([] { return 0; }, [&](int) { return work(file); });
        double floor = std::numeric_limits<double>::infinity();
        for (int r = 0; r < kRepetitions; ++r)
            floor = std::min(floor, plainFileSeconds(file.string() + ".plain", fs::file_size(file)));
        add(stage, unit, best, count, floor);
    }

    const Json& results() const { return results_; }

private:
    struct Timed {
        double seconds;
        std::int64_t count;
    };

    template <class Prepare, class Work>
    static Timed timed(const Prepare& prepare, const Work& work)
    {
        double best = std::numeric_limits<double>::infinity();
        std::int64_t count = 0;
        for (int r = 0; r < kRepetitions; ++r) {
            auto input = prepare();
            const auto start = std::chrono::steady_clock::now();
            count = std::int64_t(work(input));
            best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
        }
        return {best, count};
    }

    void add(const std::string& stage, const std::string& unit, double seconds, std::int64_t count, double floor)
    {
        const double each = count > 0 ? 1e9 * seconds / double(count) : 0;
        results_.push_back({{"stage", stage},
                            {"unit", unit},
                            {"count", count},
                            {"seconds", seconds},
                            {"ns_a_unit", each},
                            {"floor_seconds", floor},
                            {"share_of_floor", floor / seconds}});
        say_(fmt::format("stage {}: {:.0f} ns a {} ({} of them), {:.1f} % of the floor", stage, each, unit, count,
                         100 * floor / seconds));
    }

    const Floors& floors_;
    const Say& say_;
    Json results_ = Json::array();
};

struct Nothing {};

/// Bytes that a cut cell keeps, in the mean: the cell, its pieces and its elements.
double bytesOfCutCell(const tetmesh::CutMesh& mesh)
{
    double bytes = 0, cells = 0;
    for (const tetmesh::Cell& cell : mesh.cells())
        if (!cell.whole) {
            bytes += sizeof(cell) +
                     double(cell.pieces.size() * sizeof(tetmesh::Piece) + cell.elements * sizeof(tetmesh::CellElement));
            ++cells;
        }
    return bytes / cells;
}

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
    for (const VoxelPhi& s : grid::sampleBand(phi, voxels))
        if (s.phi < 0 && s.phi > -dx) raised.emplace_back(s.voxel, s.phi + float(0.5 * dx));
    return raised;
}

void measureCut(Stopwatch& watch, const grid::LevelSet& ball, const tetmesh::Lattice& lattice)
{
    const tetmesh::CutMesh whole(lattice, grid::sampleNodes(ball));
    const double whenWhole = sizeof(tetmesh::Cell) + sizeof(tetmesh::CellElement), whenCut = bytesOfCutCell(whole);
    watch.measure(
        "cut", "cell", {sizeof(float), whenWhole}, [&] { return grid::sampleNodes(ball); },
        [&](tetmesh::NodeField<float>& phi) { return tetmesh::CutMesh(lattice, std::move(phi)).cells().size(); });

    grid::LevelSet torn = ball.copy();
    grid::RelevelWork ignored;
    const grid::PhiChanges changes = grid::raiseAndRelevel(torn, raisedCap(ball), ignored);
    watch.measure(
        "re-cut", "changed cell", {sizeof(float), whenCut}, [&] { return whole; },
        [&](tetmesh::CutMesh& mesh) { return mesh.update(changes).cutCells; });
}

/// From positions to the new phi of the band: what a step does on the grid beside re-levelling.
void measureTransfer(Stopwatch& watch, const grid::LevelSet& ball, const tetmesh::CutMesh& mesh)
{
    const solver::ElementSet set{mesh.elements(), mesh.nodes(), 0, solver::makeMaterial(1e6, 0.3, 1000)};
    const solver::ElasticOperator elastic(std::span(&set, 1), mesh.nodeCount(), mesh.spacing(),
                                          solver::Volumetric::none);
    std::vector<Vec3> x = tetmesh::restPositions(mesh);
    for (Vec3& p : x) p.y() *= 1.1;
    std::vector<double> density;
    const double tets = double(elastic.tetCount()), nodes = double(mesh.nodeCount());
    watch.measure(
        "energy", "tet", {nodes * sizeof(Vec3) / tets, sizeof(double)}, [] { return Nothing{}; },
        [&](Nothing) {
            elastic.energyDensities(x, density);
            return elastic.tetCount();
        });

    const auto energy = [&](std::uint32_t e, int t) { return density[e * tetmesh::kMaxTets + std::size_t(t)]; };
    std::vector<Coord> voxels;
    mesh.phi().forEachBlock([&](Coord low) {
        mesh.phi().forEachNode(low, [&](Coord voxel) {
            if (mesh.phi()(voxel) < 0) voxels.push_back(voxel);
        });
    });
    const std::vector<VoxelPhi> band = grid::sampleBand(ball, voxels);
    voxels.clear();
    for (const VoxelPhi& b : band) voxels.push_back(b.voxel);
    std::vector<double> psi;
    watch.measure(
        "transfer", "voxel", {tetmesh::kMaxTets * sizeof(double), sizeof(double)}, [] { return Nothing{}; },
        [&](Nothing) { return (psi = grid::nodalEnergy(mesh, energy, voxels)).size(); });

    const double dx = ball.voxelSize(), kappa = 0.5 * *std::max_element(psi.begin(), psi.end());
    std::vector<double> raised(band.size());
    watch.measure(
        "Griffith", "voxel", {sizeof(VoxelPhi) + sizeof(double), sizeof(double)}, [] { return Nothing{}; },
        [&](Nothing) {
            grid::GriffithStep step{kappa, dx, std::numeric_limits<double>::infinity(), 0.5 * dx};
            for (std::size_t i = 0; i < band.size(); ++i)
                step.s = std::min(step.s, griffithTime(band[i].phi, psi[i], step.maxMove, step));
            for (std::size_t i = 0; i < band.size(); ++i) raised[i] = griffithUpdate(band[i].phi, psi[i], step);
            return band.size();
        });
}

void measureMeshes(Stopwatch& watch, const grid::LevelSet& coarse, const tetmesh::CutMesh& mesh)
{
    const auto bytes = [](const tetmesh::TetMesh& tets) {
        return double(tets.points.size() * sizeof(Vec3)) / double(tets.tets.size()) + 4 * sizeof(std::uint32_t);
    };
    const double eachCut = bytes(tetmesh::materialTets(mesh));
    watch.measure(
        "tets, cut", "tet", {0, eachCut}, [] { return Nothing{}; },
        [&](Nothing) { return tetmesh::materialTets(mesh).tets.size(); });
    const auto delaunay = [&] {
        mesher::DelaunayCriteria criteria;
        criteria.facetSize = mesher::kRadiusOfEdge * coarse.voxelSize();
        return mesher::delaunayMesh({grid::phiSampler(coarse), grid::materialBox(coarse), {}}, criteria);
    };
    const double eachDelaunay = bytes(delaunay());
    watch.measure(
        "tets, Delaunay", "tet", {0, eachDelaunay}, [] { return Nothing{}; },
        [&](Nothing) { return delaunay().tets.size(); });
}

void measureOutput(Stopwatch& watch, const grid::LevelSet& ball, const tetmesh::CutMesh& mesh)
{
    watch.measure(
        "surface", "triangle",
        {sizeof(tetmesh::Piece), sizeof(tetmesh::EmbeddedPoint) / 2. + 3 * sizeof(std::uint32_t)},
        [] { return Nothing{}; }, [&](Nothing) { return tetmesh::extractSurface(mesh).triangles.size(); });

    std::uint32_t nextId = 0;
    const tetmesh::FragmentTracker fragments(mesh, nextId);
    const tetmesh::Surface surface =
        tetmesh::deform(tetmesh::extractSurface(mesh), tetmesh::restPositions(mesh), fragments.ofNode());
    const ScratchFolder folder;
    watch.measureFile("write .obj", "triangle", folder.path() / "ball.obj", [&](const fs::path& file) {
        tetmesh::writeObj(file, surface, "ball.mtl");
        return surface.triangles.size();
    });
    std::vector<grid::NamedGrid> grids(1);
    grids[0].name = "phi", grids[0].levelSet = &ball, grids[0].unit = "m";
    watch.measureFile("write .vdb", "voxel", folder.path() / "ball.vdb", [&](const fs::path& file) {
        grid::writeVdb(file, grids, {});
        return ball.activeVoxels();
    });
}

}  // namespace

Json benchStages(int voxels, const Floors& floors, const Say& say)
{
    const double dx = 2 * kBallRadius / voxels;
    Stopwatch watch(floors, say);
    watch.measure(
        "level set", "voxel", {0, sizeof(float)}, [] { return Nothing{}; },
        [&](Nothing) { return makeBall(dx).activeVoxels(); });

    const grid::LevelSet ball = makeBall(dx);
    const grid::PhiChanges raised = raisedCap(ball);
    watch.measure(
        "relevel", "voxel", {sizeof(float), sizeof(float)}, [&] { return ball.copy(); },
        [&](grid::LevelSet& phi) {
            grid::RelevelWork work;
            (void)grid::raiseAndRelevel(phi, raised, work);
            return work.voxels;
        });
    const tetmesh::Lattice lattice{tetmesh::Lattice::Kind::six, 1, dx};
    measureCut(watch, ball, lattice);
    const tetmesh::CutMesh mesh(lattice, grid::sampleNodes(ball));
    measureTransfer(watch, ball, mesh);
    measureOutput(watch, ball, mesh);
    measureMeshes(watch, makeBall(4 * dx), mesh);
    return {{"voxels_across", voxels}, {"threads", threadCount()}, {"stages", watch.results()}};
}

}  // namespace vdbfrac::lab::bench
