#include <vdbfrac/solver/linear_solver.h>

#include "assembly.h"
#include "coupled_diagonal.h"
#include "block_diagonal.h"
#include "multigrid.h"
#include "node_loops.h"

#include <Eigen/CholmodSupport>

#include <algorithm>
#include <cmath>
#include <optional>

namespace vdbfrac::solver {

namespace {

/// Vectors of an iteration in numbers of one precision.
template <class V>
struct Vectors {
    std::vector<V> r, p;
    void resize(std::size_t n)
    {
        r.resize(n);
        p.resize(n);
    }
    std::size_t bytes() const { return (r.capacity() + p.capacity()) * sizeof(V); }
};

/// What the passes of an iteration work on.
template <class V>
struct Iteration {
    const LinearSystem& A;
    const NodeSums<V>& Kp;  // (K + H) p of the last product
    Vectors<V>& v;
    std::span<Vec3> u;
};

// Preconditioners of conjugate gradients. start(i, r) is what node i adds to r.z, finish() the rest of r.z, z(i, r) the
// result at node i. Two passes follow each product: updateResidual() does r -= step A p and returns the new r.z,
// updateDirection() does u += move p and p = z + beta p and returns the new p.M p.

class BlockJacobi {
public:
    explicit BlockJacobi(const BlockDiagonal& inverse) : inverse_(inverse) {}
    template <class V>
    double start(std::size_t i, const V& r) const
    {
        return double(r.dot(z(i, r)));
    }
    template <class V>
    double finish(const std::vector<V>&) const
    {
        return 0;
    }
    template <class V>
    V z(std::size_t i, const V& r) const
    {
        return inverse_.times(i, r);
    }
    template <class V>
    double updateResidual(const Iteration<V>& it, double step) const
    {
        using Real = typename V::Scalar;
        return pass(it, [&](const GradientNodes<Real>& nodes, std::size_t begin, std::size_t end) {
            return kernel().of<Real>().updateResidual(nodes, begin, end, Real(step));
        });
    }
    template <class V>
    double updateDirection(const Iteration<V>& it, double move, double beta) const
    {
        using Real = typename V::Scalar;
        return pass(it, [&](const GradientNodes<Real>& nodes, std::size_t begin, std::size_t end) {
            return kernel().of<Real>().updateDirection(nodes, begin, end, move, Real(beta));
        });
    }

private:
    /// At fixed nodes r is whatever holds them, which B takes to 0.
    template <class V, class F>
    double pass(const Iteration<V>& it, const F& f) const
    {
        using Real = typename V::Scalar;
        const ElasticOperator& elastic = it.A.elastic;
        const GradientNodes<Real> nodes{slotSums(it.Kp),    inverse_.lanes(),      elastic.mass().data(),
                                        it.A.massFactor,    it.v.r.data()->data(), it.v.p.data()->data(),
                                        it.u.data()->data()};
        return orderedSum(it.u.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            [[maybe_unused]] const FlushFor<Real> flush{};
            return f(nodes, begin, end);
        });
    }

