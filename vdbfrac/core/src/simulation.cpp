#include <vdbfrac/core/simulation.h>

#include "make_body_mesh.h"
#include "grips.h"
#include "rest_notes.h"
#include "solver_settings.h"
#include "step_control.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/body_level_set.h>
#include <vdbfrac/grid/transfer.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

namespace vdbfrac::core {

namespace {

constexpr double kRounding = 1e-9;  // frames

/// Takes one body's part of a field along to its new nodes; `first`: where the part begins.
void carry(std::vector<Vec3>& field, std::size_t first, std::size_t oldCount,
           std::span<const std::uint32_t> previousNode)
{
    std::vector<Vec3> now(field.size() - oldCount + previousNode.size());
    std::copy_n(field.begin(), first, now.begin());
    parallelChunks(previousNode.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) now[first + i] = field[first + previousNode[i]];
    });
    std::copy(field.begin() + std::ptrdiff_t(first + oldCount), field.end(),
              now.begin() + std::ptrdiff_t(first + previousNode.size()));
    field = std::move(now);
}

}  // namespace

/// What every simulation can give to the frames: phi and the nodal energy.
class Simulation::StateFields : public FrameSource {
public:
    explicit StateFields(const Simulation& simulation) : simulation_(simulation) {}
    std::vector<Field> fields() const override { return {{"phi", "m"}, {"energy", "J/m^3"}}; }
    FrameGrid take(const Body& body, const std::string& field) const override
    {
        if (field == "phi") return body.phi.copy();
        return simulation_.energyField(body);
    }

private:
    const Simulation& simulation_;
};

Simulation::Simulation(const scene::Scene& scene, std::span<Effect* const> effects, std::uint64_t memoryLimit)
    : timeSettings_(scene.time), solverSettings_(scene.solver), h_(scene.grid.coarsening * scene.grid.voxelSize)
{
    for (const scene::Body& body : scene.bodies) addBody(scene, body, memoryLimit);
    grips_ = std::make_unique<Grips>(scene.grips, scene.time.fps, bodies_);
    rebuild();
    grips_->requireNodes(scene.time.end());
    for (std::size_t b = 0; b < bodies_.size(); ++b) setInitialVelocity(scene.bodies[b], bodies_[b]);
    if (schemeOf(scene.solver) != solver::Scheme::statics) grips_->setStartVelocities(state_.v);
    fields_ = std::make_unique<StateFields>(*this);
    if (scene.output.followsNodes()) ancestry_ = std::make_unique<Ancestry>(bodies_);
    stages_.frames.push_back(fields_.get());
    for (Effect* effect : effects) {
        effect->join(stages_);
        potentialNames_.resize(stages_.solve.size(), effect->name());
        flowNames_.resize(stages_.flow.size(), effect->name());
        persistentOwners_.resize(stages_.persistent.size(), effect);
    }
    stepControl_ = std::make_unique<StepControl>(scene.time, h_);
    noteRestState(scene, bodies_, h_, stages_.notes);
    noteGrips(
        scene, bodies_, [this](std::size_t g) { return gripNodes(g); }, stages_.notes);
    if (!stages_.sleep.empty()) asleep_.resize(nextFragment_);
    for (Effect* effect : effects) start(*effect);
    if (!stages_.flow.empty()) rebuild();
    warnOfLongSteps();
    beginEnergy();
}

Simulation::~Simulation() = default;

void Simulation::addBody(const scene::Scene& scene, const scene::Body& spec, std::uint64_t memoryLimit)
{
    const scene::Material& m = scene.materialOf(spec);
    Body body;
    body.name = spec.name;
    body.material = solver::makeMaterial(m.youngsModulus, m.poissonRatio, m.density);
    body.phi = grid::makeLevelSet(spec, scene.grid, memoryLimit, &stages_.notes);
    makeBodyMesh(scene.grid, spec, memoryLimit, nextFragment_, body, stages_.notes);
    if (body.mesh->nodeCount() == 0)
        throw InputError({spec.place, "body '" + spec.name + "' holds no material on the lattice",
                          "at least one voxel inside", "make grid.voxel_size smaller than the body"});
    body.startVolume = body.mesh->volume();
    const std::vector<Vec3> rest = tetmesh::restPositions(*body.mesh);
    state_.x.insert(state_.x.end(), rest.begin(), rest.end());
    state_.v.resize(state_.x.size(), Vec3::Zero());
    bodies_.push_back(std::move(body));
}

void Simulation::warnOfLongSteps()
{
    const double stable = integrator_->largestStep(stages_.solve, state_.x), frame = 1 / timeSettings_.fps;
    if (timeSettings_.substeps == 0 || frame / timeSettings_.substeps <= stable) return;
    stages_.notes.push_back("time steps of " + shortNumber(frame / timeSettings_.substeps, 3) +
                            " s are too long: the integrator is unstable beyond " + shortNumber(stable, 3) +
                            " s; take time.substeps = " + shortNumber(std::ceil(frame / stable), 15) + " or \"auto\"");
}

