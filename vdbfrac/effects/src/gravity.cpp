// Gravity: U(x) = -sum m g.x.
#include "all.h"

#include <vdbfrac/base/parallel.h>

namespace vdbfrac::effects {

namespace {

using scene::Key;
using scene::Type;

const Key kKeys[] = {
    {"acceleration", Type::vector, "m/s^2", "acceleration of everything that is free to move", "[0, -9.81, 0]"},
};

class Gravity : public core::Effect, public solver::Potential {
public:
    explicit Gravity(const Vec3& g) : g_(g) {}
    std::string name() const override { return "gravity"; }
    void join(core::Stages& stages) override { stages.solve.push_back(this); }
    void begin(const solver::StepStart& start) override { mass_ = start.elastic.mass(); }

    double evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const override
    {
        double energy = 0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            energy -= mass_[i] * g_.dot(x[i]);
            gradient[i] -= mass_[i] * g_;
        }
        return energy;
    }

    solver::EnergyFlow flow(const solver::Leg& leg) const override
    {
        const double work = orderedSum(mass_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            double sum = 0;
            for (std::size_t i = begin; i < end; ++i) sum += mass_[i] * g_.dot(leg.to[i] - leg.from[i]);
            return sum;
        });
        return {work, 0, 0};
    }

private:
    Vec3 g_;
    std::span<const double> mass_;
};

std::unique_ptr<core::Effect> make(const scene::Values& values, const scene::Scene&)
{
    return std::make_unique<Gravity>(values.vector("acceleration"));
}

}  // namespace

EffectInfo gravity() { return {{"gravity", "Weight.", kKeys}, "solve", make}; }

}  // namespace vdbfrac::effects
