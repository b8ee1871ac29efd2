#include "rest_notes.h"

#include <vdbfrac/base/number_text.h>
#include <vdbfrac/scene/placement.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace vdbfrac::core {

namespace {

/// Notes are no measurements.
std::string rough(double v) { return shortNumber(v, 3); }

constexpr double kAslant = .2;  // a cosine: a smaller one is that of an edge, or rounding

/// Material on one side of a voxel node along an axis, up to `most` [voxels].
double reachAlong(const tetmesh::NodeField<float>& phi, Coord c, Coord step, double most)
{
    double reach = 0;
    for (; phi(c + step) < 0; c = c + step)
        if (++reach >= most) return most;
    return reach + phi(c) / (double(phi(c)) - double(phi(c + step)));
}

/// How thick the material is round a voxel node, up to `most` [voxels]: the least of its lengths along the axes, each
/// times the cosine to the way out, as axes run aslant through shells and turned plates.
double thicknessAt(const tetmesh::NodeField<float>& phi, double dx, Coord c, double most)
{
    double thinnest = most;
    for (const Coord axis : {Coord{1, 0, 0}, Coord{0, 1, 0}, Coord{0, 0, 1}}) {
        const double rise = double(std::max(phi(c + axis), phi(c + -1 * axis)) - phi(c)) / dx;
        const double length = reachAlong(phi, c, axis, most) + reachAlong(phi, c, -1 * axis, most);
        thinnest = std::min(thinnest, rise < kAslant ? length : std::min(rise, 1.) * length);
    }
    return thinnest;
}

/// Is no node beside it deeper? Nearer to the surface, what runs aslant through a shell misses its other side.
bool isDeepest(const tetmesh::NodeField<float>& phi, Coord c)
{
    for (const Coord axis : {Coord{1, 0, 0}, Coord{0, 1, 0}, Coord{0, 0, 1}})
        if (phi(c + axis) < phi(c) || phi(c + -1 * axis) < phi(c)) return false;
    return true;
}

void noteThinness(const Body& body, double h, std::vector<std::string>& notes)
{
    constexpr double kThin = 4, kRounding = .05;  // cells: thinner plates bend far too stiffly or too softly; of them
    const double cell = h / body.mesh->voxelSize(), enough = (kThin - kRounding) * cell;  // voxels
    const tetmesh::NodeField<float>& phi = body.mesh->restPhi();
    double thickest = 0;
    phi.forEachBlock([&](Coord low) {
        tetmesh::NodeField<float>::forEachNode(low, [&](Coord c) {
            if (thickest < enough && phi(c) < 0 && isDeepest(phi, c))
                thickest = std::max(thickest, thicknessAt(phi, body.mesh->voxelSize(), c, 2 * enough));
        });
    });
    thickest /= cell;
    if (thickest < kThin - kRounding)
        notes.push_back("body '" + body.name + "' is thin: nowhere more than about " + rough(thickest) +
                        " lattice cells thick; bending needs 4");
}

void noteParts(const Body& body, std::vector<std::string>& notes)
{
    const auto& parts = body.fragments.fragments();
    if (parts.size() < 2) return;
    double largest = 0;
    for (const tetmesh::Fragment& part : parts) largest = std::max(largest, part.restVolume);
    notes.push_back("body '" + body.name + "' is in " + std::to_string(parts.size()) +
                    " parts at rest; all but the largest have " + rough(100 * (1 - largest / body.startVolume)) +
                    " % of its volume together; crumbs come from thin parts, or faces on planes of voxels");
}

/// Volume [m^3] that two bodies have in common, by voxels.
double overlap(const Body& a, const Body& b)
{
    const double dx = a.mesh->voxelSize();
    double voxels = 0;
    a.mesh->phi().forEachBlock([&](Coord low) {
        if (!b.mesh->phi().contains(low)) return;
        tetmesh::NodeField<float>::forEachNode(
            low, [&](Coord c) { voxels += a.mesh->phi()(c) < 0 && b.mesh->phi()(c) < 0; });
    });
    return voxels * dx * dx * dx;
}

void noteOverlaps(std::span<const Body> bodies, std::vector<std::string>& notes)
{
    for (std::size_t i = 0; i < bodies.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            if (const double common = overlap(bodies[j], bodies[i]); common > 0)
                notes.push_back("bodies '" + bodies[j].name + "' and '" + bodies[i].name + "' overlap at rest by " +
                                rough(common) +
                                " m^3: with [contact] they stay as deep as they are, or come apart with its "
                                "untangle_speed; without it each moves as if the other were not there");
}

/// Fastest [m/s] that keys move a grip from one to the next, turns apart.
struct SpeedOf {
    double operator()(const scene::Velocity& move) const { return move.velocity.norm(); }
    double operator()(const scene::Keys& move) const
    {
        double fastest = 0;
        for (std::size_t k = 1; k < move.keys.size(); ++k)
            fastest = std::max(fastest, (move.keys[k].translate - move.keys[k - 1].translate).norm() /
                                            (move.keys[k].time - move.keys[k - 1].time));
        return fastest;
    }
    double operator()(const scene::Force&) const { return 0; }
};

void noteSpeed(const scene::Grip& grip, std::span<const Body> bodies, std::vector<std::string>& notes)
{
    const auto body = std::find_if(bodies.begin(), bodies.end(), [&](const Body& b) { return b.name == grip.body; });
    if (body == bodies.end()) return;
    const solver::Material& m = body->material;
    const double sound = std::sqrt((m.lambda + 2 * m.mu) / m.rho), speed = std::visit(SpeedOf{}, grip.move);
    if (speed > sound)
        notes.push_back("grip '" + grip.name + "' moves at " + rough(speed) + " m/s, faster than sound in body '" +
                        body->name + "' (" + rough(sound) +
                        " m/s): it crushes or tears off what is next to it, in very many short steps; check its units");
}

bool isForce(const scene::Grip& grip) { return std::holds_alternative<scene::Force>(grip.move); }

/// What becomes of nodes that two grips have.
std::string inBoth(const scene::Grip& earlier, const scene::Grip& later, std::size_t nodes)
{
    const std::string text =
        "grips '" + earlier.name + "' and '" + later.name + "' both have " + counted(nodes, "node");
    if (isForce(earlier) && isForce(later)) return text + ": their forces add up there";
    if (!isForce(earlier) && !isForce(later)) return text + ": these go with '" + later.name + "', the later one";
    const auto &holds = isForce(earlier) ? later : earlier, &pulls = isForce(earlier) ? earlier : later;
    return text + ": '" + holds.name + "' holds them, and bears what of its force '" + pulls.name + "' has there";
}

/// Static steps leave a body where it is unless a grip moves or holds it.
void noteUnheld(const scene::Scene& scene, std::vector<std::string>& notes)
{
    for (const scene::Body& body : scene.bodies) {
        const auto holds = [&](const scene::Grip& grip) { return grip.body == body.name && !isForce(grip); };
        if (std::ranges::none_of(scene.grips, holds))
            notes.push_back("body '" + body.name +
                            "' is held by no grip that says where it goes: static steps leave it where it is, whatever "
                            "pulls at it");
        if (!body.velocity.isZero() || !body.angularVelocity.isZero())
            notes.push_back("body '" + body.name + "' has a velocity: static steps know none");
    }
}

/// What is held is taken to the pose of the start within the first step, whatever that tears.
void noteStart(const scene::Grip& grip, const Body& body, std::span<const std::uint32_t> nodes,
               std::vector<std::string>& notes)
{
    constexpr double kFar = .5;  // cells
    const auto* keys = std::get_if<scene::Keys>(&grip.move);
    if (!keys) return;
    const scene::Placement start = scene::placementAt(*keys, 0);
    double farthest = 0;
    for (const std::uint32_t node : nodes) {
        const Vec3 X = body.mesh->restPosition(node - body.firstNode);
        farthest = std::max(farthest, (start(X) - X).norm());
    }
    if (farthest > kFar * body.mesh->spacing())
        notes.push_back("grip '" + grip.name + "' moves what it holds by " + rough(farthest) +
                        " m in the first step, to the pose of its first key; a key without a pose at time 0 lets it "
                        "set off from rest");
}

}  // namespace

void noteRestState(const scene::Scene& scene, std::span<const Body> bodies, double h, std::vector<std::string>& notes)
{
    for (const Body& body : bodies) {
        noteThinness(body, h, notes);
        noteParts(body, notes);
    }
    noteOverlaps(bodies, notes);
    if (scene.solver.integrator == scene::Integrator::statics) return noteUnheld(scene, notes);
    for (const scene::Grip& grip : scene.grips) noteSpeed(grip, bodies, notes);
}

void noteGrips(const scene::Scene& scene, std::span<const Body> bodies, const GripNodes& nodesOf,
               std::vector<std::string>& notes)
{
    const std::span<const scene::Grip> grips = scene.grips;
    for (std::size_t g = 0; g < grips.size(); ++g) {
        const std::span<const std::uint32_t> nodes = nodesOf(g);
        for (const Body& body : bodies) {
            if (body.name != grips[g].body) continue;
            if (nodes.size() == body.mesh->nodeCount())
                notes.push_back("grip '" + grips[g].name + "' holds all of body '" + body.name + "'");
            if (scene.solver.integrator != scene::Integrator::statics) noteStart(grips[g], body, nodes, notes);
        }
        for (std::size_t other = 0; other < g; ++other) {
            std::vector<std::uint32_t> both;
            std::ranges::set_intersection(nodes, nodesOf(other), std::back_inserter(both));
            if (!both.empty()) notes.push_back(inBoth(grips[other], grips[g], both.size()));
        }
    }
}

}  // namespace vdbfrac::core
