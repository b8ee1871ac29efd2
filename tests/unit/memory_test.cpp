// Bytes a node of what a step needs, against what follows from the sizes of its structures: none of them grows unseen.
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/lab/samples/block.h>
#include <vdbfrac/solver/backward_euler.h>

#include <gtest/gtest.h>

#include <malloc.h>

#include <algorithm>
#include <cstdio>
#include <memory>

using namespace vdbfrac;
using solver::LinearMethod;

namespace {

constexpr double kMargin = 1.05;  // small tables of patches; lanes that stay empty at the ends of short rows
constexpr int kCells = 32;        // along an edge

/// How many there are of each thing on a level with so many cells along an edge.
struct Level {
    explicit Level(int edge)
        : cells(double(edge) * edge * edge), nodes(double(edge + 1) * (edge + 1) * (edge + 1)), patches((edge + 7) / 8)
    {
        patches *= patches * patches;
        patchSide = std::min(edge, 8) + 1;
        patchNodes = patchSide * patchSide * patchSide;
    }
    double slots() const { return patches * patchNodes; }  // nodes on the borders of patches have several

    double cells, nodes, patches, patchSide = 0, patchNodes = 0;  // nodes along a patch and in it
};

/// Bytes in all, as the sum over what the structures are made of.
double operatorBytes(const Level& l)
{
    const double batch = 32. / 8;                // 8 corners of 2 bytes, three indices of 4, shape; by eight cells
    const double cell = batch + 4;               // and the place of its element
    const double slot = 4 + 6 * sizeof(double);  // slot of node, six rows of sums
    const double row = 2 * 8;                    // nodes of a patch in a row: two runs of them
    const double node = 4 + 2 * sizeof(double);  // start of its slots, mass, stiffness
    const double thread =
        9 * 8 * (l.patchNodes + 15);  // nine rows of the largest patch for each thread, padded to lanes
    return l.cells * cell + l.slots() * (slot + row / l.patchSide) + l.nodes * node + threadSlots() * thread;
}

double tangentBytes(const Level& l)
{
    return l.cells * 6 * 15 * sizeof(float);  // by tet: nine numbers of the rotation, six of the twist operator
}

double meanTangentBytes(const Level& l)
{
    return l.cells * 15 * sizeof(float);  // the same by cell
}

double stepperBytes(const Level& l)
{
    return l.nodes * 8 * sizeof(Vec3);  // predicted, outer, direction, reaction; x and gradient, here and there
}

constexpr double kInverse = 6 * sizeof(float);      // of the diagonal block
constexpr double kOuterVectors = 2 * sizeof(Vec3);  // r and p of the conjugate gradients, in double

double jacobiBytes(const Level& l)
{
    return l.nodes * (2 * sizeof(solver::Vec3f) + kInverse);  // r and p in single precision: the tolerance is loose
}

double multigridBytes(int edge)
{
    const Level finest(edge);
    double bytes = finest.nodes * kOuterVectors;
    for (; edge >= 4; edge /= 2) {  // 5^3 nodes: the coarsest level
        const Level l(edge), coarse(edge / 2);
        const bool first = l.nodes == finest.nodes, last = edge == 4;
        // Fixed, added, inverse; x, b, step.
        bytes += meanTangentBytes(l) + l.nodes * (1 + 4 + kInverse + 3 * sizeof(solver::Vec3f));
        if (!first) bytes += operatorBytes(l) + l.nodes * 4;  // springs
        if (last) break;
        bytes += l.nodes * (8 + 2 * 4);  // two parents a node, and each the other way round
        bytes += l.cells * sizeof(std::uint32_t);
        bytes += coarse.cells *
                 (sizeof(tetmesh::CellElement) + 4);  // elements of the coarse lattice, start of their children
        bytes += 2 * coarse.nodes * sizeof(Coord) + coarse.nodes * 4;  // grown by doubling; start of children
    }
    return bytes;
}

/// The block, stretched by a step.
struct Stretched {
    lab::Block block{{kCells, kCells, kCells}, 1. / kCells};
    solver::ElasticOperator elastic = lab::elasticOperator(block, solver::makeMaterial(1e6, 0.3, 1000));
    solver::State state{block.restPositions(), std::vector<Vec3>(block.nodes.size(), Vec3::Zero())};
    solver::Boundary boundary;

    Stretched()
    {
        boundary.target = state.x;
        boundary.force.assign(state.x.size(), Vec3::Zero());
        for (std::size_t i = 0; i < state.x.size(); ++i) {
            boundary.fixed.push_back(block.nodes[i].y == 0 || block.nodes[i].y == kCells);
            if (block.nodes[i].y == kCells) boundary.target[i].y() += 1e-3;
        }
    }

    /// A stepper with all the memory it ever needs.
    std::unique_ptr<solver::BackwardEuler> stepped(LinearMethod method)
    {
        solver::NewtonSettings settings;
        settings.iterations = 1;
        settings.linearMethod = method;
        auto stepper = std::make_unique<solver::BackwardEuler>(elastic, settings);
        solver::State copy = state;
        (void)stepper->step(copy, 1. / 240, {{}, boundary});
        return stepper;
    }
};

void expectWithin(const char* what, std::size_t bytes, double derived)
{
    const double nodes = Level(kCells).nodes;
    std::printf("%s: %.1f bytes a node, %.1f derived\n", what, double(bytes) / nodes, derived / nodes);
    EXPECT_LE(double(bytes), kMargin * derived) << what;
}

/// Bytes that are allocated now. 0 where the allocator does not tell (sanitizers bring their own).
std::size_t allocated()
{
    const struct mallinfo2 info = mallinfo2();
    return info.uordblks + info.hblkhd;
}

}  // namespace

TEST(Memory, OperatorAndTangentTakeWhatTheirStructuresSay)
{
    const Stretched s;
    const Level level(kCells);
    solver::Tangent tangent;
    (void)s.elastic.evaluate(s.state.x, {}, &tangent);
    expectWithin("operator", s.elastic.bytes(), operatorBytes(level));
    expectWithin("tangent", tangent.bytes(), tangentBytes(level));
}

TEST(Memory, StepperTakesWhatItsVectorsAndItsLinearSolverSay)
{
    Stretched s;
    const Level level(kCells);
    const double stepper = tangentBytes(level) + stepperBytes(level);
    expectWithin("stepper, jacobi", s.stepped(LinearMethod::jacobi)->bytes(), stepper + jacobiBytes(level));
    expectWithin("stepper, multigrid", s.stepped(LinearMethod::multigrid)->bytes(), stepper + multigridBytes(kCells));
}

/// What bytes() says is what the allocator gave: no structure is left out of the sum.
TEST(Memory, BytesSaysWhatIsAllocated)
{
    constexpr double kUncounted = 0.05;  // small tables; the factors of the coarsest level
    Stretched s;
    (void)s.stepped(LinearMethod::multigrid);  // threads and libraries have what they take once
    for (LinearMethod method : {LinearMethod::jacobi, LinearMethod::multigrid}) {
        const std::size_t before = allocated();
        const auto stepper = s.stepped(method);
        const std::size_t after = allocated();
        if (before == 0) GTEST_SKIP() << "the allocator does not tell";
        EXPECT_NEAR(double(after - before), double(stepper->bytes()), kUncounted * double(stepper->bytes()));
    }
}