void Simulation::setInitialVelocity(const scene::Body& spec, const Body& body)
{
    Vec3 center = Vec3::Zero();
    double mass = 0;
    const auto masses = elastic_->mass();
    for (std::size_t i = body.firstNode; i < body.firstNode + body.mesh->nodeCount(); ++i) {
        center += masses[i] * state_.x[i];
        mass += masses[i];
    }
    center /= mass;
    for (std::size_t i = body.firstNode; i < body.firstNode + body.mesh->nodeCount(); ++i)
        state_.v[i] = spec.velocity + spec.angularVelocity.cross(state_.x[i] - center);
}

/// Nodes and elements of all bodies follow each other.
void Simulation::number()
{
    std::uint32_t node = 0, element = 0;
    for (Body& body : bodies_) {
        body.firstNode = node, body.firstElement = element;
        node += std::uint32_t(body.mesh->nodeCount()), element += std::uint32_t(body.mesh->elements().size());
    }
}

/// Of the meshes and what has flowed as they are now.
std::unique_ptr<solver::ElasticOperator> Simulation::makeOperator() const
{
    std::vector<solver::ElementSet> sets;
    std::uint32_t nodes = 0;
    for (const Body& body : bodies_) {
        nodes += std::uint32_t(body.mesh->nodeCount());
        sets.push_back(
            {body.mesh->elements(), body.mesh->latticeCoords(), body.firstNode, body.material, body.mesh->gradients()});
        for (const FlowStage* stage : stages_.flow) stage->describe(body, sets.back());
    }
    return std::make_unique<solver::ElasticOperator>(sets, nodes, h_, elasticityOf(solverSettings_));
}

/// Operator and grips for the meshes as they are now.
void Simulation::rebuild()
{
    number();
    elastic_ = makeOperator();
    bindOperator();
}

void Simulation::bindOperator()
{
    if (integrator_)
        integrator_->rebind(*elastic_);
    else
        integrator_ = solver::makeIntegrator(schemeOf(solverSettings_), *elastic_, newtonSettingsOf(solverSettings_));
    grips_->rebuild(bodies_, *elastic_);
    if (!asleep_.empty()) holdAsleep();
}

int Simulation::framesDone() const { return int(std::floor(time_ * timeSettings_.fps + kRounding)); }

int Simulation::frameUnderWay() const { return std::max(1, int(std::ceil(time_ * timeSettings_.fps - kRounding))); }

std::span<const std::uint32_t> Simulation::gripNodes(std::size_t grip) const
{
    if (grip >= grips_->count())
        throw InputError({"grip " + std::to_string(grip), "there is none of that number",
                          "less than " + std::to_string(grips_->count()), "the first is grip 0"});
    return grips_->nodes(grip);
}

StepRecord Simulation::step(double until)
{
    if (!(until > time_) || !std::isfinite(until))
        throw InputError({"the end of a step", shortNumber(until, 6) + " s",
                          "a time after " + shortNumber(time_, 6) + " s, where the simulation is", ""});
    StepRecord record;
    solve(record, grips_->endOfStep(time_, until));
    updateGrid(record);
    measure(record);
    kineticEnergy_ = record.kineticEnergy;
    letGoOfGrips();
    return record;
}

void Simulation::updateGrid(StepRecord& record)
{
    const SolvedStep solved{state_.x, time_, record.dt};
    bool computed = false;
    GridContext context{solved, {}, {}, {}, {}, {}, record.work, record.measured};
    context.gripDistance = [this](const Body& body, const Vec3& X) { return grips_->distance(body, X); };
    context.tetEnergy = [&]() -> std::span<const double> {
        if (!computed) {
            const StageTimer timer(record.work, "energy");
            const std::int64_t before = elastic_->work().evaluatedTets;
            elastic_->energyDensities(state_.x, density_);
            record.work.count("energy", "tets", elastic_->work().evaluatedTets - before);
            clearAsleep(density_);
            computed = true;
        }
        return density_;
    };
    context.drivingWork = [this](const Body& body) -> std::span<const DrivingWork> {
        for (const FlowStage* stage : stages_.flow)
            if (const auto works = stage->drivingWork(body); !works.empty()) return works;
        return {};
    };
    context.elementStress = [&](const Body& body, std::uint32_t e) {
        return solver::elementStress(elementOf(body, e), solved.x.subspan(body.firstNode), body.material,
                                     elastic_->elasticity());
    };
    context.elementForces = [&](const Body& body, std::uint32_t e) {
        return solver::elementForces(elementOf(body, e), solved.x.subspan(body.firstNode), body.material,
                                     elastic_->elasticity());
    };
    std::vector<grid::PhiChanges> changes(bodies_.size());
    for (GridStage* stage : stages_.grid)
        for (std::size_t b = 0; b < bodies_.size(); ++b) {
            const grid::PhiChanges more = stage->update(context, bodies_[b], bodies_[b].phi);
            changes[b].insert(changes[b].end(), more.begin(), more.end());
        }
    bool isRecut = false;
    for (std::size_t b = 0; b < bodies_.size(); ++b)
        if (!changes[b].empty()) isRecut |= recut(record, b, changes[b]);
    if (!isRecut) return;
    const StageTimer timer(record.work, "rebuild");
    rebuild();
}

