// Rayleigh damping: force -(a M + b K) v, with K linear elasticity in the rotated frame of each tet at the start of the
// step: it resists the rate of strain, never a rigid turn.
//
// Over a step v = (x - x_n) / dt, so it is the gradient of
//   U(x) = ((x - x_n).a M (x - x_n) + (x - y_n).b K (x - y_n)) / (2 dt)
// y_n is x_n as its fragment turns it: K takes what is left of a turn for strain, by 1 - cos of its angle, and what is
// stiff or small is soon stopped by little of it. a mass coefficient [1/s]: slows everything, also free flight; b
// stiffness coefficient [s]: slows deformation only.
#include "all.h"

#include <vdbfrac/base/parallel.h>

#include <Eigen/Dense>

#include <cmath>

namespace vdbfrac::effects {

namespace {

using scene::Key;
using scene::Type;

const Key kKeys[] = {
    {"mass", Type::number, "1/s", "Rayleigh coefficient of the mass: drags all motion, as air would.", "0", 0},
    {"stiffness", Type::number, "s", "Rayleigh coefficient of the stiffness: drags deformation only.", "0", 0},
};

/// A rigid turn: of a fragment, the one that has its angular momentum.
struct Spin {
    Vec3 center = Vec3::Zero(), rate = Vec3::Zero();  // m, 1/s
};

/// Of the fragments of a body, by their ids.
std::vector<Spin> spinsOf(const core::Body& body, const solver::StepStart& start)
{
    struct Sums {
        double mass = 0;
        Vec3 first = Vec3::Zero(), momentum = Vec3::Zero(), angular = Vec3::Zero();  // of x, v, x cross v
        Mat3 second = Mat3::Zero();                                                  // of x x^T
    };
    const std::vector<std::uint32_t>& fragmentOf = body.fragments.ofNode();
    std::vector<Sums> sums(body.fragments.fragments().empty() ? 0 : body.fragments.fragments().back().id + 1);
    for (std::size_t i = 0; i < fragmentOf.size(); ++i) {
        const double m = start.elastic.mass()[body.firstNode + i];
        const Vec3 &x = start.x[body.firstNode + i], &v = start.v[body.firstNode + i];
        Sums& s = sums[fragmentOf[i]];
        s.mass += m, s.first += m * x, s.momentum += m * v, s.angular += m * x.cross(v);
        s.second += m * x * x.transpose();
    }
    std::vector<Spin> spins(sums.size());
    for (std::size_t f = 0; f < sums.size(); ++f) {
        const Sums& s = sums[f];
        if (!(s.mass > 0)) continue;
        const Vec3 center = s.first / s.mass;
        const Mat3 second = s.second - s.mass * center * center.transpose();
        const Mat3 inertia = second.trace() * Mat3::Identity() - second;
        spins[f].center = center;
        spins[f].rate = inertia.ldlt().solve(s.angular - center.cross(s.momentum));
        if (!spins[f].rate.allFinite()) spins[f].rate.setZero();
    }
    return spins;
}

class Damping : public core::Effect, public solver::Potential {
public:
    Damping(double mass, double stiffness) : a_(mass), b_(stiffness) {}
    std::string name() const override { return "damping"; }
    void join(core::Stages& stages) override { stages.solve.push_back(this); }
    void start(const core::SolvedStep&, std::span<const core::Body> bodies, std::vector<std::string>&) override
    {
        bodies_ = bodies;
    }

    void begin(const solver::StepStart& start) override
    {
        start_.assign(start.x.begin(), start.x.end());
        inverseDt_ = std::isfinite(start.dt) ? 1 / start.dt : 0;
        elastic_ = &start.elastic;
        if (b_ == 0) return;
        turned_ = start_;
        if (inverseDt_ != 0)
            for (const core::Body& body : bodies_) turn(body, start);
        elastic_->evaluate(turned_, {}, &tangent_);
        elastic_->warp(tangent_);
    }

