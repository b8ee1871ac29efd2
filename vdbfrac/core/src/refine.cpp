// The state of a simulation on a lattice twice as fine.
//
// Voxel n of the wide lattice is voxel 2 n of the fine one, and Kuhn's tets divide into Kuhn's tets: what is linear in
// the wide tets is so in the fine ones. Fine nodes ride in the wide tets on their side of the cracks, and phi is that
// of the fine shape at rest, cut by the cracks of the wide lattice alone, without its coarser skin.
#include <vdbfrac/core/simulation.h>

#include "grips.h"
#include "step_control.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/skin/riders.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace vdbfrac::core {

namespace {

/// The wide nodes that a fine one lies midway between: one and the same, or the ends of an edge of Kuhn's tets.
struct Ends {
    Coord low, high;
    explicit Ends(Coord fine)
        : low{fine.x >> 1, fine.y >> 1, fine.z >> 1}, high{(fine.x + 1) >> 1, (fine.y + 1) >> 1, (fine.z + 1) >> 1}
    {
    }
};

/// The cracks of a body. What is smoothed for pictures heals nothing here.
skin::CrackField cracksOf(const Body& body, const skin::FragmentAt& fragment)
{
    const tetmesh::NodeField<float>&rest = body.mesh->restPhi(), &now = body.mesh->phi();
    const double dx = body.phi.voxelSize();
    skin::CrackField cracks = skin::crackField(rest, now, dx, fragment);
    now.forEachBlock([&](Coord block) {
        now.forEachNode(block, [&](Coord n) {
            if (rest(n) < 0 && now(n) > rest(n) + skin::kRaised * dx && now(n) > cracks.c(n)) cracks.c.set(n, now(n));
        });
    });
    return cracks;
}

/// phi of the fine body where the cracks raise it.
grid::PhiChanges crackedPhi(const Body& fine, const Body& wide, const skin::CrackField& cracks)
{
    const double band = fine.phi.background();
    const tetmesh::NodeField<float>&rest = fine.mesh->phi(), &now = wide.mesh->phi(), &before = wide.mesh->restPhi();
    // Between a torn node and the skin nothing is left, whatever c is outside.
    const auto isGone = [&](Coord a, Coord b) { return before(a) < 0 && now(a) >= 0 && before(b) >= 0; };
    grid::PhiChanges raised;
    rest.forEachBlock([&](Coord block) {
        rest.forEachNode(block, [&](Coord n) {
            const Ends ends(n);
            float c = float(0.5 * (double(cracks.c(ends.low)) + double(cracks.c(ends.high))));
            if (isGone(ends.low, ends.high)) c = std::max(c, now(ends.low));
            if (isGone(ends.high, ends.low)) c = std::max(c, now(ends.high));
            if (c > rest(n) && c > -band) raised.emplace_back(n, c);
        });
    });
    return raised;
}

/// Nodes of slivers, which hold no voxel node, have the anchors of nodes that their elements lead to: a notch beside
/// them is no crack, and from it the nearest material may be that of the other side.
void spreadAnchors(const tetmesh::BodyMesh& mesh, std::vector<std::uint8_t>& isKnown, std::vector<Coord>& anchors)
{
    const auto spread = [&](const tetmesh::CellElement& element) {
        const auto known = std::ranges::find_if(element.node, [&](std::uint32_t n) { return isKnown[n] != 0; });
        if (known == element.node.end()) return false;
        bool any = false;
        for (const std::uint32_t n : element.node)
            if (!isKnown[n]) anchors[n] = anchors[*known], isKnown[n] = 1, any = true;
        return any;
    };
    for (bool more = true; more;) {
        more = false;
        for (const tetmesh::CellElement& element : mesh.elements()) more |= spread(element);
    }
}

/// For each fine node: a wide voxel node on the side of the cracks that it belongs to.
std::vector<Coord> anchorsOf(const Body& fine, const skin::CrackField& cracks)
{
    const tetmesh::BodyMesh& mesh = *fine.mesh;
    const auto anchorOf = [&](Coord n) {
        const Ends ends(n);
        return cracks.c(ends.high) < cracks.c(ends.low) ? ends.high : ends.low;
    };
    std::vector<Coord> anchors(mesh.nodeCount());
    std::vector<std::uint8_t> isKnown(anchors.size(), 0);
    mesh.phi().forEachBlock([&](Coord block) {
        tetmesh::NodeField<float>::forEachNode(block, [&](Coord n) {
            if (!(mesh.phi()(n) < 0)) return;
            mesh.visitTets(n, [&](std::uint32_t e, int t, double) {
                const tetmesh::CellElement& element = mesh.elements()[e];
                for (const int corner : tetmesh::cellTets(element.shape).corner[std::size_t(t)])
                    if (const std::uint32_t node = element.node[std::size_t(corner)]; !isKnown[node])
                        anchors[node] = anchorOf(n), isKnown[node] = 1;
            });
        });
    });
    spreadAnchors(mesh, isKnown, anchors);
    for (std::size_t i = 0; i < anchors.size(); ++i)  // of what is apart, and holds no voxel node
        if (!isKnown[i]) {
            const Vec3 at = mesh.restPosition(i) / mesh.voxelSize();
            anchors[i] = anchorOf({int(std::lround(at.x())), int(std::lround(at.y())), int(std::lround(at.z()))});
        }
    return anchors;
}

std::vector<Vec3> carried(std::span<const tetmesh::EmbeddedPoint> points, std::span<const Vec3> field)
{
    std::vector<Vec3> all;
    all.reserve(points.size());
    for (const tetmesh::EmbeddedPoint& p : points) all.push_back(p.at(field));
    return all;
}

/// The node that has most of each point.
std::vector<std::uint32_t> mainNodes(std::span<const tetmesh::EmbeddedPoint> points)
{
    std::vector<std::uint32_t> nodes;
    nodes.reserve(points.size());
    for (const tetmesh::EmbeddedPoint& p : points)
        nodes.push_back(p.node[std::size_t(std::max_element(p.weight.begin(), p.weight.end()) - p.weight.begin())]);
    return nodes;
}

}  // namespace

