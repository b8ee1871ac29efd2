// Uses vdbfrac as libraries: a soft bar is hung up by one end and sags under its weight, in a wind that is an effect of
// this program.
#include <vdbfrac/base/error.h>
#include <vdbfrac/core/simulation.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/grid/openvdb.h>
#include <vdbfrac/scene/reader.h>

#include <openvdb/tools/LevelSetSphere.h>

#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>

constexpr const char* kScene = R"(
version = 1
[grid]
voxel_size = 0.1
[[body]]
name = "bar"
shape = { box = { size = [0.4, 1.2, 0.4] } }
material = "gel"
[material.gel]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
[[grip]]
body = "bar"
region = { halfspace = { normal = "y", offset = 0.55 } }
move = { velocity = [0, 0, 0] }
[gravity]
[breeze]
acceleration = [2, 0, 0]
)";

namespace {

using vdbfrac::Vec3;

const vdbfrac::scene::Key kBreezeKeys[] = {
    {"acceleration", vdbfrac::scene::Type::vector, "m/s^2", "What the air gives to all material.",
     vdbfrac::scene::kRequired},
};

/// U(x) = -sum over nodes of m a . x
class Breeze : public vdbfrac::core::Effect, public vdbfrac::solver::Potential {
public:
    explicit Breeze(const vdbfrac::scene::Values& values) : a_(values.vector("acceleration")) {}

    std::string name() const override { return "breeze"; }
    void join(vdbfrac::core::Stages& stages) override { stages.solve.push_back(this); }
    void begin(const vdbfrac::solver::StepStart& start) override { mass_ = start.elastic.mass(); }
    double evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const override
    {
        double energy = 0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            energy -= mass_[i] * a_.dot(x[i]);
            gradient[i] -= mass_[i] * a_;
        }
        return energy;
    }
    vdbfrac::solver::EnergyFlow flow(const vdbfrac::solver::Leg& leg) const override
    {
        double work = 0;
        for (std::size_t i = 0; i < leg.to.size(); ++i) work += mass_[i] * a_.dot(leg.to[i] - leg.from[i]);
        return {.work = work};
    }

private:
    Vec3 a_;
    std::span<const double> mass_;  // of the nodes [kg], until the next cut
};

}  // namespace

int main()
try {
    auto vocabulary = vdbfrac::effects::vocabulary();
    vocabulary.tables.push_back({"breeze", "A wind that blows alike everywhere.", kBreezeKeys});
    const auto scene = vdbfrac::scene::parseScene(kScene, "built-in", vocabulary);
    auto effects = vdbfrac::effects::makeEffects(scene);  // has to outlive the simulation
    if (const auto* breeze = scene.table("breeze")) effects.push_back(std::make_unique<Breeze>(*breeze));
    std::vector<vdbfrac::core::Effect*> pointers;
    for (const auto& effect : effects) pointers.push_back(effect.get());
    const std::uint64_t memoryLimit = std::uint64_t(1) << 30;  // bytes
    vdbfrac::core::Simulation bar(scene, pointers, memoryLimit);

    const auto step = bar.step(1 / scene.time.fps);
    const double weight = 0.4 * 1.2 * 0.4 * 1000 * 9.81;
    std::printf("after %.3f s the grip carries %.1f N, the bar weighs %.1f N\n", bar.time(), step.gripLoad[0].y(),
                weight);
    if (!(step.energyFlow.at("breeze_work") > 0)) return 1;
    // A level set of the program that this is loaded into, and back.
    const auto ball = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(0.3f, openvdb::Vec3f(0), 0.05f);
    const auto phi = vdbfrac::grid::fromOpenVdb(*ball).levelSet;
    if (vdbfrac::grid::toOpenVdb(phi)->activeVoxelCount() != ball->activeVoxelCount()) return 1;
    return step.outcome == vdbfrac::core::Outcome::converged && step.gripLoad[0].y() > 0 ? 0 : 1;
} catch (const vdbfrac::Error& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 2;
}
