#include "objective.h"

#include "node_loops.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <ranges>
#include <cmath>

namespace vdbfrac::solver {

namespace {

// Of the magnitudes a nodal force is added from: some ten roundings of a double.
constexpr double kRounding = 2e-15;
constexpr double kPhiRounding = 1e-14;  // of the magnitudes phi is added from

/// What rounding of x does through couplings: squares of nodal forces, and stiffness times the square of positions.
struct CoupledNoise {
    double force2 = 0, stretched = 0;  // N^2, J
};

CoupledNoise noiseOf(const CouplingsOf& couplings, std::span<const Vec3> x, std::span<const std::uint8_t> fixed)
{
    const auto sum = orderedSums<2>(couplings.points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        std::array<double, 2> s{};
        for (const Coupling& c : couplings.points.subspan(begin, end - begin)) {
            double reach = 0;
            for (std::size_t a = 0; a < Coupling::kNodes; ++a)
                if (c.weight[a] != 0) reach += std::abs(double(c.weight[a])) * x[c.node[a]].norm();
            for (std::size_t a = 0; a < Coupling::kNodes; ++a)
                if (c.weight[a] != 0 && !fixed[c.node[a]]) s[0] += std::pow(c.trace() * double(c.weight[a]) * reach, 2);
            s[1] += c.trace() * reach * reach;
        }
        return s;
    });
    const auto ofScalars = orderedSums<2>(couplings.scalars.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        std::array<double, 2> s{};
        for (const ScalarCoupling& c : couplings.scalars.subspan(begin, end - begin)) {
            double reach = 0;
            for (std::size_t a = 0; a < ScalarCoupling::kNodes; ++a)
                reach += double(c.gradient[a].norm()) * x[c.node[a]].norm();
            for (std::size_t a = 0; a < ScalarCoupling::kNodes; ++a)
                if (!fixed[c.node[a]]) s[0] += std::pow(double(c.gradient[a].norm()) * reach, 2);
            s[1] += reach * reach;
        }
        return s;
    });
    return {sum[0] + ofScalars[0], sum[1] + ofScalars[1]};
}

/// How far a force f takes a node that its own tets hold with k, and couplings with Q. Touches are some ten times as
/// stiff as cells: a tenth of them tells where tets hardly hold the node, and hides nothing where they do.
double taken(const SymmetricBlock& Q, double k, const Vec3& f)
{
    constexpr double kShare = 0.1;
    Mat3 K = k * Mat3::Identity();
    for (int c = 0; c < 3; ++c) K.col(c) += kShare * multiply(Q, Vec3(Vec3::Unit(c)));
    return K.llt().solve(f).norm();
}

}  // namespace

void Objective::rebind(const ElasticOperator& elastic)
{
    elastic_ = &elastic;
    predicted_.resize(elastic.nodeCount());
    outer_.resize(elastic.nodeCount());
}

void Objective::begin(const State& state, double dt, const System& system)
{
    dt_ = dt;
    inertia_ = 1 / (dt * dt);
    potentials_ = system.potentials;
    boundary_ = &system.boundary;
    shares_ = {};
    fixed_ = boundary_->fixed;
    frozenNodes_ = 0;
    for (Potential* potential : potentials_) {
        potential->begin({state.x, state.v, dt, *elastic_, system.time, system.begin});
        const HessianShares h = potential->hessian();
        shares_ = {shares_.mass + h.mass, shares_.stiffness + h.stiffness};
    }
    const double drift = std::isfinite(dt) ? dt : 0;
    eachNode<double>(predicted_.size(), [&](std::size_t i) { predicted_[i] = state.x[i] + drift * state.v[i]; });
    if (!std::isfinite(dt)) freezeLooseParts();
}

/// A part that nothing holds has no static equilibrium, or infinitely many: it stays where it is.
void Objective::freezeLooseParts()
{
    if (boundary_->part.empty()) return;
    couplings_.clear();
    for (const Potential* potential : potentials_) potential->linearize(predicted_, couplings_);
    parts_.find(*boundary_, couplings_);
    for (std::size_t i = 0; i < fixed_.size(); ++i) {
        const bool loose = !parts_.isHeld(parts_[i]);
        fixed_[i] |= loose;
        frozenNodes_ += loose;
    }
}

void Objective::evaluate(Point& p)
{
    eachNode<double>(p.x.size(), [&](std::size_t i) {
        p.gradient[i].setZero();
        outer_[i] = -boundary_->force[i];
    });
    p.elastic = p.phi = elastic_->evaluate(p.x, p.gradient, &tangent_, shares_.stiffness);
    couplings_.clear(), scalars_.clear();
    blocksMade_ = false;
    double phiScale = std::abs(p.elastic);
    for (const Potential* potential : potentials_) {
        const double value = potential->evaluate(p.x, outer_);
        potential->linearize(p.x, couplings_);
        potential->linearizeScalars(p.x, *elastic_, scalars_);
        p.phi += value;
        phiScale += std::abs(value);
    }
    p.phiNoise = phiScale;
    measureForces(p, phiScale - std::abs(p.elastic));
}

void Objective::prune(std::span<const Vec3> x)
{
    for (Potential* potential : potentials_) potential->prune(x);
}

bool Objective::refresh(std::span<const Vec3> x)
{
    bool changed = false;
    for (Potential* potential : potentials_) changed = potential->refresh(x) || changed;
    return changed;
}

