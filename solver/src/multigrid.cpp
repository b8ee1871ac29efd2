#include "multigrid.h"

#include "assembly.h"
#include "node_loops.h"

#include <vdbfrac/base/grouping.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace vdbfrac::solver {

namespace {

constexpr std::size_t kCoarsestNodes = 100;   // a dense factorisation of these takes two milliseconds
constexpr double kMinReduction = 0.7;         // of the nodes from level to level; dust of fragments does not get fewer
constexpr double kSafety = 1.15, kRange = 6;  // smoother damps eigenvalues in [largest / kRange, kSafety largest]
constexpr int kPowerSteps = 10;
/// Of a coarse level's first answer, before it is asked again. With all of it the cycle is definite as long as one
/// answer has no part twice too large, with this 1 + 1 / kKept times; near nu = .5 coarse levels are too soft and
/// answer too much.
constexpr float kKept = 0.4f;

/// A number in [-1, 1] from a node's number, the same on every machine.
float noise(std::uint32_t n)
{
    n = (n ^ 61) ^ (n >> 16);
    n *= 9;
    n ^= n >> 4;
    n *= 0x27d4eb2d;
    n ^= n >> 15;
    return float(n & 0xffff) / 32767.5f - 1;
}

}  // namespace

struct Multigrid::Level {
    const ElasticOperator* elastic = nullptr;
    std::unique_ptr<ElasticOperator> own;  // on coarse levels
    Tangent tangent;                       // of cells
    double massFactor = 0;
    std::vector<std::uint8_t> fixed;
    std::vector<float> spring, added;    // N/m: of fixed nodes finer down; of springs and mass
    NodeBlocks ownBlocks;                // on coarse levels
    const NodeBlocks* blocks = nullptr;  // null: no couplings
    BlockDiagonal inverse;
    std::vector<Vec3f> x, b, step;
    float largest = 1;  // eigenvalue of inverse * A

    // To the next coarser level.
    CoarseLattice coarser;
    Groups children;  // finer nodes under each coarse node, twice where they coincide

    void takeBlocks(const Level& fine)
    {
        blocks = nullptr;
        if (!fine.blocks) return;
        ownBlocks = fine.blocks->restricted(fine.coarser.parents, fine.fixed, elastic->nodeCount());
        if (!ownBlocks.empty()) blocks = &ownBlocks;
    }
    void allocate()
    {
        const std::size_t n = elastic->nodeCount();
        for (auto* v : {&x, &b, &step}) v->resize(n);
        fixed.resize(n);
        added.resize(n);
    }
    LinearSystem system() const { return {*elastic, tangent, massFactor, fixed, blocks}; }
    Product<Vec3f> multiply() const { return elastic->multiply<Vec3f>(tangent, x, blocks); }
};

struct Multigrid::Coarsest {
    Eigen::MatrixXd matrix;
    Eigen::LLT<Eigen::MatrixXd> factor;
    Eigen::VectorXd solution;
};

bool Multigrid::fits(const ElasticOperator& elastic)
{
    const auto sets = elastic.sets();
    return std::all_of(sets.begin(), sets.end(), [](const ElementSet& set) { return set.gradients.empty(); });
}

Multigrid::Multigrid(const ElasticOperator& elastic)
{
    levels_.push_back(std::make_unique<Level>());
    levels_[0]->elastic = &elastic;
    levels_[0]->allocate();
    while (levels_.back()->elastic->nodeCount() > kCoarsestNodes) {
        Level& fine = *levels_.back();
        const std::size_t nodes = fine.elastic->nodeCount();
        CoarseLattice lattice = coarsen(fine.elastic->sets(), nodes);
        if (double(lattice.nodeCount) > kMinReduction * double(nodes)) break;
        fine.coarser = std::move(lattice);
        fine.children = groupItems(fine.coarser.nodeCount, [&](const auto& add) {
            for (std::uint32_t n = 0; n < fine.coarser.parents.size(); ++n)
                for (std::uint32_t parent : fine.coarser.parents[n])
                    if (parent < fine.coarser.nodeCount) add(parent, n);
        });
        auto coarse = std::make_unique<Level>();
        coarse->own = std::make_unique<ElasticOperator>(fine.coarser.elementSets(), fine.coarser.nodeCount,
                                                        2 * fine.elastic->h(), fine.elastic->elasticity());
        coarse->elastic = coarse->own.get();
        coarse->allocate();
        coarse->spring.resize(fine.coarser.nodeCount);
        levels_.push_back(std::move(coarse));
    }
    coarsest_ = std::make_unique<Coarsest>();
}

Multigrid::~Multigrid() = default;

int Multigrid::levels() const { return int(levels_.size()); }

