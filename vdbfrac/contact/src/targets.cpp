#include <vdbfrac/contact/targets.h>

#include <vdbfrac/base/parallel.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace vdbfrac::contact {

namespace {

// Of the volume at rest. A tet is looked into from kFlat on; what is seen in it then stays so through a solve, down to
// kNone: Newton's method cannot pass a jump of the energy.
constexpr double kFlat = 0.05, kNone = 1e-3;

/// The gradient of what has the values phi at the corners of a tet, times the determinant of its edges, whose cross
/// products are n: of the second and third, of the third and first, of the first and second.
Vec3 gradientTimesVolume(const std::array<float, 4>& phi, const std::array<Vec3, 3>& n)
{
    return double(phi[1] - phi[0]) * n[0] + double(phi[2] - phi[0]) * n[1] + double(phi[3] - phi[0]) * n[2];
}

/// Of a tet in space, seen from its first corner.
struct Edges {
    std::array<Vec3, 3> normal;  // m^2: cross products of the edges to the others
    double volume;               // m^3, times six

    Edges(const std::array<std::uint32_t, 4>& node, std::span<const Vec3> x)
    {
        const Vec3& z = x[node[0]];
        const Vec3 e1 = x[node[1]] - z, e2 = x[node[2]] - z, e3 = x[node[3]] - z;
        normal = {e2.cross(e3), e3.cross(e1), e1.cross(e2)};
        volume = e1.dot(normal[0]);
    }
    /// Barycentric coordinates of the first corner plus d.
    std::array<double, 4> sharesOf(const Vec3& d) const
    {
        const double b = d.dot(normal[0]) / volume, c = d.dot(normal[1]) / volume, e = d.dot(normal[2]) / volume;
        return {1 - b - c - e, b, c, e};
    }
};

/// Finishes a target, in nodes of its body until now, and adds it to its group.
void gather(Target& target, const core::Body& body, Targets::Group& group)
{
    std::array<Vec3, 4> X;
    for (std::size_t a = 0; a < 4; ++a) X[a] = body.mesh->restPosition(target.node[a]);
    const Vec3 e1 = X[1] - X[0], e2 = X[2] - X[0], e3 = X[3] - X[0];
    const std::array<Vec3, 3> n{e2.cross(e3), e3.cross(e1), e1.cross(e2)};
    target.restVolume = float(std::abs(n[2].dot(e3)));
    for (std::uint32_t& node : target.node) {
        node += body.firstNode;
        const auto end = group.node.begin() + group.nodes;
        if (std::find(group.node.begin(), end, node) == end) group.node[group.nodes++] = node;
    }
    group.X += (0.25 * (X[0] + X[1] + X[2] + X[3])).cast<float>();
    group.outward += gradientTimesVolume(target.phi, n).stableNormalized().cast<float>();
}

}  // namespace

void Targets::set(std::span<const core::Body> bodies, double depth)
{
    target_.clear(), inside_.clear(), group_.clear();
    for (std::size_t b = 0; b < bodies.size(); ++b) add(bodies[b], std::uint16_t(b), depth);
    spacing_ = 0;
    for (const Group& group : group_) spacing_ += double(group.size) / double(group_.size());
}

void Targets::add(const core::Body& body, std::uint16_t number, double depth)
{
    const tetmesh::PhiTets tets = body.mesh->phiTets(depth);
    const std::size_t first = target_.size(), firstGroup = group_.size();
    target_.resize(first + tets.tets.size());
    for (std::size_t i = 0; i < tets.tets.size(); ++i) {
        if (i == 0 || tets.tets[i].element != tets.tets[i - 1].element) {
            group_.emplace_back();
            group_.back().first = std::uint32_t(first + i);
            group_.back().fragment = body.fragments.ofNode()[tets.tets[i].node[0]];
        }
        group_.back().end = std::uint32_t(first + i + 1);
    }
    parallelChunks(group_.size() - firstGroup, kChunk, [&](std::size_t begin, std::size_t end) {
        for (Group& group : std::span(group_).subspan(firstGroup + begin, end - begin)) {
            for (std::uint32_t t = group.first; t < group.end; ++t) {
                const tetmesh::PhiTet& tet = tets.tets[t - first];
                target_[t] = {tet.node, tet.phi, 0, tet.part + std::uint32_t(inside_.size()), group.fragment, number};
                gather(target_[t], body, group);
            }
            group.X /= float(group.end - group.first);
            group.outward.stableNormalize();
            group.size = std::max(std::cbrt(target_[group.first].restVolume), float(body.mesh->spacing()));
        }
    });
    inside_.insert(inside_.end(), tets.inside.begin(), tets.inside.end());
}

double Targets::leastShare(std::size_t n, const Vec3& y, double reach, std::span<const Vec3> x) const
{
    const Target& t = target_[n];
    const Edges edges(t.node, x);
    if (!(edges.volume > kFlat * double(t.restVolume))) return -std::numeric_limits<double>::infinity();
    const std::array<double, 4> share = edges.sharesOf(y - x[t.node[0]]);
    // Corners of the part have shares from 0 to 1, so y has none below -3 reach; the fourth is for rounding.
    if (std::min({share[0], share[1], share[2], share[3]}) < -4 * reach)
        return -std::numeric_limits<double>::infinity();
    double least = 1;
    for (const auto& row : inside_[t.inside]) {
        double inPart = 0;
        for (std::size_t a = 0; a < 4; ++a) inPart += row[a] * share[a];
        least = std::min(least, inPart);
    }
    return least;
}

InTarget Targets::locate(std::size_t n, const Vec3& y, std::span<const Vec3> x) const
{
    const Target& t = target_[n];
    const Edges edges(t.node, x);
    InTarget in;
    if (!(edges.volume > kNone * double(t.restVolume))) return in;
    in.share = edges.sharesOf(y - x[t.node[0]]);
    in.phi = 0;
    for (std::size_t a = 0; a < 4; ++a) in.phi += in.share[a] * double(t.phi[a]);
    in.outward = gradientTimesVolume(t.phi, edges.normal) / edges.volume;
    return in;
}

bool Targets::isBlind(std::size_t n, std::span<const Vec3> x) const
{
    return !(Edges(target_[n].node, x).volume > kNone * double(target_[n].restVolume));
}

std::size_t Targets::bytes() const
{
    return target_.capacity() * sizeof(Target) + group_.capacity() * sizeof(Group) +
           inside_.capacity() * sizeof(tetmesh::TetMatrix);
}

}  // namespace vdbfrac::contact
