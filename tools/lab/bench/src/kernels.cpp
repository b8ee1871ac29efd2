// The inner loops: forces with their polar decompositions, products in both precisions, and what cut cells cost.
#include "ball.h"
#include "block_problem.h"
#include "solvers.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/lab/machine/timing.h>
#include <vdbfrac/tetmesh/cut_mesh.h>
#include <vdbfrac/tetmesh/cut_mesh_surface.h>

#include <Eigen/SVD>
#include <fmt/format.h>

#include <cmath>

namespace vdbfrac::lab::bench {

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
    solver::Tangent means;
    block.elastic.averageTets(tangent, means);
    const double nodes = double(block.elastic.nodeCount());
    const double twice = productNanoseconds<Vec3>(block.elastic, tangent);
    return {{"threads", threadCount()},
            {"force_ns_a_tet", forceNs},
            {"product_ns_a_node", twice / nodes},
            {"product_single_ns_a_node", productNanoseconds<solver::Vec3f>(block.elastic, tangent) / nodes},
            {"product_of_means_ns_a_node", productNanoseconds<solver::Vec3f>(block.elastic, means) / nodes},
            {"product_ns_a_tet", twice / double(block.elastic.tetCount())}};
}

/// A ball sliced by slanted gaps that are hardly wider than a voxel: about half of its cells are cut, and some
/// are there twice, with nodes of their own on either side of the gap.
tetmesh::NodeField<float> slicedBall(double dx)
{
    constexpr double kApart = 7, kHalfGap = 0.6;  // voxels
    const Vec3 normal = Vec3(1, 2, 3).normalized();
    tetmesh::NodeField<float> phi = grid::sampleNodes(makeBall(dx));
    std::vector<Coord> blocks;
    phi.forEachBlock([&](Coord low) { blocks.push_back(low); });
    for (const Coord& low : blocks)
        phi.forEachNode(low, [&](Coord c) {
            const double slice = normal.dot(c.toVec()) / kApart,
                         gap = kHalfGap - kApart * std::abs(slice - std::round(slice));
            phi.set(c, std::max(phi(c), float(gap * dx)));
        });
    return phi;
}

/// ns a product of some elements of a mesh.
struct Part {
    std::size_t elements = 0;
    std::int64_t tets = 0;
    double nanoseconds = 0;
    double aTet() const { return nanoseconds / double(tets); }
};

template <class Wanted>
Part measurePart(const tetmesh::CutMesh& mesh, const Wanted& wanted)
{
    std::vector<tetmesh::CellElement> elements;
    for (const tetmesh::Cell& cell : mesh.cells())
        if (wanted(cell))
            for (std::uint32_t e = cell.firstElement; e < cell.firstElement + cell.elements; ++e)
                elements.push_back(mesh.elements()[e]);
    const solver::ElementSet set{elements, mesh.nodes(), 0, solver::makeMaterial(1e6, 0.3, 1000)};
    const solver::ElasticOperator elastic(std::span(&set, 1), mesh.nodeCount(), mesh.spacing(),
                                          solver::Volumetric::none);
    solver::Tangent tangent;
    (void)elastic.evaluate(tetmesh::restPositions(mesh), {}, &tangent);
    return {elements.size(), elastic.tetCount(), productNanoseconds<Vec3>(elastic, tangent)};
}

/// Products with all cells of a body, with its whole ones alone, and with its cut ones alone, by tet with material.
/// Alone, cut cells have nodes to themselves that they share with whole ones in a body.
Json benchCut(const char* body, tetmesh::NodeField<float> phi, double dx, const Say& say)
{
    const tetmesh::CutMesh mesh({tetmesh::Lattice::Kind::six, 1, dx}, std::move(phi));
    const Part cut = measurePart(mesh, [](const tetmesh::Cell& cell) { return !cell.whole; });
    const Part whole = measurePart(mesh, [](const tetmesh::Cell& cell) { return cell.whole; });
    const Part all = measurePart(mesh, [](const tetmesh::Cell&) { return true; });
    std::size_t cutCells = 0, duplicated = 0;
    for (const tetmesh::Cell& cell : mesh.cells()) cutCells += !cell.whole, duplicated += cell.elements > 1;
    say(fmt::format(
        "kernels: {}: product {:.2f} ns a tet of all cells, {:.2f} of whole ones alone, {:.2f} of cut ones alone", body,
        all.aTet(), whole.aTet(), cut.aTet()));
    return {{"body", body},
            {"cells", mesh.cells().size()},
            {"cut_cells", cutCells},
            {"duplicated_cells", duplicated},
            {"cut_elements", cut.elements},
            {"cut_tets", cut.tets},
            {"whole_tets", whole.tets},
            {"all_ns_a_tet", all.aTet()},
            {"whole_ns_a_tet", whole.aTet()},
            {"cut_ns_a_tet", cut.aTet()},
            {"all_over_whole", all.aTet() / whole.aTet()},
            {"cut_over_whole", cut.aTet() / whole.aTet()}};
}

}  // namespace

Json benchKernels(int ballVoxels, int threads, const Say& say)
{
    const int cells = int(std::lround(std::cbrt(M_PI / 6) * ballVoxels));
    const BlockProblem block(cells + 1);
    const std::vector<Vec3> x = block.mesh.bentPositions();
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
    const double dx = 2 * kBallRadius / ballVoxels;
    const double svd = svdNanoseconds(block, x), force = runs[0]["force_ns_a_tet"].get<double>();
    return {{"n", cells + 1},
            {"nodes", block.elastic.nodeCount()},
            {"tets", block.elastic.tetCount()},
            {"runs", runs},
            {"svd_ns", svd},
            {"svd_over_force", svd / force},
            {"cut",
             {benchCut("ball", grid::sampleNodes(makeBall(dx)), dx, say),
              benchCut("sliced ball", slicedBall(dx), dx, say)}}};
}

}  // namespace vdbfrac::lab::bench