namespace {

/// Fixed nodes and springs of the coarse level.
void restrictHolds(std::span<const std::uint8_t> fixed, std::span<const float> spring,
                   std::span<const double> stiffness, std::span<const std::array<std::uint32_t, 2>> parents,
                   std::span<std::uint8_t> coarseFixed, std::span<float> coarseSpring)
{
    std::fill(coarseFixed.begin(), coarseFixed.end(), 0);
    std::fill(coarseSpring.begin(), coarseSpring.end(), 0.f);
    for (std::size_t n = 0; n < parents.size(); ++n) {
        const auto [a, b] = parents[n];
        if (a >= coarseFixed.size()) continue;
        if (fixed[n] && a == b) coarseFixed[a] = 1;
        const float k = fixed[n] ? (a == b ? 0.f : float(stiffness[n])) : (spring.empty() ? 0.f : spring[n]);
        if (k == 0) continue;
        coarseSpring[a] += k / 2;
        coarseSpring[b] += k / 2;
    }
}

}  // namespace

bool Multigrid::setUp(const LinearSystem& system)
{
    Level& top = *levels_[0];
    top.elastic->averageTets(system.tangent, top.tangent);
    std::copy(system.fixed.begin(), system.fixed.end(), top.fixed.begin());
    for (std::size_t l = 1; l < levels_.size(); ++l) {
        const Level& fine = *levels_[l - 1];
        Level& level = *levels_[l];
        level.elastic->averageCells(*fine.elastic, fine.tangent, fine.coarser.finer, level.tangent);
        restrictHolds(fine.fixed, fine.spring, fine.elastic->stiffness(), fine.coarser.parents, level.fixed,
                      level.spring);
        if (top.elastic->hasAsleep() || level.own->hasAsleep())
            level.own->setAsleep(top.elastic->hasAsleep() ? level.fixed : std::span<const std::uint8_t>());
    }
    return couple(system);
}

bool Multigrid::couple(const LinearSystem& system)
{
    Level& top = *levels_[0];
    top.blocks = system.blocks;
    for (std::size_t l = 0; l < levels_.size(); ++l) {
        Level& level = *levels_[l];
        if (l > 0) level.takeBlocks(*levels_[l - 1]);
        if (l == 1 && !top.blocks) {
            // The finest level has the same kinds of tets, and is spared the products. Twice the spacing has four times
            // the mass for each stiffness, which would make the eigenvalue less.
            weigh(level, system.massFactor / 4);
            top.largest = largestEigenvalue(level);
        }
        weigh(level, system.massFactor);
        if (l > 0 || levels_.size() == 1 || top.blocks) level.largest = largestEigenvalue(level);
    }
    return factorCoarsest();
}

bool Multigrid::factorCoarsest()
{
    if (levels_.back()->elastic->nodeCount() > kCoarsestNodes) return true;
    const Eigen::Index size = Eigen::Index(3 * levels_.back()->elastic->nodeCount());
    coarsest_->matrix.setZero(size, size);
    eachEntry(levels_.back()->system(), levels_.back()->spring,
              [&](Eigen::Index row, Eigen::Index column, double value) { coarsest_->matrix(row, column) += value; });
    coarsest_->factor.compute(coarsest_->matrix);  // reads the lower triangle
    return coarsest_->factor.info() == Eigen::Success;
}

/// Diagonal of the level: mass, springs, and the inverse blocks.
void Multigrid::weigh(Level& level, double massFactor)
{
    level.massFactor = massFactor;
    const std::span<const double> mass = level.elastic->mass();
    eachNode<float>(level.added.size(), [&](std::size_t i) {
        level.added[i] = float(mass[i] * massFactor) + (level.spring.empty() ? 0.f : level.spring[i]);
    });
    invertDiagonal(level.system(), level.spring, level.inverse);
}

/// By the power method from noise; a lower bound that kSafety makes up for.
float Multigrid::largestEigenvalue(Level& level)
{
    eachNode<float>(level.x.size(), [&](std::size_t i) {
        const std::uint32_t n = 3 * std::uint32_t(i);
        level.x[i] = level.fixed[i] ? Vec3f::Zero() : Vec3f(noise(n), noise(n + 1), noise(n + 2));
    });
    const auto norm = [&] {
        return std::sqrt(
            nodeSum<double>(level.x.size(), [&](std::size_t i) { return double(level.x[i].squaredNorm()); }));
    };
    double size = norm(), ratio = 1;
    for (int step = 0; step < kPowerSteps && size > 0; ++step) {
        const NodeSums<Vec3f> sums = level.multiply().sums;
        const float scale = float(1 / size);
        eachNode<float>(level.x.size(), [&](std::size_t i) {
            level.x[i] = level.inverse.times(i, Vec3f((level.added[i] * level.x[i] + sums(i)) * scale));
        });
        size = ratio = norm();
    }
    return float(ratio);
}

