// Gravity: U(x) = -sum m g.x.
#include "all.h"

#include <vdbfrac/base/number_text.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/phi_sampler.h>

namespace vdbfrac::effects {

namespace {

using scene::Key;
using scene::Type;

const Key kKeys[] = {
    {"acceleration", Type::vector, "m/s^2", "Acceleration of everything that is free to move.", "[0, -9.81, 0]"},
};

class Gravity : public core::Effect, public solver::Potential {
public:
    explicit Gravity(const Vec3& g) : g_(g) {}
    std::string name() const override { return "gravity"; }
    void join(core::Stages& stages) override { stages.solve.push_back(this); }
    void start(const core::SolvedStep&, std::span<const core::Body> bodies, std::vector<std::string>& notes) override
    {
        for (const core::Body& body : bodies) noteWeight(body, notes);
    }
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
    /// At the foot of what stands, weight strains the material by as much.
    void noteWeight(const core::Body& body, std::vector<std::string>& notes) const
    {
        constexpr double kFlat = 1;
        const Bounds box = grid::materialBox(body.phi);  // two voxels wider than all that is inside
        const Vec3 size = (box.upper - box.lower).array() - 2 * body.phi.voxelSize();
        const double pressure = body.material.rho * g_.cwiseAbs().dot(size);
        const double strain = pressure / body.material.youngsModulus();
        if (strain < kFlat) return;
        notes.push_back(
            "body '" + body.name +
            "' would be flattened by its own weight where it stands: density times gravity times its height is " +
            shortNumber(strain, 2) + " times its Young's modulus; are all units m, kg and Pa?");
    }

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
