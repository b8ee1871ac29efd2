// Measures of the state that a run ends in.
#include "measures.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <functional>

namespace vdbfrac::lab::study {

namespace {

using Measure = Spec::Measure;

const core::Body& bodyOf(const core::Simulation& simulation, const std::string& name)
{
    const auto bodies = simulation.bodies();
    return *std::find_if(bodies.begin(), bodies.end(), [&](const core::Body& b) { return b.name == name; });
}

Value displacement(const core::Simulation& simulation, const Measure& measure)
{
    if (isSplit(simulation, measure.body)) return missing("after a split");
    const auto point = locate(simulation, measure);
    if (!point) return missing("no material at the point");
    return number(componentOf(point->at(simulation.x()) - *measure.point, measure));
}

double peakEnergy(const core::Simulation& simulation)
{
    float peak = 0;
    for (const core::Body& body : simulation.bodies())
        for (const float psi : simulation.energyField(body).scalars) peak = std::max(peak, psi);
    return peak;
}

/// Angular velocity [rad/s] of a body about the axis of its angular momentum, through its center of mass.
double angularVelocity(const core::Simulation& simulation, const core::Body& body)
{
    const auto mass = simulation.elastic().mass();
    const std::size_t first = body.firstNode, last = first + body.mesh->nodeCount();
    Vec3 center = Vec3::Zero(), velocity = Vec3::Zero(), momentum = Vec3::Zero();
    double total = 0, inertia = 0;
    for (std::size_t i = first; i < last; ++i) {
        center += mass[i] * simulation.x()[i], velocity += mass[i] * simulation.v()[i];
        total += mass[i];
    }
    center /= total, velocity /= total;
    for (std::size_t i = first; i < last; ++i)
        momentum += mass[i] * (simulation.x()[i] - center).cross(simulation.v()[i] - velocity);
    if (momentum.norm() == 0) return 0;
    const Vec3 axis = momentum.normalized();
    for (std::size_t i = first; i < last; ++i)
        inertia += mass[i] * axis.cross(simulation.x()[i] - center).squaredNorm();
    return momentum.norm() / inertia;
}

/// Masses [kg] of all fragments, the largest first.
Value fragmentMasses(const core::Simulation& simulation)
{
    Value masses;
    for (const core::Body& body : simulation.bodies())
        for (const tetmesh::Fragment& f : body.fragments.fragments())
            if (f.restVolume > 0) masses.numbers.push_back(f.restVolume * body.material.rho);
    std::sort(masses.numbers.rbegin(), masses.numbers.rend());
    return masses;
}

class AtEnd : public Witness {
public:
    using Take = std::function<Value(const core::Simulation&, const core::StepRecord&)>;
    explicit AtEnd(Take take) : take_(std::move(take)) {}
    Value end(const core::Simulation& simulation, const core::StepRecord& last) override
    {
        return take_(simulation, last);
    }

private:
    Take take_;
};

}  // namespace

bool isSplit(const core::Simulation& simulation, const std::string& body)
{
    const auto& fragments = bodyOf(simulation, body).fragments.fragments();
    return std::any_of(fragments.begin(), fragments.end(), [](const tetmesh::Fragment& f) { return f.parent >= 0; });
}

std::optional<tetmesh::EmbeddedPoint> locate(const core::Simulation& simulation, const Measure& measure)
{
    const core::Body& body = bodyOf(simulation, measure.body);
    auto found = body.mesh->locate(*measure.point);
    if (!found) return {};
    for (std::uint32_t& n : found->point.node) n += body.firstNode;
    return found->point;
}

std::unique_ptr<Witness> makeEndWitness(const Measure& measure)
{
    const auto of = [](AtEnd::Take take) { return std::make_unique<AtEnd>(std::move(take)); };
    const std::string& q = measure.quantity;
    using S = const core::Simulation&;
    using R = const core::StepRecord&;
    if (q == "displacement") return of([measure](S s, R) { return displacement(s, measure); });
    if (q == "energy_norm") return of([](S, R last) { return number(std::sqrt(2 * last.elasticEnergy)); });
    if (q == "peak_energy") return of([](S s, R) { return number(peakEnergy(s)); });
    if (q == "kinetic_energy") return of([](S, R last) { return number(last.kineticEnergy); });
    if (q == "angular_velocity")
        return of([measure](S s, R) { return number(angularVelocity(s, bodyOf(s, measure.body))); });
    if (q == "volume") return of([](S s, R) { return number(s.volume()); });
    if (q == "fragments") return of([](S s, R) { return number(double(s.fragments())); });
    if (q == "fragment_masses") return of([](S s, R) { return fragmentMasses(s); });
    return nullptr;
}

}  // namespace vdbfrac::lab::study
