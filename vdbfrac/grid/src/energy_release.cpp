#include <vdbfrac/grid/energy_release.h>

#include "node_values.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/nodes_around.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace vdbfrac::grid {

namespace {

using tetmesh::BodyMesh;
using tetmesh::CornerForces;

/// What is found of G: the cells next to a tip hold less energy than the material would. Of strips of 10 and 20 cells;
/// on tets of any shape cracks leave bridges behind them besides, which take some of it.
constexpr double kFoundOnLattice = .95, kFoundOnTets = .82;
/// |J| over the sum of the lengths of what J is the sum of, round a tip alone: .63 to .75.
constexpr double kOneTip = 1 / 1.6;

/// q at r [radii].
double weightAt(double r)
{
    constexpr double kFlat = .4;
    if (r >= 1) return 0;
    const double s = std::max(0., (r - kFlat) / (1 - kFlat)), inside = 1 - s * s;
    return inside * inside;
}

/// A voxel node within the ball.
struct Near {
    Coord offset;
    double q;
};

std::vector<Near> ballOf(double radius)
{
    const int reach = reachWithin(radius);
    std::vector<Near> ball;
    for (int z = -reach; z <= reach; ++z)
        for (int y = -reach; y <= reach; ++y)
            for (int x = -reach; x <= reach; ++x)
                if (const double q = weightAt(Vec3(x, y, z).norm() / radius); q > 0) ball.push_back({{x, y, z}, q});
    return ball;
}

/// phi between voxels, at X [voxels], in voxels.
double phiAt(const BodyMesh& mesh, const Vec3& X) { return tetmesh::trilinear(mesh.phi(), X) / mesh.voxelSize(); }

Vec3 normalAt(const BodyMesh& mesh, const Vec3& X)
{
    Vec3 n;
    for (int d = 0; d < 3; ++d) n[d] = phiAt(mesh, X + .5 * Vec3::Unit(d)) - phiAt(mesh, X - .5 * Vec3::Unit(d));
    return n.normalized();
}

/// Forces of the nodes round some tips, on voxel nodes; on meshes whose nodes are none shared out to those round them.
NodeValues<CornerForces> forcesRound(const BodyMesh& mesh, const ElementForcesOf& forces, std::span<const Coord> tips,
                                     int reach)
{
    constexpr std::size_t kTogether = 2048;
    constexpr std::size_t kPlanes = 4;  // a power of two
    const double dx = mesh.voxelSize();
    const int edge = int(std::ceil(mesh.spacing() / dx - 1e-9));
    const std::span<const Coord> lattice = mesh.latticeCoords();
    // A tet with material and a node within reach has material round a voxel node no farther than this from that.
    const int beyond = lattice.empty() ? edge : edge - 1;
    const std::vector<std::uint32_t> elements = elementsRound(mesh, tetmesh::nodesAround(tips, reach + beyond));
    NodeValues<CornerForces> field(mesh.phi().lower(), mesh.phi().upper());
    std::vector<Coord> nodes = tetmesh::nodesAround(tips, reach);
    keepIf(nodes, [&](const Coord& c) { return field.contains(c); });
    field.add(nodes);
    std::vector<tetmesh::ElementForces> of(std::min(kTogether, elements.size()));
    for (std::size_t first = 0; first < elements.size(); first += kTogether) {
        const std::size_t count = std::min(kTogether, elements.size() - first);
        parallelChunks(count, 32, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) of[i] = forces(elements[first + i]);
        });
        // Each some planes of voxels: a node gets its forces in the order of the elements.
        parallelChunks(kPlanes, 1, [&](std::size_t plane, std::size_t) {
            const auto add = [&](const Coord& c, double part, const CornerForces& corner) {
                if ((std::size_t(c.z) & (kPlanes - 1)) != plane) return;
                if (CornerForces* node = field.find(c)) node->add(part, corner);
            };
            const auto addAt = [&](std::uint32_t node, const CornerForces& corner) {
                if (!lattice.empty()) return add(edge * lattice[node], 1, corner);
                const Vec3 X = mesh.restPosition(node) / dx;
                const Coord base = tetmesh::floorOf(X);
                for (int c = 0; c < tetmesh::kCorners; ++c)
                    add(base + tetmesh::cornerOffset(c), tetmesh::trilinearShare(c, X - base.toVec()), corner);
            };
            for (std::size_t i = 0; i < count; ++i)
                for (std::size_t a = 0; a < tetmesh::kCorners; ++a)
                    if (of[i][a].volume > 0) addAt(mesh.elements()[elements[first + i]].node[a], of[i][a]);
        });
    }
    return field;
}

