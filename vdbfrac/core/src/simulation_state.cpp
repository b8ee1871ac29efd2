// What lives on between the steps of a simulation: its fingerprint, and how checkpoints keep it.
#include <vdbfrac/core/simulation.h>

#include "grips.h"

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
    const auto birth = archive.get<double>(name + ".birth", id.size()), volume = archive.get<double>(name + ".rest_volume", id.size());
    std::vector<std::uint32_t> ofNode = archive.get<std::uint32_t>(name + ".of_node", body.mesh->nodeCount());
    if (!std::is_sorted(id.begin(), id.end(), std::less_equal<>())) archive.complain("the fragments of '" + body.name + "' are not in order");
    for (std::uint32_t f : ofNode)
        if (!std::binary_search(id.begin(), id.end(), f)) archive.complain("a node of '" + body.name + "' is in no fragment");
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

/// Leaves that phi can have come to from the start: inside the box of the mesh, no value lower.
grid::BandLeaves loadPhi(const Body& body, const Archive& archive)
{
    grid::BandLeaves leaves;
    leaves.origins = archive.get<Coord>(nameOf(body) + ".leaf.origin");
    const std::size_t count = leaves.origins.size();
    leaves.values = archive.get<float>(nameOf(body) + ".leaf.phi", count * grid::BandLeaves::kVoxels);
    leaves.active = archive.get<std::uint64_t>(nameOf(body) + ".leaf.active", count * grid::BandLeaves::kWords);
    const auto& phi = body.mesh->phi();
    for (const Coord& c : leaves.origins)
        if (((c.x | c.y | c.z) & 7) != 0 || !phi.contains(c)) archive.complain("a leaf of '" + body.name + "' lies where there is none");
    for (std::size_t n = 0; n < count; ++n) {
        const float* value = leaves.values.data() + n * grid::BandLeaves::kVoxels;
        for (int i = 0; i < int(grid::BandLeaves::kVoxels); ++i, ++value)
            if (!(*value >= phi(leaves.origins[n] + Coord{i >> 6, i >> 3 & 7, i & 7}) && *value <= float(body.phi.background())))
                archive.complain("phi of '" + body.name + "' is lower than at the start, or beyond its band");
    }
    return leaves;
}

std::vector<Vec3> loadNodes(const std::string& name, std::size_t nodes, const Archive& archive)
{
    std::vector<Vec3> field = archive.get<Vec3>(name, nodes);
    for (const Vec3& value : field)
        if (!value.allFinite()) archive.complain("'" + name + "' has a value that is no number");
    return field;
}

}  // namespace

std::uint64_t Simulation::stateHash() const
{
    std::uint64_t hash = hashBytes(&trusted_, sizeof trusted_, hashBytes(&time_, sizeof time_));
    const auto add = [&](const auto& values) { hash = hashBytes(values.data(), values.size() * sizeof(values[0]), hash); };
    add(state_.x);
    add(state_.v);
    for (const Body& body : bodies_) {
        const tetmesh::NodeField<float>& phi = body.mesh->phi();
        phi.forEachBlock([&](Coord low) {
            std::array<float, tetmesh::NodeField<float>::kBlock> values;
            std::size_t i = 0;
            phi.forEachNode(low, [&](Coord voxel) { values[i++] = phi(voxel); });
            add(values);
        });
        add(body.fragments.ofNode());
    }
    Archive lasting;
    for (const Lasting* l : stages_.lasting) l->save(bodies_, lasting);
    const std::uint64_t own = lasting.checksum();
    return hashBytes(&own, sizeof own, hash);
}

void Simulation::save(Archive& archive) const
{
    archive.put("time", std::vector<double>{time_, trusted_});
    archive.putOne<std::int64_t>("step", steps_);
    archive.putOne("next_fragment", nextFragment_);
    archive.put("x", state_.x);
    archive.put("v", state_.v);
    for (const Body& body : bodies_) {
        savePhi(body, archive);
        saveFragments(body, archive);
    }
    for (const Lasting* l : stages_.lasting) l->save(bodies_, archive);
    archive.putOne("state_hash", stateHash());
}

void Simulation::load(const Archive& archive)
{
    for (Body& body : bodies_) {
        (void)body.mesh->update(grid::setBandLeaves(body.phi, loadPhi(body, archive)));  // equals the mesh of the run, to the bit
        body.fragments = loadFragments(body, archive);
    }
    std::size_t nodes = 0;
    for (const Body& body : bodies_) nodes += body.mesh->nodeCount();
    state_.x = loadNodes("x", nodes, archive);
    state_.v = loadNodes("v", nodes, archive);
    rebuild();
    const std::vector<double> time = archive.get<double>("time", 2);
    const std::int64_t step = archive.getOne<std::int64_t>("step");
    if (!(time[0] >= 0 && std::isfinite(time[0]) && time[1] > 0 && step >= 0 && step < std::numeric_limits<int>::max()))
        archive.complain("its time, step or time step cannot be");
    time_ = time[0], trusted_ = time[1], steps_ = int(step);
    nextFragment_ = archive.getOne<std::uint32_t>("next_fragment");
    for (Lasting* l : stages_.lasting) l->load(bodies_, archive);
    if (stateHash() != archive.getOne<std::uint64_t>("state_hash")) archive.complain("the state it leads to is not the one that was saved");
}

}  // namespace vdbfrac::core
