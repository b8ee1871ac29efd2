#include <vdbfrac/core/ancestry.h>

#include <algorithm>
#include <string>
#include <utility>

namespace vdbfrac::core {

namespace {

/// The tets that an update left without material. X [m, at rest]: of the nodes before it.
std::vector<TakenTet> takenTets(const tetmesh::BodyMesh& mesh, const tetmesh::PreviousElements& previous,
                                std::span<const Vec3> X)
{
    std::vector<std::pair<std::uint32_t, std::uint32_t>> left;  // old element and number in it
    for (const auto& recut : previous.recut)
        for (std::uint32_t t = 0; t < recut.old.size(); ++t)
            if (mesh.elements()[recut.element].fraction[t] > 0) left.emplace_back(recut.old[t], t);
    std::ranges::sort(left);
    std::vector<TakenTet> taken;
    for (const auto& replaced : previous.replaced)
        for (std::uint32_t t = 0; t < replaced.element.fraction.size(); ++t) {
            if (!(replaced.element.fraction[t] > 0)) continue;
            if (std::ranges::binary_search(left, std::pair(replaced.old, t))) continue;
            TakenTet& tet = taken.emplace_back(TakenTet{tetmesh::tetNodes(replaced.element, t), {}});
            for (std::size_t a = 0; a < 4; ++a) tet.X[a] = X[tet.node[a]];
        }
    return taken;
}

}  // namespace

Ancestry::Ancestry(std::span<const Body> bodies) : bodies_(bodies.size())
{
    for (const Body& body : bodies) X_.push_back(tetmesh::restPositions(*body.mesh));
}

void Ancestry::recut(std::size_t body, const tetmesh::BodyMesh& mesh, const tetmesh::CutUpdate& update, int frame)
{
    Stretch& stretch = bodies_[body];
    std::vector<std::uint32_t> node = update.previousNode;
    std::vector<TakenTet> taken = takenTets(mesh, update.previousElement, X_[body]);
    if (stretch.frame == frame) {
        for (std::uint32_t& n : node) n = stretch.node[n];
        for (TakenTet& tet : taken)
            for (std::uint32_t& n : tet.node) n = stretch.node[n];
        taken.insert(taken.begin(), stretch.taken.begin(), stretch.taken.end());
    }
    stretch = {frame, std::move(node), std::move(taken)};
    X_[body] = tetmesh::restPositions(mesh);
}

std::span<const std::uint32_t> Ancestry::before(std::size_t body, int frame) const
{
    if (bodies_[body].frame != frame) return {};
    return bodies_[body].node;
}

std::span<const TakenTet> Ancestry::taken(std::size_t body, int frame) const
{
    if (bodies_[body].frame != frame) return {};
    return bodies_[body].taken;
}

void Ancestry::save(Archive& archive) const
{
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        archive.putOne("ancestry_frame_" + std::to_string(b), bodies_[b].frame);
        archive.put("ancestry_node_" + std::to_string(b), bodies_[b].node);
        putTets(archive, "ancestry_taken_" + std::to_string(b), bodies_[b].taken);
    }
}

void Ancestry::restoreFrom(const Archive& archive, std::span<const Body> bodies)
{
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        bodies_[b].frame = archive.getOne<std::int32_t>("ancestry_frame_" + std::to_string(b));
        bodies_[b].node = archive.get<std::uint32_t>("ancestry_node_" + std::to_string(b));
        bodies_[b].taken = getTets(archive, "ancestry_taken_" + std::to_string(b));
        const bool wasCut = bodies_[b].frame > 0;
        if (bodies_[b].frame < 0 || bodies_[b].node.size() != (wasCut ? bodies[b].mesh->nodeCount() : 0))
            archive.complain("what nodes were before a cut is not of all nodes");
        X_[b] = tetmesh::restPositions(*bodies[b].mesh);
    }
}

void putTets(Archive& archive, const std::string& key, std::span<const TakenTet> tets)
{
    std::vector<std::uint32_t> node;
    std::vector<Vec3> X;
    for (const TakenTet& tet : tets) {
        node.insert(node.end(), tet.node.begin(), tet.node.end());
        X.insert(X.end(), tet.X.begin(), tet.X.end());
    }
    archive.put(key + "_node", node);
    archive.put(key + "_X", X);
}

std::vector<TakenTet> getTets(const Archive& archive, const std::string& key)
{
    if (!archive.has(key + "_node")) return {};
    const auto node = archive.get<std::uint32_t>(key + "_node");
    const auto X = archive.get<Vec3>(key + "_X", node.size());
    if (node.size() % 4 != 0) archive.complain("'" + key + "_node' is not of tets");
    std::vector<TakenTet> tets(node.size() / 4);
    for (std::size_t i = 0; i < node.size(); ++i) tets[i / 4].node[i % 4] = node[i], tets[i / 4].X[i % 4] = X[i];
    return tets;
}

}  // namespace vdbfrac::core