/// Adds inertia and outer forces to the gradient, which holds the elastic ones, and measures all of them in one pass.
/// `outerEnergy`: magnitude of what potentials have added to phi [J].
void Objective::measureForces(Point& p, double outerEnergy)
{
    enum { elastic, outer, inertia, total, noise, stretched, kinetic, work, sums };
    const std::span<const double> mass = elastic_->mass(), stiffness = elastic_->stiffness();
    auto sum = orderedSums<sums>(p.x.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        std::array<double, sums> s{};
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3 moved = p.x[i] - predicted_[i], accelerating = mass[i] * inertia_ * moved;
            const double size2 = p.x[i].squaredNorm(), k = stiffness[i] + mass[i] * inertia_;
            s[kinetic] += 0.5 * accelerating.dot(moved);
            s[work] += boundary_->force[i].dot(p.x[i]);
            s[stretched] += stiffness[i] * size2;
            const Vec3 own = p.gradient[i];
            p.gradient[i] += outer_[i] + accelerating;
            if (fixed_[i]) continue;
            s[elastic] += own.squaredNorm();
            s[outer] += outer_[i].squaredNorm();
            s[inertia] += accelerating.squaredNorm();
            s[total] += p.gradient[i].squaredNorm();
            s[noise] += k * k * size2;
        }
        return s;
    });
    const CoupledNoise coupled = noiseOf(couplings(), p.x, fixed_);
    p.phi += sum[kinetic] - sum[work];
    p.norm = std::sqrt(sum[total]);
    p.forceScale = std::sqrt(std::max({sum[elastic], sum[outer], sum[inertia]}));
    p.noise = kRounding * std::sqrt(sum[noise] + coupled.force2);
    // F is rounded by |x| / h units, so a small strain energy K e^2 is off by K e times that; as is that of a coupling.
    p.phiNoise =
        kPhiRounding * (p.phiNoise + sum[kinetic] + std::abs(sum[work])) +
        kRounding * (std::sqrt(sum[stretched] * std::abs(p.elastic)) + std::sqrt(coupled.stretched * outerEnergy));
}

double Objective::farthest(const Point& p)
{
    const std::span<const double> mass = elastic_->mass(), stiffness = elastic_->stiffness();
    const NodeBlocks* coupled = blocks();
    const std::size_t rows = coupled ? coupled->rows() : 0;
    return orderedMax(p.x.size(), kChunk, 0, [&](std::size_t begin, std::size_t end) {
        double most = 0;
        std::size_t row = coupled ? coupled->rowFrom(begin) : 0;
        for (std::size_t i = begin; i < end; ++i) {
            const double own = stiffness[i] + mass[i] * inertia_;
            const bool isCoupled = row < rows && coupled->node(row) == i;
            if (!fixed_[i])
                most = std::max(
                    most, isCoupled ? taken(coupled->diagonal(row), own, p.gradient[i]) : p.gradient[i].norm() / own);
            row += isCoupled;
        }
        return most;
    });
}

double Objective::elasticWork(std::span<const Vec3> x, std::span<const Vec3> gradient, std::span<const Vec3> from) const
{
    const std::span<const double> mass = elastic_->mass();
    return nodeSum<double>(x.size(), [&](std::size_t i) {
        const Vec3 own = gradient[i] - outer_[i] - mass[i] * inertia_ * (x[i] - predicted_[i]);
        return own.dot(x[i] - from[i]);
    });
}

void Objective::hold(Point& p) const
{
    eachNode<double>(p.x.size(), [&](std::size_t i) {
        if (boundary_->fixed[i]) p.x[i] = boundary_->target[i];
    });
}

std::uint32_t Objective::worstNode(const Point& p) const
{
    const auto nodes = std::views::iota(std::uint32_t(0), std::uint32_t(p.gradient.size()));
    return *std::ranges::max_element(nodes, {},
                                     [&](std::uint32_t i) { return fixed_[i] ? -1 : p.gradient[i].squaredNorm(); });
}

double Objective::jump() const
{
    return orderedMax(predicted_.size(), kChunk, 0, [&](std::size_t begin, std::size_t end) {
        double most = 0;
        for (std::size_t i = begin; i < end; ++i)
            if (boundary_->fixed[i]) most = std::max(most, (boundary_->target[i] - predicted_[i]).norm());
        return most;
    });
}

void Objective::balanceMomentum(Point& p)
{
    if (!(inertia_ > 0)) return;
    const auto mass = elastic_->mass();
    parts_.find(*boundary_, couplings_);
    balance_.assign(parts_.numbers(), {Vec3::Zero(), 0});
    for (std::size_t i = 0; i < p.x.size(); ++i) {
        Balance& part = balance_[parts_[i]];
        part.force += p.gradient[i];
        part.inertia += mass[i] * inertia_;
    }
    eachNode<double>(p.x.size(), [&](std::size_t i) {
        const Balance& part = balance_[parts_[i]];
        if (!parts_.isHeld(parts_[i]) && part.inertia > 0) p.x[i] -= part.force / part.inertia;
    });
}

const NodeBlocks* Objective::blocks()
{
    if (couplings().empty()) return nullptr;
    if (!blocksMade_) blocks_ = NodeBlocks(couplings(), elastic_->nodeCount());
    blocksMade_ = true;
    return &blocks_;
}

LinearSystem Objective::system() { return {*elastic_, tangent_, inertia_ + shares_.mass, fixed_, blocks()}; }

void Objective::addProduct(std::span<const Vec3> u, std::span<Vec3> out)
{
    elastic_->addProduct(tangent_, u, out, blocks());
}

std::size_t Objective::bytes() const
{
    return 2 * elastic_->nodeCount() * sizeof(Vec3) + tangent_.bytes() + blocks_.bytes() +
           couplings_.capacity() * sizeof(Coupling) + scalars_.capacity() * sizeof(ScalarCoupling);
}

}  // namespace vdbfrac::solver
