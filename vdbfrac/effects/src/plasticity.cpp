// Plasticity: what is strained beyond its yield flows, and stays as it has flowed.
//
//   F A   elastic deformation of a tet: A the inverse of what it has flowed, kept symmetric
//   n     |dev e| of an element, e its strain: shear energy mu n^2; the von Mises stress is sqrt(6) mu n
//   y     where it yields: sqrt(2/3) (s_y + H a) / (2 mu), yield stress s_y, hardening H, a the plastic strain so far
//   c     what flows of n - y in a step of dt: (1 - exp(-dt / T)) / (1 + H / (3 mu)), relaxation time T
//         (Duvaut & Lions 1976); with T = 0, 1 / (1 + H / (3 mu))
// Within a step the potential is capped (solver::Yield): no stress is beyond what is left of it, and Newton's line
// search has an energy. After it A takes up what has flowed (plastic_return.h).
// Where material flows its elastic energy Psi grows no more. Cracks are driven by Psi (1 + b W / max(w, Psi)): b the
// share of the work W = sum <s1> da, s1 the largest principal stress (Cockcroft & Latham 1968), w the energy of a bar
// that yields: by Psi + b W in a bar that flows, and by nothing in what is let go.
#include "all.h"
#include "plastic_law.h"
#include "plastic_return.h"
#include "plastic_state.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/transfer.h>
#include <vdbfrac/solver/element.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <optional>

namespace vdbfrac::effects {

namespace {

constexpr const char* kStrain = "plastic_strain";

class Plasticity : public core::Effect,
                   public core::FlowStage,
                   public core::Reporter,
                   public core::Persistent,
                   public core::FrameSource {
public:
    Plasticity(const scene::Values& values, const scene::Scene& scene) : values_(values)
    {
        for (const scene::Body& body : scene.bodies) materials_.push_back(body.material);
    }
    std::string name() const override { return "plasticity"; }
    void join(core::Stages& stages) override
    {
        stages.flow.push_back(this);
        stages.reporters.push_back(this);
        stages.persistent.push_back(this);
        stages.frames.push_back(this);
    }
    void start(const core::SolvedStep&, std::span<const core::Body> bodies, std::vector<std::string>&) override
    {
        bodies_ = bodies;
        flowing_.assign(bodies.size(), {});
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            flowing_[b].law = plasticLaw(values_, materials_[b], bodies[b].material);
            flowing_[b].yield.first = flowing_[b].law.yieldStrain(0);
        }
    }

    void describe(const core::Body& body, solver::ElementSet& elements) const override
    {
        const Flowing& own = of(body);
        elements.yield = &own.yield;
        if (own.state.any()) elements.inverseFlow = &own.state.inverse;
    }
    void begin(double dt) override
    {
        for (Flowing& own : flowing_) own.yield.share = own.law.share(dt);
    }
    bool flow(const core::SolvedStep& step, const solver::ElasticOperator& elastic) override;
    void carry(const core::Body& body, const tetmesh::CutUpdate& update) override
    {
        Flowing& own = flowing_[numberOf(body)];
        own.state.carry(*body.mesh, update.previousElement);
        own.tell(*body.mesh);
    }
    std::span<const core::DrivingWork> drivingWork(const core::Body& body) const override { return of(body).driving; }
    void report(Ledger& work, std::map<std::string, double>& measured) override;

    void save(std::span<const core::Body> bodies, core::Archive& archive) const override
    {
        for (const core::Body& body : bodies) effects::save(of(body).state, body, archive);
    }
    void restoreFrom(const core::Archive& archive, std::span<const core::Body> bodies) override
    {
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            flowing_[b].state = restoredPlasticState(archive, bodies[b]);
            flowing_[b].tell(*bodies[b].mesh);
        }
    }
    void refineFrom(const core::Refinement& wide, std::span<const core::Body> bodies) override
    {
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            const PlasticState state = restoredPlasticState(wide.archive, wide.bodies[b]);
            flowing_[b].state.take(*bodies[b].mesh, state, *wide.bodies[b].mesh);
            flowing_[b].tell(*bodies[b].mesh);
        }
    }

    std::vector<Field> fields() const override { return {{kStrain, "1"}}; }
    core::FrameGrid take(const core::Body& body, const std::string&) const override
    {
        const PlasticState& state = of(body).state;
        if (!state.any()) return grid::VoxelValues();
        return grid::nodalEnergies(*body.mesh, [&](std::uint32_t e, int t) { return state.strain(e, std::size_t(t)); });
    }

private:
    /// A body.
    struct Flowing {
        PlasticLaw law;
        PlasticState state;
        solver::Yield yield{kInfinity, {}, 0};  // between steps nothing flows
        std::vector<core::DrivingWork> driving;

        /// What others see of the state.
        void tell(const tetmesh::BodyMesh& mesh)
        {
            if (!state.any()) return;
            yield.strain = state.yieldStrains(mesh, law), driving = state.drivingWork(law);
        }
        /// Returns whether it moves: not what is too flat, or inverted.
        bool flowElement(const tetmesh::BodyMesh& mesh, std::size_t e, double n, std::span<const Vec3> x,
                         double meanStrain);
        ElasticTets tetsOf(const tetmesh::BodyMesh& mesh, std::size_t e, std::span<const Vec3> x,
                           double meanStrain) const;
    };
    std::size_t numberOf(const core::Body& body) const { return std::size_t(&body - bodies_.data()); }
    const Flowing& of(const core::Body& body) const { return flowing_[numberOf(body)]; }

    scene::Values values_;
    std::vector<std::string> materials_;  // by body
    std::span<const core::Body> bodies_;
    std::vector<Flowing> flowing_;  // by body
    std::vector<double> n_;         // of all elements
    Ledger work_;
};