/// A line of material through a point.
struct Line {
    double length = 0;                        // integral of q along it [radii]
    std::array<std::optional<Vec3>, 2> ends;  // voxels; within the radius
};

Line lineThrough(const BodyMesh& mesh, const Vec3& X, const Vec3& way, double radius)
{
    constexpr double kStep = .25;  // voxels
    Line line;
    const double middle = phiAt(mesh, X);
    if (middle >= 0) return line;
    for (std::size_t side : {0, 1}) {
        const Vec3 along = side == 0 ? way : Vec3(-way);
        double before = middle;
        for (double s = 0; s < radius; s += kStep) {
            const double after = phiAt(mesh, X + (s + kStep) * along);
            const double part = after < 0 ? 1 : before / (before - after);
            line.length += part * weightAt((s + kStep / 2) / radius) * kStep / radius;
            if (after >= 0) {
                line.ends[side] = X + (s + part * kStep) * along;
                break;
            }
            before = after;
        }
    }
    return line;
}

/// The front through X [voxels], `n` across its crack.
struct Front {
    Vec3 J;             // without what moves the faces in which it ends
    Vec3 along;         // unit; 0 where there is none
    double length = 0;  // integral of q along it [radii]
};

Front frontThrough(const BodyMesh& mesh, const Vec3& X, const Vec3& n, Vec3 J, double radius)
{
    constexpr double kEnds = .7;  // cosine, between the front and the normal of a face in which it ends
    Vec3 way = J.cross(n).normalized();
    Vec3 ahead = X + 2 * J.normalized();  // clear of the crack
    if (phiAt(mesh, ahead) > -.5) ahead = X;
    for (const auto& end : lineThrough(mesh, ahead, way, radius).ends)
        if (const Vec3 face = end ? normalAt(mesh, *end) : Vec3(Vec3::Zero()); std::abs(face.dot(way)) > kEnds)
            J -= J.dot(face) * face;
    Front front{J, J.cross(n).normalized(), 0};
    // A voxel ahead too: just behind a rough front the line may leave the material.
    for (const Vec3& middle : {X, Vec3(X + J.normalized())})
        front.length = std::max(front.length, lineThrough(mesh, middle, front.along, radius).length);
    return front;
}

Release releaseAt(const BodyMesh& mesh, const NodeValues<CornerForces>& forces, const std::vector<Near>& ball,
                  Coord tip, double radius, const VoxelFilter& isCounted)
{
    constexpr double kShortest = .5;  // radii; what is shorter is a splinter
    Vec3 elastic = Vec3::Zero(), material = Vec3::Zero();
    Mat3 A = Mat3::Zero();
    double volume = 0;
    std::vector<const CornerForces*> of(ball.size());
    for (std::size_t i = 0; i < ball.size(); ++i) {
        const Coord c = tip + ball[i].offset;
        const CornerForces* node = forces.find(c);
        if (!node || node->volume == 0) continue;
        A += ball[i].q * node->F, volume += ball[i].q * node->volume;
        if (isCounted && !isCounted(c)) continue;
        of[i] = node;
        elastic += ball[i].q * node->elastic, material += ball[i].q * node->material;
    }
    if (volume == 0) return {};
    A /= volume;
    const Vec3 J = -(material + A.transpose() * elastic);
    if (!(J.norm() > 0)) return {};
    const Vec3 n = Eigen::SelfAdjointEigenSolver<Mat3>(A.transpose() * A).eigenvectors().col(2);
    const Front front = frontThrough(mesh, Vec3(tip.x, tip.y, tip.z), n, J, radius);
    double either = 0;
    for (std::size_t i = 0; i < ball.size(); ++i)
        if (of[i]) {
            const Vec3 f = of[i]->material + A.transpose() * of[i]->elastic;
            either += ball[i].q * (f - f.dot(front.along) * front.along).norm();
        }
    const double length = std::max(kShortest, front.length) * radius * mesh.voxelSize();
    const double found = mesh.latticeCoords().empty() ? kFoundOnTets : kFoundOnLattice;
    return {std::max(front.J.norm(), kOneTip * either) / (found * length), front.along};
}

}  // namespace

std::vector<Release> energyRelease(const BodyMesh& mesh, const ElementForcesOf& forces, std::span<const Coord> tips,
                                   double radius, const VoxelFilter& isCounted)
{
    const double voxels = radius / mesh.voxelSize();
    const NodeValues<CornerForces> field = forcesRound(mesh, forces, tips, reachWithin(voxels));
    std::vector<Release> releases(tips.size());
    parallelChunks(tips.size(), 4, [&, ball = ballOf(voxels)](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            releases[i] = releaseAt(mesh, field, ball, tips[i], voxels, isCounted);
    });
    return releases;
}

}  // namespace vdbfrac::grid
