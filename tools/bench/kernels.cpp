// The inner loops: forces with their polar decompositions, products in both precisions, and what cut cells cost.
#include "ball.h"
#include "block.h"
#include "solvers.h"
#include "timing.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/tetmesh/cut_mesh.h>

#include <Eigen/SVD>
#include <fmt/format.h>

#include <cmath>

namespace vdbfrac::tools::bench {

namespace {

constexpr int kRepetitions = 15;  // the best one counts

/// ns a tet of energy and forces; the polar decomposition of every tet is in it.
double forceNanoseconds(const BlockProblem& block, const std::vector<Vec3>& x)
{
    std::vector<Vec3> gradient(x.size(), Vec3::Zero());
    const double seconds = fastest(kRepetitions, [&] { (void)block.elastic.evaluate(x, gradient, nullptr); });
    return 1e9 * seconds / double(block.elastic.tetCount());
}

/// ns of a product with a vector of some smooth displacement.
template <class V>
double productNanoseconds(const solver::ElasticOperator& elastic, const solver::Tangent& tangent)
{
    std::vector<V> u(elastic.nodeCount());
    for (std::size_t i = 0; i < u.size(); ++i) u[i] = V(1, typename V::Scalar(i % 7), typename V::Scalar(i % 11));
    (void)elastic.multiply<V>(tangent, u);  // touches its memory
    return 1e9 * fastest(kRepetitions, [&] { (void)elastic.multiply<V>(tangent, u); });
}

/// ns of the rotation of one 3x3 matrix by Eigen's JacobiSVD: what a polar decomposition costs by the usual way.
double svdNanoseconds(const BlockProblem& block, const std::vector<Vec3>& x)
{
    std::vector<Mat3> F;
    for (const tetmesh::CellElement& e : block.mesh.elements) {
        Mat3 edges;
        for (int d = 0; d < 3; ++d) edges.col(d) = (x[e.node[std::size_t(1) << d]] - x[e.node[0]]) / block.mesh.h;
        F.push_back(edges);
    }
    std::vector<Mat3> R(F.size());
    const double seconds = fastest(kRepetitions, [&] {
        for (std::size_t i = 0; i < F.size(); ++i) {
            const Eigen::JacobiSVD<Mat3> svd(F[i], Eigen::ComputeFullU | Eigen::ComputeFullV);
            R[i] = svd.matrixU() * svd.matrixV().transpose();
        }
    });
    return 1e9 * seconds / double(F.size());
}

Json productRow(const BlockProblem& block, const solver::Tangent& tangent, double forceNs)
{
    const double nodes = double(block.elastic.nodeCount());
    const double twice = productNanoseconds<Vec3>(block.elastic, tangent);
    return {{"threads", threadCount()},
            {"force_ns_a_tet", forceNs},
            {"product_ns_a_node", twice / nodes},
            {"product_single_ns_a_node", productNanoseconds<solver::Vec3f>(block.elastic, tangent) / nodes},
            {"product_ns_a_tet", twice / double(block.elastic.tetCount())}};
}

/// Product with a ball that the lattice cuts, by tet with material: cut cells have few of these in a vector.
Json benchCut(int ballVoxels, double wholeNs, const Say& say)
{
    const double dx = 2 * kBallRadius / ballVoxels;
    const tetmesh::CutMesh mesh({tetmesh::Lattice::Kind::six, 1, dx}, grid::sampleNodes(makeBall(dx)));
    const solver::ElementSet set{mesh.elements(), mesh.nodes(), 0, solver::makeMaterial(1e6, 0.3, 1000)};
    const solver::ElasticOperator elastic(std::span(&set, 1), mesh.nodeCount(), dx, solver::Volumetric::none);
    std::vector<Vec3> x;
    for (std::size_t i = 0; i < mesh.nodeCount(); ++i) x.push_back(mesh.restPosition(i));
    solver::Tangent tangent;
    (void)elastic.evaluate(x, {}, &tangent);
    std::size_t cut = 0;
    for (const tetmesh::Cell& cell : mesh.cells()) cut += !cell.whole;
    const double ns = productNanoseconds<Vec3>(elastic, tangent) / double(elastic.tetCount());
    say(fmt::format("kernels: product {:.2f} ns a tet of a cut ball, {:.2f} of whole cells", ns, wholeNs));
    return {{"cells", mesh.cells().size()},
            {"cut_cells", cut},
            {"tets", elastic.tetCount()},
            {"product_ns_a_tet", ns},
            {"over_whole", ns / wholeNs}};
}

}  // namespace

void benchKernels(int ballVoxels, int threads, const Say& say, Json& result)
{
    const int cells = int(std::lround(std::cbrt(M_PI / 6) * ballVoxels));
    const BlockProblem block(cells + 1);
    const std::vector<Vec3> x = block.bent();
    solver::Tangent tangent;
    (void)block.elastic.evaluate(x, {}, &tangent);
    Json runs = Json::array();
    for (int t : threadCounts(threads)) {
        const ThreadLimit limit(t);
        runs.push_back(productRow(block, tangent, forceNanoseconds(block, x)));
        say(fmt::format(
            "kernels, {} threads: force {:.1f} ns a tet; product {:.1f} ns a node, {:.1f} in single precision", t,
            runs.back()["force_ns_a_tet"].get<double>(), runs.back()["product_ns_a_node"].get<double>(),
            runs.back()["product_single_ns_a_node"].get<double>()));
    }
    const ThreadLimit one(1);
    const double svd = svdNanoseconds(block, x), force = runs[0]["force_ns_a_tet"].get<double>();
    result["kernels"] = {{"n", cells + 1},
                         {"nodes", block.elastic.nodeCount()},
                         {"tets", block.elastic.tetCount()},
                         {"runs", runs},
                         {"svd_ns", svd},
                         {"svd_over_force", svd / force},
                         {"cut_ball", benchCut(ballVoxels, runs[0]["product_ns_a_tet"].get<double>(), say)}};
}

}  // namespace vdbfrac::tools::bench