    const BlockDiagonal& inverse_;
};

class WCycle {
public:
    explicit WCycle(Multigrid& multigrid)
        : multigrid_(multigrid), rightSide_(multigrid.rightSide()), result_(multigrid.result())
    {
    }
    double start(std::size_t i, const Vec3& r) const
    {
        rightSide_[i] = r.cast<float>();
        return 0;
    }
    double finish(const std::vector<Vec3>& r) const
    {
        multigrid_.apply();
        return nodeSum<double>(r.size(), [&](std::size_t i) { return r[i].dot(z(i, r[i])); });
    }
    Vec3 z(std::size_t i, const Vec3&) const { return result_[i].cast<double>(); }
    double updateResidual(const Iteration<Vec3>& it, double step) const
    {
        const std::span<const double> mass = it.A.elastic.mass();
        eachNode<double>(it.u.size(), [&](std::size_t i) {
            if (it.A.fixed[i]) return;
            it.v.r[i] -= step * (it.A.massFactor * mass[i] * it.v.p[i] + it.Kp(i));
            (void)start(i, it.v.r[i]);
        });
        return finish(it.v.r);
    }
    double updateDirection(const Iteration<Vec3>& it, double move, double beta) const
    {
        const std::span<const double> mass = it.A.elastic.mass();
        return nodeSum<double>(it.u.size(), [&](std::size_t i) -> double {
            if (it.A.fixed[i]) return 0;
            it.u[i] += move * it.v.p[i];
            it.v.p[i] = z(i, it.v.r[i]) + beta * it.v.p[i];
            return mass[i] * it.v.p[i].squaredNorm();
        });
    }

private:
    Multigrid& multigrid_;
    std::span<Vec3f> rightSide_;
    std::span<const Vec3f> result_;
};

/// Conjugate gradients with vectors V: Vec3, or Vec3f where that is exact enough. `scale` times b is what they solve
/// for.
template <class V, class Preconditioner>
LinearReport conjugateGradient(const LinearSystem& A, const Preconditioner& B, std::span<const Vec3> b, double scale,
                               std::span<Vec3> u, LinearLimits limits, Vectors<V>& v)
{
    using Real = typename V::Scalar;
    const std::size_t n = b.size();
    v.resize(n);
    double rz = nodeSum<Real>(n, [&](std::size_t i) -> double {
        u[i].setZero();
        v.r[i] = A.fixed[i] ? V::Zero().eval() : V((scale * b[i]).template cast<Real>());
        return B.start(i, v.r[i]);
    });
    rz += B.finish(v.r);
    double pMp = nodeSum<Real>(n, [&](std::size_t i) -> double {
        v.p[i] = A.fixed[i] ? V::Zero().eval() : V(B.z(i, v.r[i]));
        return A.elastic.mass()[i] * double(v.p[i].squaredNorm());
    });
    Product<V> product{};
    const Iteration<V> iteration{A, product.sums, v, u};
    LinearReport report;
    for (const double goal = limits.tolerance * limits.tolerance * rz; rz > goal;) {
        if (report.iterations == limits.iterations) {
            report.status = LinearStatus::capped;
            break;
        }
        product = A.elastic.multiply<V>(A.tangent, v.p, A.blocks);
        const double curvature = product.energy + A.massFactor * pMp;
        ++report.iterations;
        if (!(curvature > 0)) {
            report.status = LinearStatus::negativeCurvature;
            break;
        }
        const double step = rz / curvature, rzNew = B.updateResidual(iteration, step), beta = rzNew / rz;
        rz = rzNew;
        pMp = B.updateDirection(iteration, step / scale, beta);
    }
    if (!(rz >= 0)) report.status = LinearStatus::negativeCurvature;
    return report;
}

/// Cells along the longest side of a body, in one piece or not; without a lattice as if it were a cube.
double cellsAcross(const ElasticOperator& elastic)
{
    int most = 0;
    for (const ElementSet& set : elastic.sets()) {
        if (set.nodes.empty()) continue;
        Coord lower = set.nodes[0], upper = lower;
        for (const Coord& c : set.nodes) {
            lower = {std::min(lower.x, c.x), std::min(lower.y, c.y), std::min(lower.z, c.z)};
            upper = {std::max(upper.x, c.x), std::max(upper.y, c.y), std::max(upper.z, c.z)};
        }
        most = std::max({most, upper.x - lower.x, upper.y - lower.y, upper.z - lower.z});
    }
    return most > 0 ? most : std::cbrt(double(elastic.nodeCount()));
}

/// Whether block-Jacobi or multigrid takes less time, from how many iterations block-Jacobi will need: waves cover
/// `reach` cells in the time step, at most the `across` of the body; each cell is some iterations, as measured on
/// blocks.
LinearMethod chosen(const LinearSystem& system, LinearLimits limits, double across)
{
    // Nodes, in all and across a slender body: beyond, factors fill in.
    constexpr double kDirectNodes = 1500, kDirectSection = 16;
    constexpr double kIterationsACell = 0.25;  // for each factor e of the tolerance
    constexpr double kWorthwhile = 30;         // iterations that cost as much as setting up multigrid and its own
    constexpr double kFive = 5;                // times as many where five tets a cell, not nested, are cut
    const double nodes = double(system.elastic.nodeCount());
    double stiffness = 0, inertia = 0;
    for (std::size_t i = 0; i < system.elastic.nodeCount(); ++i) {
        stiffness += system.elastic.stiffness()[i];
        inertia += system.elastic.mass()[i] * system.massFactor;
    }
    const double reach = inertia > 0 ? std::min(across, std::sqrt(stiffness / inertia)) : across;
    const double iterations = kIterationsACell * reach * -std::log(limits.tolerance);
    if (inertia == 0 && nodes < std::min(kDirectNodes, kDirectSection * across)) return LinearMethod::direct;
    if (!Multigrid::fits(system.elastic)) return LinearMethod::jacobi;
    const auto sets = system.elastic.sets();
    const bool six = std::all_of(sets.begin(), sets.end(), [](const ElementSet& set) {
        return set.elements.empty() || set.elements[0].shape == tetmesh::CellShape::six;
    });
    return iterations > kWorthwhile * (six ? 1 : kFive) ? LinearMethod::multigrid : LinearMethod::jacobi;
}

/// Mean of the diagonal, roughly [N/m]: b of this size has a solution of size one, whose square single precision can
/// hold.
double meanDiagonal(const LinearSystem& system)
{
    const std::span<const double> mass = system.elastic.mass(), stiffness = system.elastic.stiffness();
    return nodeSum<double>(mass.size(), [&](std::size_t i) { return stiffness[i] + system.massFactor * mass[i]; }) /
           double(mass.size());
}

struct Direct {
    using Matrix = Eigen::SparseMatrix<double>;
    Eigen::CholmodSupernodalLLT<Matrix> factor;
    // Of what was analysed: nodes that are fixed and couplings change it.
    std::vector<Matrix::StorageIndex> starts, rows;

