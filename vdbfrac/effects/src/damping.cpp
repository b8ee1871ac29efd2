// Rayleigh damping: force -(a M + b K) v, with K linear elasticity in the rotated frame of each tet at the start of the
// step: it resists the rate of strain, never a rigid turn.
//
// Over a step v = (x - x_n) / dt, so it is the gradient of U(x) = (x - x_n).(a M + b K)(x - x_n) / (2 dt).
// a mass coefficient [1/s]: slows everything, also free flight; b stiffness coefficient [s]: slows deformation only.
#include "all.h"

#include <vdbfrac/base/parallel.h>

#include <cmath>

namespace vdbfrac::effects {

namespace {

using scene::Key;
using scene::Type;

const Key kKeys[] = {
    {"mass", Type::number, "1/s", "Rayleigh coefficient of the mass: drags all motion, as air would", "0", 0},
    {"stiffness", Type::number, "s", "Rayleigh coefficient of the stiffness: drags deformation only", "0", 0},
};

class Damping : public core::Effect, public solver::Potential {
public:
    Damping(double mass, double stiffness) : a_(mass), b_(stiffness) {}
    std::string name() const override { return "damping"; }
    void join(core::Stages& stages) override { stages.solve.push_back(this); }

    void begin(const solver::StepStart& start) override
    {
        start_.assign(start.x.begin(), start.x.end());
        inverseDt_ = std::isfinite(start.dt) ? 1 / start.dt : 0;
        elastic_ = &start.elastic;
        if (b_ == 0) return;
        elastic_->evaluate(start.x, {}, &tangent_);
        elastic_->warp(tangent_);
    }

    double evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const override
    {
        const auto mass = elastic_->mass();
        move(start_, x);
        const solver::Product<Vec3> strained =
            b_ == 0 ? solver::Product<Vec3>() : elastic_->multiply<Vec3>(tangent_, moved_);
        const double dragged = orderedSum(x.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            double sum = 0;
            for (std::size_t i = begin; i < end; ++i) {
                sum += mass[i] * moved_[i].squaredNorm();
                gradient[i] += inverseDt_ * a_ * mass[i] * moved_[i];
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
        move(start_, leg.at);
        const solver::Product<solver::Vec3f> strained = b_ == 0 ? solver::Product<solver::Vec3f>() : strainOfMove();
        const double taken = orderedSum(mass.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            double sum = 0;
            for (std::size_t i = begin; i < end; ++i) {
                Vec3 force = a_ * mass[i] * moved_[i];
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
        return (start_.capacity() + moved_.capacity()) * sizeof(Vec3) + single_.capacity() * sizeof(solver::Vec3f) +
               tangent_.bytes();
    }

private:
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
    std::vector<Vec3> start_;
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