    double evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const override
    {
        const auto mass = elastic_->mass();
        if (b_ != 0) move(turned_, x);
        const solver::Product<Vec3> strained =
            b_ == 0 ? solver::Product<Vec3>() : elastic_->multiply<Vec3>(tangent_, moved_);
        const auto way = [&](std::size_t i) { return Vec3(x[i] - start_[i]); };
        const double dragged = orderedSum(x.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            double sum = 0;
            for (std::size_t i = begin; i < end; ++i) {
                sum += mass[i] * way(i).squaredNorm();
                gradient[i] += inverseDt_ * a_ * mass[i] * way(i);
                if (b_ != 0) gradient[i] += inverseDt_ * b_ * strained.sums(i);
            }
            return sum;
        });
        return 0.5 * inverseDt_ * (a_ * dragged + b_ * strained.energy);
    }

    /// Its force along the way.
    solver::EnergyFlow flow(const solver::Leg& leg) const override
    {
        if (inverseDt_ == 0) return {};
        const auto mass = elastic_->mass();
        if (b_ != 0) move(turned_, leg.at);
        const solver::Product<solver::Vec3f> strained = b_ == 0 ? solver::Product<solver::Vec3f>() : strainOfMove();
        const double taken = orderedSum(mass.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            double sum = 0;
            for (std::size_t i = begin; i < end; ++i) {
                Vec3 force = a_ * mass[i] * (leg.at[i] - start_[i]);
                if (b_ != 0) force += b_ * strained.sums(i).cast<double>();
                sum += force.dot(leg.to[i] - leg.from[i]);
            }
            return sum;
        });
        return {0, inverseDt_ * taken, 0};
    }

    /// The rotations of the iterate stand in for those at the start of the step.
    solver::HessianShares hessian() const override { return {inverseDt_ * a_, inverseDt_ * b_}; }
    solver::RayleighDamping damping() const override { return {a_, b_}; }
    std::size_t bytes() const override
    {
        return (start_.capacity() + turned_.capacity() + moved_.capacity()) * sizeof(Vec3) +
               single_.capacity() * sizeof(solver::Vec3f) + tangent_.bytes();
    }

private:
    /// Turns the fragments of a body as their angular momentum does in this step.
    void turn(const core::Body& body, const solver::StepStart& start)
    {
        const std::vector<Spin> spins = spinsOf(body, start);
        std::vector<Mat3> rotation;
        for (const Spin& spin : spins) {
            const Vec3 angle = start.dt * spin.rate;
            rotation.push_back(Eigen::AngleAxisd(angle.norm(), angle.stableNormalized()).toRotationMatrix());
        }
        const std::vector<std::uint32_t>& fragmentOf = body.fragments.ofNode();
        parallelChunks(fragmentOf.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const Vec3& center = spins[fragmentOf[i]].center;
                Vec3& x = turned_[body.firstNode + i];
                x = center + rotation[fragmentOf[i]] * (x - center);
            }
        });
    }
    /// K moved_. It is only reported: single precision halves its cost, a tenth of an evaluation.
    solver::Product<solver::Vec3f> strainOfMove() const
    {
        single_.resize(moved_.size());
        parallelChunks(moved_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) single_[i] = moved_[i].cast<float>();
        });
        return elastic_->multiply<solver::Vec3f>(tangent_, single_);
    }
    void move(std::span<const Vec3> from, std::span<const Vec3> to) const
    {
        moved_.resize(to.size());
        parallelChunks(to.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) moved_[i] = to[i] - from[i];
        });
    }

    double a_, b_, inverseDt_ = 0;
    std::span<const core::Body> bodies_;
    std::vector<Vec3> start_, turned_;           // x_n; y_n
    mutable std::vector<Vec3> moved_;            // scratch
    mutable std::vector<solver::Vec3f> single_;  // scratch
    const solver::ElasticOperator* elastic_ = nullptr;
    solver::Tangent tangent_;
};

std::unique_ptr<core::Effect> make(const scene::Values& values, const scene::Scene&)
{
    return std::make_unique<Damping>(values.number("mass"), values.number("stiffness"));
}

}  // namespace

EffectInfo damping() { return {{"damping", "Rayleigh damping.", kKeys}, "solve", make}; }

}  // namespace vdbfrac::effects