/// Two steps of the Chebyshev iteration for A x = b.
void Multigrid::smooth(Level& level, bool fromZero)
{
    const float high = float(kSafety) * level.largest, low = level.largest / float(kRange);
    const float middle = (high + low) / 2, half = (high - low) / 2, sigma = middle / half;
    const float first = 1 / middle, damp = 1 / (2 * sigma - 1 / sigma), keep = damp / sigma, move = 2 * damp / half;
    const std::size_t count = level.x.size();
    const auto pass = [&](float kept, float moved) {
        const SmootherNodes nodes{slotSums(level.multiply().sums), level.inverse.lanes(),  level.added.data(),
                                  level.b.data()->data(),          level.x.data()->data(), level.step.data()->data()};
        parallelChunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
            const FlushDenormals flush;
            kernel().smooth(nodes, begin, end, kept, moved);
        });
    };
    if (fromZero)
        eachNode<float>(
            count, [&](std::size_t i) { level.x[i] = level.step[i] = first * level.inverse.times(i, level.b[i]); });
    else
        pass(0, first);
    pass(keep, move);
}

/// Puts the residual of `level` on the right-hand side of the coarser one.
void Multigrid::restrictResidual(Level& level, Level& coarse)
{
    const NodeSums<Vec3f> sums = level.multiply().sums;
    eachNode<float>(level.x.size(), [&](std::size_t i) {
        level.step[i] = level.fixed[i] ? Vec3f::Zero() : Vec3f(level.b[i] - level.added[i] * level.x[i] - sums(i));
    });
    eachNode<float>(coarse.b.size(), [&](std::size_t c) {
        Vec3f sum = Vec3f::Zero();
        for (std::uint32_t child : level.children[c]) sum += level.step[child];
        coarse.b[c] = coarse.fixed[c] ? Vec3f::Zero() : Vec3f(0.5f * sum);
    });
}

void Multigrid::cycle(std::size_t l, bool fromZero)
{
    Level& level = *levels_[l];
    if (l + 1 == levels_.size()) {
        solveCoarsest(level);
        return;
    }
    smooth(level, fromZero);
    Level& coarse = *levels_[l + 1];
    restrictResidual(level, coarse);
    cycle(l + 1, true);
    if (l + 2 < levels_.size()) {  // the coarsest level has nothing to add
        eachNode<float>(coarse.x.size(), [&](std::size_t i) { coarse.x[i] *= kKept; });
        cycle(l + 1, false);
    }
    eachNode<float>(level.x.size(), [&](std::size_t i) {
        const auto [a, b] = level.coarser.parents[i];
        if (!level.fixed[i] && a < coarse.x.size()) level.x[i] += 0.5f * (coarse.x[a] + coarse.x[b]);
    });
    smooth(level, false);
}

void Multigrid::solveCoarsest(Level& level)
{
    if (level.x.size() > kCoarsestNodes) {
        smooth(level, true);
        smooth(level, false);
        return;
    }
    Eigen::VectorXd& x = coarsest_->solution;
    x.resize(Eigen::Index(3 * level.b.size()));
    for (std::size_t i = 0; i < level.b.size(); ++i) x.segment<3>(Eigen::Index(3 * i)) = level.b[i].cast<double>();
    coarsest_->factor.solveInPlace(x);
    for (std::size_t i = 0; i < level.b.size(); ++i)
        level.x[i] = level.fixed[i] ? Vec3f::Zero() : Vec3f(x.segment<3>(Eigen::Index(3 * i)).cast<float>());
}

std::span<Vec3f> Multigrid::rightSide() { return levels_[0]->b; }

void Multigrid::apply() { cycle(0, true); }

std::span<const Vec3f> Multigrid::result() const { return levels_[0]->x; }

std::size_t Multigrid::bytes() const
{
    const auto of = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    std::size_t sum = 0;
    for (const auto& level : levels_) {
        sum += of(level->fixed) + of(level->spring) + of(level->added) + level->inverse.bytes() + of(level->x) +
               of(level->b) + of(level->step) + level->children.bytes() + level->ownBlocks.bytes() +
               of(level->coarser.parents) + of(level->coarser.finer.start) + of(level->coarser.finer.children) +
               level->tangent.bytes();
        if (level->own) sum += level->own->bytes();
        for (const auto& set : level->coarser.sets) sum += of(set.elements) + of(set.nodes);
    }
    return sum;
}

}  // namespace vdbfrac::solver