/// Re-cuts what changed and carries x and v exactly: a copy of a node starts where its original is. Returns whether
/// the mesh is another one.
bool Simulation::recut(StepRecord& record, std::size_t b, const grid::PhiChanges& changes)
{
    Body& body = bodies_[b];
    const StageTimer timer(record.work, "cut");
    const std::size_t oldCount = body.mesh->nodeCount();
    const tetmesh::CutUpdate update = body.mesh->update(changes);
    record.work.count("cut", "cells", update.cutCells);
    record.work.count("cut", "voxels", update.changedVoxels);
    record.work.count("cut", "classified_nodes", update.classifiedNodes);
    record.work.count("cut", "grouped_cells", update.groupedCells);
    // Whole tets may all stay. What is drawn of them, and where they touch, goes by phi all the same.
    const bool isCut = update.changedVoxels > 0;
    if (isCut) carryOver(body, update, oldCount);
    ++body.revision;
    for (RecutStage* stage : stages_.recut) stage->recut(body, update);
    return isCut;
}

void Simulation::carryOver(Body& body, const tetmesh::CutUpdate& update, std::size_t oldCount)
{
    balanced_ = false;
    const auto own = [&] { return std::span(state_.x).subspan(body.firstNode); };
    const auto energyOf = [&](const solver::ElementOf& e) {
        return solver::elasticEnergy(e, own(), body.material, elastic_->elasticity());
    };
    const solver::ElementSet& old = elastic_->sets()[std::size_t(&body - bodies_.data())];
    double gone = 0;  // J: of elements that were replaced, less those in their place
    for (const auto& r : update.previousElement.replaced)
        gone += energyOf({r.element, &r.gradients, h_, old.inverseFlow ? &(*old.inverseFlow)(r.old, 0) : nullptr});
    for (std::vector<Vec3>* field : {&state_.x, &state_.v})
        carry(*field, body.firstNode, oldCount, update.previousNode);
    number();  // of the bodies after it, which may be cut before all is built anew
    for (FlowStage* stage : stages_.flow) stage->carry(body, update);
    for (const auto& r : update.previousElement.recut) gone -= energyOf(elementOf(body, r.element));
    elasticEnergy_ -= gone;
    body.fragments.update(*body.mesh, update.previousNode, time_, nextFragment_);
    if (ancestry_) ancestry_->recut(std::size_t(&body - bodies_.data()), *body.mesh, update, frameUnderWay());
    if (!asleep_.empty()) wakeRecut(body, update);
}

/// As it is cut now, with what it has flowed.
solver::ElementOf Simulation::elementOf(const Body& body, std::uint32_t e) const
{
    const std::span<const tetmesh::TetGradients> gradients = body.mesh->gradients();
    solver::ElementSet set;
    for (const FlowStage* stage : stages_.flow) stage->describe(body, set);
    return {body.mesh->elements()[e], gradients.empty() ? nullptr : &gradients[e], h_,
            set.inverseFlow ? &(*set.inverseFlow)(e, 0) : nullptr};
}

void Simulation::measure(StepRecord& record) const
{
    if (!stages_.grid.empty()) {
        const double solved = record.kineticEnergy + record.elasticEnergy;
        record.kineticEnergy = kineticEnergy(state_.v);
        record.elasticEnergy = elasticEnergy_;
        record.energyFlow["removed"] = solved - record.kineticEnergy - record.elasticEnergy;
    }
    record.volume = volume();
    record.fragments = fragments();
    record.nodes = state_.x.size();
    record.tets = elastic_->tetCount();
}

double Simulation::volume() const
{
    double sum = 0;
    for (const Body& body : bodies_) sum += body.mesh->volume();
    return sum;
}

double Simulation::startVolume() const
{
    double sum = 0;
    for (const Body& body : bodies_) sum += body.startVolume;
    return sum;
}

std::size_t Simulation::fragments() const
{
    std::size_t sum = 0;
    for (const Body& body : bodies_) sum += body.fragments.alive();
    return sum;
}

grid::VoxelValues Simulation::energyField(const Body& body) const
{
    std::vector<double> density;
    elastic_->energyDensities(state_.x, density, true);
    return grid::nodalEnergies(*body.mesh, [&](std::uint32_t e, int t) {
        return density[tetmesh::tetEntry(body.firstElement + e, std::size_t(t))];
    });
}

}  // namespace vdbfrac::core