    void analyze(const Matrix& A)
    {
        const std::span nowStarts(A.outerIndexPtr(), std::size_t(A.outerSize()) + 1);
        const std::span nowRows(A.innerIndexPtr(), std::size_t(A.nonZeros()));
        if (std::ranges::equal(starts, nowStarts) && std::ranges::equal(rows, nowRows)) return;
        factor.analyzePattern(A);
        starts.assign(nowStarts.begin(), nowStarts.end()), rows.assign(nowRows.begin(), nowRows.end());
    }
};

}  // namespace

struct LinearSolver::Data {
    const ElasticOperator* elastic;
    std::optional<double> across = {};  // cells; not known before a choice asks for it
    LinearMethod method;
    LinearPrecision precision;
    LinearMethod prepared = LinearMethod::automatic;  // what there is a preconditioner for; automatic: nothing
    CoupledDiagonal preparedBlocks = {};              // of the couplings in it
    Vectors<Vec3> vectors;
    Vectors<Vec3f> singles;
    BlockDiagonal inverse;
    std::unique_ptr<Multigrid> multigrid;
    std::unique_ptr<Direct> direct;
};

LinearSolver::LinearSolver(const ElasticOperator& elastic, LinearMethod method, LinearPrecision precision)
    : data_(std::make_unique<Data>(
          Data{&elastic, {}, method, precision, LinearMethod::automatic, {}, {}, {}, {}, nullptr, nullptr}))
{
}
LinearSolver::~LinearSolver() = default;
LinearSolver::LinearSolver(LinearSolver&&) noexcept = default;
LinearSolver& LinearSolver::operator=(LinearSolver&&) noexcept = default;

