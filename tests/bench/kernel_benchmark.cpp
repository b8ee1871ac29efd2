// The inner loops one at a time, on one thread: what a tet, a 3x3 matrix, a node or a cell costs. Each shows its cost
// in the column named for the unit, in seconds ("20n": 20 ns). Filter with --benchmark_filter=REGEX.
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/lab/samples/block.h>
#include <vdbfrac/solver/linear_solver.h>
#include <vdbfrac/tetmesh/cut_mesh_surface.h>

#include <Eigen/SVD>
#include <benchmark/benchmark.h>

#include <cmath>

using namespace vdbfrac;

namespace {

constexpr int kCells = 24;   // along an edge of the block: larger than the caches of a core
constexpr double kEdge = 1;  // m

/// Seconds a unit, when one run of the loop deals with `count` of them.
void costOf(benchmark::State& state, const char* unit, double count)
{
    state.counters[unit] =
        benchmark::Counter(count, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

/// A block bent, twisted and stretched by up to a fifth: no tet is inverted, none is at rest.
struct Bent {
    explicit Bent(int cells = kCells) : block({cells, cells, cells}, kEdge / cells) {}

    lab::Block block;
    solver::ElasticOperator elastic = lab::elasticOperator(block, solver::makeMaterial(1e6, 0.3, 1000));
    std::vector<Vec3> x = block.bentPositions();
};

void EvaluateForce(benchmark::State& state)
{
    const ThreadLimit one(1);
    const Bent bent;
    std::vector<Vec3> gradient(bent.x.size(), Vec3::Zero());
    for (auto _ : state) benchmark::DoNotOptimize(bent.elastic.evaluate(bent.x, gradient, nullptr));
    costOf(state, "tet", double(bent.elastic.tetCount()));
}
BENCHMARK(EvaluateForce)->Unit(benchmark::kMillisecond);

void EvaluateForceAndTangent(benchmark::State& state)
{
    const ThreadLimit one(1);
    const Bent bent;
    std::vector<Vec3> gradient(bent.x.size(), Vec3::Zero());
    solver::Tangent tangent;
    for (auto _ : state) benchmark::DoNotOptimize(bent.elastic.evaluate(bent.x, gradient, &tangent));
    costOf(state, "tet", double(bent.elastic.tetCount()));
}
BENCHMARK(EvaluateForceAndTangent)->Unit(benchmark::kMillisecond);

void TangentProduct(benchmark::State& state)
{
    const ThreadLimit one(1);
    const Bent bent;
    std::vector<Vec3> gradient(bent.x.size(), Vec3::Zero()), out(bent.x.size(), Vec3::Zero());
    solver::Tangent tangent;
    (void)bent.elastic.evaluate(bent.x, gradient, &tangent);
    for (auto _ : state) {
        bent.elastic.addProduct(tangent, gradient, out);
        benchmark::DoNotOptimize(out.data());
    }
    costOf(state, "tet", double(bent.elastic.tetCount()));
}
BENCHMARK(TangentProduct)->Unit(benchmark::kMillisecond);

/// As the smoother of multigrid has it: in single precision, with one tangent a cell.
void MeanTangentProduct(benchmark::State& state)
{
    const ThreadLimit one(1);
    const Bent bent;
    solver::Tangent tangent, means;
    (void)bent.elastic.evaluate(bent.x, {}, &tangent);
    bent.elastic.averageTets(tangent, means);
    const std::vector<solver::Vec3f> u(bent.x.size(), solver::Vec3f::Ones());
    for (auto _ : state) benchmark::DoNotOptimize(bent.elastic.multiply<solver::Vec3f>(means, u).energy);
    costOf(state, "tet", double(bent.elastic.tetCount()));
}
BENCHMARK(MeanTangentProduct)->Unit(benchmark::kMillisecond);

/// What a polar decomposition costs by the usual way; to be compared with the whole of EvaluateForce.
void EigenJacobiSvd(benchmark::State& state)
{
    const Bent bent;
    const double h = bent.block.h;
    std::vector<Mat3> F;
    for (const tetmesh::CellElement& e : bent.block.elements) {
        Mat3 edges;
        for (int d = 0; d < 3; ++d) edges.col(d) = (bent.x[e.node[std::size_t(1) << d]] - bent.x[e.node[0]]) / h;
        F.push_back(edges);
    }
    for (auto _ : state)
        for (const Mat3& m : F) {
            const Eigen::JacobiSVD<Mat3> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
            Mat3 R = svd.matrixU() * svd.matrixV().transpose();
            benchmark::DoNotOptimize(R.data());
        }
    costOf(state, "matrix", double(F.size()));
}
BENCHMARK(EigenJacobiSvd)->Unit(benchmark::kMillisecond);

/// Conjugate gradients with block-Jacobi: the product and the passes over vectors.
void ConjugateGradientIteration(benchmark::State& state)
{
    constexpr int kIterations = 20;
    const ThreadLimit one(1);
    const Bent d(int(state.range(0)));
    const std::size_t nodes = d.x.size();
    std::vector<Vec3> b(nodes), u(nodes);
    for (std::size_t i = 0; i < nodes; ++i) b[i] = Vec3(1, double(i % 7), double(i % 11));
    const std::vector<std::uint8_t> fixed(nodes, 0);
    solver::Tangent tangent;
    (void)d.elastic.evaluate(d.x, {}, &tangent);
    solver::LinearSolver linear(d.elastic, solver::LinearMethod::jacobi);
    for (auto _ : state) {
        const solver::LinearReport report = linear.solve({d.elastic, tangent, 1e4, fixed}, b, u, {0, kIterations});
        if (report.iterations != kIterations) state.SkipWithError("ended before its last iteration");
    }
    costOf(state, "node", double(nodes) * kIterations);
}
BENCHMARK(ConjugateGradientIteration)->Arg(20)->Arg(60)->Unit(benchmark::kMillisecond);

void DotProduct(benchmark::State& state)
{
    const ThreadLimit one(1);
    const std::vector<Vec3> a(std::size_t(state.range(0)), Vec3(1, 2, 3)), b(a.size(), Vec3(3, 2, 1));
    for (auto _ : state) benchmark::DoNotOptimize(solver::dot(a, b));
    costOf(state, "node", double(a.size()));
}
BENCHMARK(DotProduct)->Arg(8'000)->Arg(216'000)->Unit(benchmark::kMicrosecond);

constexpr int kReach = 20;  // voxels: half the edge of the ball's box
constexpr tetmesh::Lattice kLattice{tetmesh::Lattice::Kind::six, 1, kEdge / kReach};

tetmesh::NodeField<float> ball()
{
    return lab::sample({-kReach, -kReach, -kReach}, {kReach, kReach, kReach}, kLattice.voxelSize,
                       [](Vec3 p) { return (p - Vec3(.01, .02, -.03)).norm() - .8; });
}

void CutEverything(benchmark::State& state)
{
    const ThreadLimit one(1);
    const tetmesh::NodeField<float> phi = ball();
    double cells = 0;
    for (auto _ : state) cells = double(tetmesh::CutMesh(kLattice, phi).cells().size());
    costOf(state, "cell", cells);
}
BENCHMARK(CutEverything)->Unit(benchmark::kMillisecond);

/// The surface of an octant of the ball moves by half a voxel.
void CutWhatChanged(benchmark::State& state)
{
    const ThreadLimit one(1);
    const tetmesh::CutMesh whole(kLattice, ball());
    std::vector<VoxelPhi> changes;
    const float dx = float(kLattice.voxelSize);
    for (int z = 0; z <= kReach; ++z)
        for (int y = 0; y <= kReach; ++y)
            for (int x = 0; x <= kReach; ++x)
                if (const float value = whole.phi()({x, y, z}); std::abs(value) < dx)
                    changes.emplace_back(Coord{x, y, z}, value + 0.5F * dx);
    double cells = 0;
    for (auto _ : state) {
        state.PauseTiming();
        tetmesh::CutMesh mesh = whole;
        state.ResumeTiming();
        cells = double(mesh.update(changes).cutCells);
    }
    costOf(state, "cell", cells);
}
BENCHMARK(CutWhatChanged)->Unit(benchmark::kMillisecond);

void ExtractSurface(benchmark::State& state)
{
    const ThreadLimit one(1);
    const tetmesh::CutMesh mesh(kLattice, ball());
    double triangles = 0;
    for (auto _ : state) triangles = double(tetmesh::extractSurface(mesh).triangles.size());
    costOf(state, "triangle", triangles);
}
BENCHMARK(ExtractSurface)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
