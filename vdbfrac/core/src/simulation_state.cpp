// What lives on between the steps of a simulation: its fingerprint, and how checkpoints keep it.
#include <vdbfrac/core/simulation.h>

#include "grips.h"
#include "step_control.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/hash.h>
#include <vdbfrac/grid/phi_nodes.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace vdbfrac::core {

namespace {

std::string nameOf(const Body& body) { return "body." + body.name; }

void saveFragments(const Body& body, Archive& archive)
{
    std::vector<std::uint32_t> id;
    std::vector<std::int64_t> parent;
    std::vector<double> birth, volume;
    for (const tetmesh::Fragment& f : body.fragments.fragments())
        id.push_back(f.id), parent.push_back(f.parent), birth.push_back(f.birth), volume.push_back(f.restVolume);
    const std::string name = nameOf(body) + ".fragment";
    archive.put(name + ".id", id);
    archive.put(name + ".parent", parent);
    archive.put(name + ".birth", birth);
    archive.put(name + ".rest_volume", volume);
    archive.put(name + ".of_node", body.fragments.ofNode());
}

tetmesh::FragmentTracker loadFragments(const Body& body, const Archive& archive)
{
    const std::string name = nameOf(body) + ".fragment";
    const auto id = archive.get<std::uint32_t>(name + ".id");
    const auto parent = archive.get<std::int64_t>(name + ".parent", id.size());
    const auto birth = archive.get<double>(name + ".birth", id.size()),
               volume = archive.get<double>(name + ".rest_volume", id.size());
    std::vector<std::uint32_t> ofNode = archive.get<std::uint32_t>(name + ".of_node", body.mesh->nodeCount());
    if (std::adjacent_find(id.begin(), id.end(), std::greater_equal<>()) != id.end())
        archive.complain("the fragments of '" + body.name + "' are not in order");
    for (std::uint32_t f : ofNode)
        if (!std::binary_search(id.begin(), id.end(), f))
            archive.complain("a node of '" + body.name + "' is in no fragment");
    std::vector<tetmesh::Fragment> fragments;
    for (std::size_t i = 0; i < id.size(); ++i) fragments.push_back({id[i], parent[i], birth[i], volume[i]});
    return {std::move(fragments), std::move(ofNode)};
}

void savePhi(const Body& body, Archive& archive)
{
    const grid::BandLeaves leaves = grid::bandLeaves(body.phi);
    archive.put(nameOf(body) + ".leaf.origin", leaves.origins);
    archive.put(nameOf(body) + ".leaf.phi", leaves.values);
    archive.put(nameOf(body) + ".leaf.active", leaves.active);
}

grid::PhiChanges loadPhi(Body& body, const Archive& archive)
{
    grid::BandLeaves leaves;
    leaves.origins = archive.get<Coord>(nameOf(body) + ".leaf.origin");
    leaves.values = archive.get<float>(nameOf(body) + ".leaf.phi", leaves.origins.size() * grid::BandLeaves::kVoxels);
    leaves.active =
        archive.get<std::uint64_t>(nameOf(body) + ".leaf.active", leaves.origins.size() * grid::BandLeaves::kWords);
    try {
        return grid::setBandLeaves(body.phi, leaves);
    } catch (const Error& e) {
        archive.complain("body '" + body.name + "': " + e.what());
    }
}

std::vector<Vec3> loadNodes(const std::string& name, std::size_t nodes, const Archive& archive)
{
    std::vector<Vec3> field = archive.get<Vec3>(name, nodes);
    for (const Vec3& value : field)
        if (!value.allFinite()) archive.complain("'" + name + "' has a value that is not a number");
    return field;
}

}  // namespace

namespace {

template <class Values>
void addTo(std::uint64_t& hash, const Values& values)
{
    hash = hashBytes(values.data(), values.size() * sizeof(values[0]), hash);
}

void addBodies(std::uint64_t& hash, std::span<const Body> bodies)
{
    for (const Body& body : bodies) {
        const tetmesh::NodeField<float>& phi = body.mesh->phi();
        phi.forEachBlock([&](Coord low) {
            std::array<float, tetmesh::NodeField<float>::kBlock> values;
            std::size_t i = 0;
            phi.forEachNode(low, [&](Coord voxel) { values[i++] = phi(voxel); });
            addTo(hash, values);
        });
        addTo(hash, body.fragments.ofNode());
    }
}

/// In the order of the stages: which effects an archive has something of.
constexpr const char* kEffects = "effects";

}  // namespace

std::uint64_t Simulation::stateHash() const
{
    const double trusted = stepControl_->trusted();
    std::uint64_t hash = hashBytes(&trusted, sizeof trusted, hashBytes(&time_, sizeof time_));
    addTo(hash, state_.x);
    addTo(hash, state_.v);
    addBodies(hash, bodies_);
    if (fragmentsAsleep() > 0) addTo(hash, asleep_);
    return hash;
}

std::uint64_t Simulation::bodiesHash() const
{
    std::uint64_t hash = 0;
    for (const Body& body : bodies_) addTo(hash, tetmesh::restPositions(*body.mesh));
    addBodies(hash, bodies_);
    return hash;
}