Simulation::Totals Simulation::totals() const
{
    std::vector<Vec3> gradient(state_.x.size(), Vec3::Zero());
    return {volume(), elastic_->evaluate(state_.x, gradient, nullptr), kineticEnergy(state_.v)};
}

void Simulation::refineFrom(const Simulation& wide, const Archive& archive)
{
    if (std::ranges::any_of(bodies_, [](const Body& body) { return body.mesh->latticeCoords().empty(); }))
        throw InputError(
            {"grid.voxel_size", "a Delaunay mesh is not made finer in a branch", "lattice six or five", ""});
    std::vector<Vec3> x, v;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        Body& body = bodies_[b];
        const Body& old = wide.bodies_[b];
        const skin::FragmentAt fragment = skin::fragmentsAt(*old.mesh, old.fragments.ofNode());
        const skin::CrackField cracks = cracksOf(old, fragment);
        grid::RelevelWork work;
        (void)body.mesh->update(
            grid::raiseAndRelevel(body.phi, crackedPhi(body, old, cracks), work, {.firstOrder = false, .sweeps = 0}));
        ++body.revision;
        const std::vector<Coord> anchors = anchorsOf(body, cracks);
        std::vector<skin::Rider> riders;
        for (std::size_t i = 0; i < anchors.size(); ++i) riders.push_back({body.mesh->restPosition(i), anchors[i]});
        const std::vector<tetmesh::EmbeddedPoint> points =
            skin::embedRiders(*old.mesh, cracks, riders, fragment, old.fragments.ofNode()).points;
        const auto append = [&](std::vector<Vec3>& all, std::span<const Vec3> field) {
            const std::vector<Vec3> own = carried(points, field.subspan(old.firstNode, old.mesh->nodeCount()));
            all.insert(all.end(), own.begin(), own.end());
        };
        append(x, wide.state_.x), append(v, wide.state_.v);
        if (b == 0) nextFragment_ = wide.nextFragment_;
        body.fragments = old.fragments;
        body.fragments.update(*body.mesh, mainNodes(points), wide.time_, nextFragment_);
    }
    state_.x = std::move(x), state_.v = std::move(v);
    asleep_ = wide.asleep_;
    if (!asleep_.empty()) asleep_.resize(nextFragment_);
    time_ = wide.time_, steps_ = wide.steps_;
    stepControl_->restoreTrusted(wide.stepControl_->trusted());
    rebuild();
    grips_->restoreFrom(archive);
    letGoOfGrips();
    const Refinement from{archive, wide.bodies_};
    restoreEffects(archive, [&](Persistent& p) { p.refineFrom(from, bodies_); });
    const Totals now = totals();
    elasticEnergy_ = now.elasticEnergy, kineticEnergy_ = now.kineticEnergy;
    netIn_ = elasticEnergy_ + kineticEnergy_, unnamed_ = wide.unnamed_;
    putIn_ = std::max(wide.putIn_, netIn_), mostIn_ = std::max(wide.mostIn_, netIn_);
    balanced_ = false;
}

}  // namespace vdbfrac::core