bool Plasticity::flow(const core::SolvedStep& step, const solver::ElasticOperator& elastic)
{
    constexpr double kBeyond = 1 + 1e-6;  // as exactly as elements go back
    const StageTimer timer(work_, "flow");
    elastic.shearStrains(step.x, n_);
    bool any = false;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        const core::Body& body = bodies_[b];
        const tetmesh::BodyMesh& mesh = *body.mesh;
        Flowing& own = flowing_[b];
        const std::span<const double> n = std::span(n_).subspan(body.firstElement, mesh.elements().size());
        std::vector<std::uint32_t> yielding;
        for (std::uint32_t e = 0; e < n.size(); ++e)
            if (n[e] > kBeyond * own.yield.of(e)) yielding.push_back(e);
        if (!yielding.empty() && !own.state.any()) own.state.begin(n.size());
        std::atomic<std::int64_t> moved = 0;
        const std::span<const Vec3> x = step.x.subspan(body.firstNode, mesh.nodeCount());
        parallelChunks(yielding.size(), 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                moved += own.flowElement(mesh, yielding[i], n[yielding[i]], x, elastic.elasticity().meanStrain);
        });
        work_.count("flow", "elements", moved);
        work_.count("flow", "stuck", std::int64_t(yielding.size()) - moved);
        if (moved > 0) own.tell(mesh);
        any |= moved > 0;
        own.yield.share = 0;
    }
    return any;
}

/// Its tets go back together, with their volume. In long steps that makes pressure, as the bulk energy is of tr e: no
/// more of what is dissipated than a part of it goes there, and the rest of the volume goes.
bool Plasticity::Flowing::flowElement(const tetmesh::BodyMesh& mesh, std::size_t e, double n, std::span<const Vec3> x,
                                      double meanStrain)
{
    constexpr double kIntoPressure = .1;
    const tetmesh::CellElement& element = mesh.elements()[e];
    const ElasticTets tets = tetsOf(mesh, e, x, meanStrain);
    const double beyond = yield.share * (n - yield.of(e));
    const std::optional<PlasticReturn> back = plasticReturn(tets, n - beyond);
    if (!back) return false;
    const double after = back->shearStrain, now = tets.dilation(), wanted = back->flowed.dilation();
    const double held = n - yield.of(e), dissipated = law.mu * (n * n - yield.share * held * held - after * after);
    const double largest = std::sqrt(now * now + 2 * kIntoPressure * std::max(0., dissipated) / law.K);
    const double wider = (3 + boundedDilation(now, wanted, largest)) / (3 + wanted);
    const double strain = std::sqrt(2. / 3) * std::max(0., n - after);
    const double tension = tensionOf(tets.mean(), 1 - beyond / n, law.mu, law.K) * strain;
    for (std::size_t t = 0; t < tetmesh::kMaxTets; ++t) {
        if (!(element.fraction[t] > 0)) continue;
        state.inverse(e, t) = symmetricFlow(wider * state.inverse(e, t) * back->B[t]);
        state.strain(e, t) += strain, state.tension(e, t) += tension;
    }
    return true;
}

ElasticTets Plasticity::Flowing::tetsOf(const tetmesh::BodyMesh& mesh, std::size_t e, std::span<const Vec3> x,
                                        double meanStrain) const
{
    const tetmesh::CellElement& element = mesh.elements()[e];
    const tetmesh::CellTets& shape = tetmesh::cellTets(element.shape);
    const solver::ElementOf of{element, mesh.gradients().empty() ? nullptr : &mesh.gradients()[e], mesh.spacing(),
                               &state.inverse(e, 0)};
    ElasticTets tets;
    tets.meanStrain = shape.count > 1 ? meanStrain : 0;
    double volume = 0;
    for (std::size_t t = 0; t < std::size_t(shape.count); ++t) {
        if (!(element.fraction[t] > 0)) continue;
        tets.F[t] = solver::deformationGradient(of, t, x);
        volume += tets.part[t] = shape.volume[t] * element.fraction[t];
    }
    for (double& part : tets.part) part /= volume;
    return tets;
}

void Plasticity::report(Ledger& work, std::map<std::string, double>& measured)
{
    work.add(work_), work_.clear();
    double most = 0;
    for (const Flowing& own : flowing_)
        for (const double strain : own.state.strain.values()) most = std::max(most, strain);
    measured["plastic_strain_max"] = most;
}

std::unique_ptr<core::Effect> make(const scene::Values& values, const scene::Scene& scene)
{
    using enum scene::Integrator;
    const auto complain = [&](const std::string& key, const std::string& given, const std::string& allowed) {
        throw InputError({scene.file.string() + ": [plasticity]",
                          "plasticity does not support solver." + key + " = \"" + given + "\"", allowed, ""});
    };
    if (scene.solver.integrator != backwardEuler && scene.solver.integrator != statics)
        complain("integrator", scene::nameOf(scene.solver.integrator), "\"backward_euler\" or \"static\"");
    if (scene.solver.strain != scene::Strain::corotational)
        complain("strain", scene::nameOf(scene.solver.strain), "\"corotational\"");
    return std::make_unique<Plasticity>(values, scene);
}

}  // namespace

EffectInfo plasticity()
{
    // A, its strains and tables of an operator twice: 690 in rods of 62 and 453 thousand tets.
    constexpr double kBytesPerTet = 700;
    return {.table = {"plasticity", "Material strained beyond its yield point flows, and keeps its new shape.",
                      plasticityTable(), checkPlasticity},
            .stages = "solve, after it, field 'plastic_strain'",
            .make = make,
            .fields = {kStrain},
            .bytesPerTet = kBytesPerTet};
}

}  // namespace vdbfrac::effects