void Simulation::save(Archive& archive) const
{
    archive.put("time", std::vector<double>{time_, stepControl_->trusted()});
    archive.putOne<std::int64_t>("step", steps_);
    archive.putOne("next_fragment", nextFragment_);
    archive.put("energy", std::vector<double>{elasticEnergy_, putIn_, unnamed_, netIn_, mostIn_});
    archive.putOne<std::int64_t>("balanced", balanced_);
    if (!asleep_.empty()) archive.put("asleep", std::vector<std::uint32_t>(asleep_.begin(), asleep_.end()));
    grips_->save(archive);
    archive.put("x", state_.x);
    archive.put("v", state_.v);
    for (const Body& body : bodies_) {
        savePhi(body, archive);
        saveFragments(body, archive);
    }
    std::string effects = "\n";
    for (std::size_t i = 0; i < stages_.persistent.size(); ++i) {
        stages_.persistent[i]->save(bodies_, archive);
        effects += persistentOwners_[i]->name() + "\n";
    }
    archive.putText(kEffects, effects);
    if (ancestry_) ancestry_->save(archive);
}

/// Bodies, fragments, x and v.
void Simulation::restoreBodies(const Archive& archive)
{
    for (Body& body : bodies_) {
        (void)body.mesh->update(loadPhi(body, archive));  // equals the mesh of the run, to the bit
        body.fragments = loadFragments(body, archive);
        ++body.revision;
    }
    nextFragment_ = archive.getOne<std::uint32_t>("next_fragment");
    std::size_t nodes = 0, fragments = 0;
    for (const Body& body : bodies_) {
        const auto& list = body.fragments.fragments();
        nodes += body.mesh->nodeCount(), fragments += list.size();
        if (!list.empty() && list.back().id >= nextFragment_)
            archive.complain("a fragment of '" + body.name + "' has an id that was never assigned");
    }
    if (fragments != nextFragment_) archive.complain("some of its fragments are missing");
    state_.x = loadNodes("x", nodes, archive);
    state_.v = loadNodes("v", nodes, archive);
    if (!stages_.sleep.empty() && archive.has("asleep")) {
        const auto asleep = archive.get<std::uint32_t>("asleep", fragments);
        if (std::any_of(asleep.begin(), asleep.end(), [](std::uint32_t a) { return a > 1; }))
            archive.complain("'asleep' has a value that is neither 0 nor 1");
        asleep_.assign(asleep.begin(), asleep.end());
    }
    rebuild();
}

/// Time, and what the energy accounts and the grips know.
void Simulation::restoreProgress(const Archive& archive)
{
    const std::vector<double> time = archive.get<double>("time", 2);
    const std::int64_t step = archive.getOne<std::int64_t>("step");
    constexpr double kMaxFrames = 1e9;
    if (!(time[0] >= 0 && time[0] * timeSettings_.fps < kMaxFrames && time[1] > 0 && step >= 0 &&
          step < std::numeric_limits<int>::max()))
        archive.complain("its time, step number or time step is out of range");
    time_ = time[0], steps_ = int(step);
    stepControl_->restoreTrusted(time[1]);
    const std::vector<double> energy = archive.get<double>("energy", 5);
    for (double value : energy)
        if (!std::isfinite(value)) archive.complain("an energy is not a number");
    elasticEnergy_ = energy[0], putIn_ = energy[1], unnamed_ = energy[2], netIn_ = energy[3], mostIn_ = energy[4];
    kineticEnergy_ = kineticEnergy(state_.v);
    grips_->restoreFrom(archive);
    letGoOfGrips();
    balanced_ = archive.getOne<std::int64_t>("balanced") != 0;
}

/// What an effect notes then takes the place of what it noted before.
void Simulation::start(Effect& effect)
{
    std::vector<std::string>& notes = effectNotes_[effect.name()];
    for (const std::string& note : notes) std::erase(stages_.notes, note);
    notes.clear();
    effect.start({state_.x, time_}, bodies_, notes);
    stages_.notes.insert(stages_.notes.end(), notes.begin(), notes.end());
}

/// Calls restore for all that the archive knows; the others begin anew.
void Simulation::restoreEffects(const Archive& archive, const std::function<void(Persistent&)>& restore)
{
    const std::string known = archive.getText(kEffects);
    for (std::size_t i = 0; i < stages_.persistent.size(); ++i)
        if (known.find("\n" + persistentOwners_[i]->name() + "\n") != std::string::npos)
            restore(*stages_.persistent[i]);
        else
            start(*persistentOwners_[i]);
    if (!stages_.flow.empty()) rebuild();
}

void Simulation::restoreFrom(const Archive& archive)
{
    if (!stages_.sleep.empty() && !archive.has("asleep")) archive.complain("it has no 'asleep'");
    restoreBodies(archive);
    restoreProgress(archive);
    for (Persistent* p : stages_.persistent) p->restoreFrom(archive, bodies_);
    if (!stages_.flow.empty()) rebuild();
    if (ancestry_) ancestry_->restoreFrom(archive, bodies_);
}

/// All wake: what holds them, or may tear them, can be another.
void Simulation::branchFrom(const Archive& archive)
{
    restoreBodies(archive);
    if (fragmentsAsleep() > 0) std::ranges::fill(asleep_, 0), rebuild();
    restoreProgress(archive);
    grips_->requireNear(state_.x, time_);
    restoreEffects(archive, [&](Persistent& p) { p.branchFrom(archive, bodies_); });
    if (ancestry_) ancestry_->restoreFrom(archive, bodies_);
    const Totals now = totals();  // of other materials, maybe
    elasticEnergy_ = now.elasticEnergy;
    netIn_ = now.elasticEnergy + now.kineticEnergy;
    putIn_ = std::max(putIn_, netIn_), mostIn_ = std::max(mostIn_, netIn_);
    balanced_ = false;
}

}  // namespace vdbfrac::core
