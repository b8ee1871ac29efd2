#include <vdbfrac/lab/verify/energy_witness.h>

#include <vdbfrac/base/primitive.h>
#include <vdbfrac/lab/samples/loads.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::lab::verify {

namespace {

// As the solver reckons its own: some ten roundings of a double, for forces and for sums of energies.
constexpr double kForceRounding = 2e-15, kEnergyRounding = 1e-14;

double dot(const std::vector<Vec3>& a, const std::vector<Vec3>& b)
{
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
    return sum;
}

double norm(const std::vector<Vec3>& a) { return std::sqrt(dot(a, a)); }

/// Elastic energy without mean dilatation.
double unaveraged(const solver::ElasticOperator& elastic, std::span<const Vec3> x)
{
    return solver::ElasticOperator(elastic.sets(), x.size(), elastic.h(),
                                   {solver::Volumetric::none, elastic.elasticity().strain})
        .evaluate(x, {}, nullptr);
}

}  // namespace

struct EnergyWitness::Held {
    std::vector<std::uint8_t> fixed;                // of each node
    std::vector<Vec3> force;                        // N on each node
    std::vector<std::vector<std::uint32_t>> nodes;  // of each grip

    explicit Held(std::size_t nodeCount) : fixed(nodeCount), force(nodeCount, Vec3::Zero()) {}

    /// Load of each grip, from the reactions of the nodes that are fixed.
    std::vector<Vec3> loads(std::span<const Vec3> reaction) const
    {
        std::vector<Vec3> loads;
        for (const auto& gripped : nodes) {
            Vec3& load = loads.emplace_back(Vec3::Zero());
            for (std::uint32_t n : gripped) load += fixed[n] ? reaction[n] : force[n];
        }
        return loads;
    }
};

void EnergyWitness::watch(const core::Simulation& simulation, const scene::Scene& scene)
{
    simulation_ = &simulation;
    scene_ = &scene;
    x_.assign(simulation.x().begin(), simulation.x().end());
    v_.assign(simulation.v().begin(), simulation.v().end());
    time_ = simulation.time();
}

/// What docs/scene.md promises of grips, found without the code that does it.
EnergyWitness::Held EnergyWitness::held() const
{
    constexpr double kSlack = 1e-3;  // cells: a region that ends on a plane of nodes holds them
    Held held(x_.size());
    const auto mass = simulation_->elastic().mass();
    for (const scene::Grip& grip : scene_->grips) {
        auto& nodes = held.nodes.emplace_back();
        double total = 0;
        for (const core::Body& body : simulation_->bodies())
            for (std::uint32_t n = 0; body.name == grip.body && n < body.mesh->nodeCount(); ++n)
                if (signedDistance(grip.region, body.mesh->restPosition(n)) <= kSlack * body.mesh->spacing()) {
                    nodes.push_back(body.firstNode + n);
                    total += mass[nodes.back()];
                }
        const auto* force = std::get_if<scene::Force>(&grip.move);
        const double share = force && force->ramp > 0 ? std::min(1., simulation_->time() / force->ramp) : 1;
        for (std::uint32_t n : nodes)
            if (force)
                held.force[n] += mass[n] / total * share * force->force;
            else
                held.fixed[n] = 1;
    }
    return held;
}

void EnergyWitness::observe(const core::SolvedStep& step)
{
    if (!simulation_) return;
    const solver::ElasticOperator& elastic = simulation_->elastic();
    const auto mass = elastic.mass(), stiffness = elastic.stiffness();
    const std::vector<Vec3> x(step.x.begin(), step.x.end());
    const std::size_t count = x.size();
    const double inverse = 1 / (step.dt * step.dt);
    const Held grips = held();
    balance_ = {};

    // Energies, and the forces of each kind at the end.
    std::vector<Vec3> gradient(count, Vec3::Zero()), outer(count, Vec3::Zero()), unused(count, Vec3::Zero());
    const double elasticBefore = elastic.evaluate(x_, {}, nullptr);
    balance_.elastic = elastic.evaluate(x, gradient, nullptr);
    double potential = 0, magnitude = 0;
    for (const solver::Potential* p : simulation_->stages().solve) {
        const double before = p->evaluate(x_, unused), after = p->evaluate(x, outer);
        potential += after - before;
        magnitude += std::abs(after) + std::abs(before);
    }
    const double kineticBefore = kineticEnergy(elastic, v_);
    balance_.kinetic = kineticEnergy(elastic, simulation_->v());

    // What holds each node, and how far it went.
    std::vector<Vec3> moved(count), inertia(count), reaction(count), freeMove(count, Vec3::Zero()), freeForces[3];
    for (auto& f : freeForces) f.assign(count, Vec3::Zero());
    double work = 0, noise = 0, stretched = 0;
    for (std::size_t i = 0; i < count; ++i) {
        moved[i] = x[i] - x_[i];
        inertia[i] = mass[i] * inverse * (moved[i] - step.dt * v_[i]);
        reaction[i] = inertia[i] + gradient[i] + outer[i] - grips.force[i];
        const double k = stiffness[i] + mass[i] * inverse, size2 = std::max(x[i].squaredNorm(), x_[i].squaredNorm());
        noise += k * k * size2;
        stretched += stiffness[i] * size2;
        work += grips.force[i].dot(moved[i]);
        if (grips.fixed[i]) {
            work += reaction[i].dot(moved[i]);
            continue;
        }
        freeMove[i] = moved[i];
        freeForces[0][i] = inertia[i], freeForces[1][i] = gradient[i], freeForces[2][i] = outer[i] - grips.force[i];
    }
    balance_.gripLoad = grips.loads(reaction);

    const double slope = dot(gradient, moved);
    balance_.growth = balance_.kinetic - kineticBefore + balance_.elastic - elasticBefore + potential - work;
    balance_.turnover = balance_.kinetic + kineticBefore + std::abs(balance_.elastic) + std::abs(elasticBefore) +
                        magnitude + std::abs(work);
    balance_.nonconvex =
        std::max(0., balance_.elastic - elasticBefore - slope) + std::max(0., potential - dot(outer, moved));
    balance_.openWork = std::max({norm(freeForces[0]), norm(freeForces[1]), norm(freeForces[2])}) * norm(freeMove);
    balance_.forceRounding = kForceRounding * std::sqrt(noise * double(count));
    balance_.rounding = kEnergyRounding * (balance_.turnover + std::abs(slope)) +
                        kForceRounding * (std::sqrt(noise) * norm(moved) +
                                          std::sqrt(stretched * std::max({0., balance_.elastic, elasticBefore})));
    if (!simulation_->stages().grid.empty()) balance_.unaveraged = unaveraged(elastic, x);
}

}  // namespace vdbfrac::lab::verify