LinearReport LinearSolver::solve(const LinearSystem& system, std::span<const Vec3> b, std::span<Vec3> u,
                                 LinearLimits limits, bool samePreconditioner)
{
    constexpr double kSingle = 1e-4;  // reductions that vectors in single precision reach with room to spare
    Data& d = *data_;
    const bool same = samePreconditioner && d.prepared != LinearMethod::automatic;
    const auto choose = [&] {
        if (!d.across) d.across = cellsAcross(*d.elastic);
        return chosen(system, limits, *d.across);
    };
    const auto isOutOfDate = [&] {
        const CoupledDiagonal now(system.blocks);
        return d.preparedBlocks.changesMuch(now) ||
               (d.prepared == LinearMethod::multigrid && d.preparedBlocks.growsMuch(now, system.elastic.stiffness()));
    };
    const LinearMethod method = d.method != LinearMethod::automatic ? d.method : same ? d.prepared : choose();
    if (method == LinearMethod::direct) return solveDirectly(system, b, u);
    const double size = std::sqrt(dot(b, b)), scale = size > 0 ? meanDiagonal(system) / size : 1;
    if (!same)
        prepare(system, method);
    else if (isOutOfDate())
        prepareAgain(system);
    int spent = 0;  // iterations
    for (bool isOwn = !same; d.prepared == LinearMethod::multigrid; isOwn = true) {
        LinearReport report = conjugateGradient(system, WCycle(*d.multigrid), b, scale, u, limits, d.vectors);
        report.method = method;
        report.iterations = spent += report.iterations;
        if (report.status != LinearStatus::negativeCurvature) return report;
        // What was made for other couplings may be indefinite. If that of these is too, block-Jacobi tells whether it
        // was the matrix.
        if (isOwn)
            prepare(system, LinearMethod::jacobi);
        else
            prepareAgain(system);
    }
    const BlockJacobi jacobi(d.inverse);
    const bool single = d.precision == LinearPrecision::mixed && limits.tolerance >= kSingle;
    LinearReport report = single ? conjugateGradient(system, jacobi, b, scale, u, limits, d.singles)
                                 : conjugateGradient(system, jacobi, b, scale, u, limits, d.vectors);
    report.iterations += spent;
    return report;
}

/// Makes the preconditioner; block-Jacobi where multigrid cannot be had.
void LinearSolver::prepare(const LinearSystem& system, LinearMethod method)
{
    Data& d = *data_;
    d.prepared = method;
    d.preparedBlocks = CoupledDiagonal(system.blocks);
    if (method == LinearMethod::multigrid) {
        if (!d.multigrid && Multigrid::fits(*d.elastic)) d.multigrid = std::make_unique<Multigrid>(*d.elastic);
        if (d.multigrid && d.multigrid->setUp(system)) return;
        d.prepared = LinearMethod::jacobi;
    }
    invertDiagonal(system, {}, d.inverse);
}

/// For other couplings of a system whose elastic part still serves.
void LinearSolver::prepareAgain(const LinearSystem& system)
{
    Data& d = *data_;
    if (d.prepared != LinearMethod::multigrid || !d.multigrid->couple(system))
        prepare(system, LinearMethod::jacobi);
    else
        d.preparedBlocks = CoupledDiagonal(system.blocks);
}

void LinearSolver::rebind(const ElasticOperator& elastic)
{
    data_->prepared = LinearMethod::automatic;
    data_->elastic = &elastic;
    data_->across.reset();
    data_->multigrid.reset();
    data_->direct.reset();
}

LinearReport LinearSolver::solveDirectly(const LinearSystem& system, std::span<const Vec3> b, std::span<Vec3> u)
{
    Data& d = *data_;
    LinearReport report{LinearStatus::converged, LinearMethod::direct, 1};
    const Eigen::SparseMatrix<double> A = assemble(system);
    if (!d.direct) {
        d.direct = std::make_unique<Direct>();
        d.direct->factor.cholmod().print = 0;  // what it has to say is in info()
    }
    d.direct->analyze(A);
    d.direct->factor.factorize(A);
    if (d.direct->factor.info() != Eigen::Success) {
        report.status = LinearStatus::negativeCurvature;
        std::fill(u.begin(), u.end(), Vec3::Zero());
        return report;
    }
    Eigen::VectorXd v(Eigen::Index(3 * b.size()));
    for (std::size_t i = 0; i < b.size(); ++i)
        v.segment<3>(Eigen::Index(3 * i)) = system.fixed[i] ? Vec3::Zero().eval() : b[i];
    v = d.direct->factor.solve(v);
    for (std::size_t i = 0; i < b.size(); ++i) u[i] = v.segment<3>(Eigen::Index(3 * i));
    return report;
}

std::size_t LinearSolver::bytes() const
{
    const Data& d = *data_;
    return d.vectors.bytes() + d.singles.bytes() + d.inverse.bytes() + (d.multigrid ? d.multigrid->bytes() : 0);
}

double dot(std::span<const Vec3> a, std::span<const Vec3> b)
{
    return nodeSum<double>(a.size(), [&](std::size_t i) { return a[i].dot(b[i]); });
}

}  // namespace vdbfrac::solver
