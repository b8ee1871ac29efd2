#include <vdbfrac/contact/lips.h>

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/phi_sampler.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <functional>
#include <optional>

namespace vdbfrac::contact {

namespace {

using Phi = std::function<double(const Vec3&)>;

constexpr double kStep = 0.1;  // voxels, along normals

/// How far it is to where phi falls to 0 again [m]; 0: nowhere within kWidest.
double gapAlong(const Vec3& X, const Vec3& normal, const Phi& phi, double dx)
{
    constexpr double kWidest = 4, kOut = 0.02;  // voxels; a surface is passed where phi has risen by that
    bool isOut = false;
    double before = 0;
    for (double t = kStep; t <= kWidest; t += kStep) {
        const double value = phi(X + t * dx * normal);
        isOut = isOut || value > kOut * dx;
        if (isOut && value <= 0) return (t - kStep * value / (value - before)) * dx;
        before = value;
    }
    return 0;
}

/// The deepest point of the material below X, and of the same piece, within `depth` [m]; X itself where there is none.
Vec3 deepBelow(const Vec3& X, const Vec3& normal, double depth, const Phi& phi, double dx)
{
    constexpr double kInside = 0.5;  // voxels
    Vec3 deep = X;
    for (double t = 2 * kInside * dx; t <= depth; t += kStep * dx) {
        if (phi(X - t * normal) > -kInside * dx) break;
        deep = X - t * normal;
    }
    return deep;
}

}  // namespace

std::vector<Lip> lipsOf(const core::Body& body, std::span<const AtRest> points)
{
    constexpr double kTorn = 0.5, kDeep = 3;  // voxels below the skin; cells
    const tetmesh::BodyMesh& mesh = *body.mesh;
    const double dx = mesh.voxelSize();
    std::vector<Lip> lips(points.size());
    parallelChunks(lips.size(), 64, [&](std::size_t begin, std::size_t end) {
        const Phi phi = grid::phiSampler(body.phi);
        for (std::size_t i = begin; i < end; ++i) {
            const auto& [X, normal] = points[i];
            if (tetmesh::trilinear(mesh.restPhi(), X / dx) > -kTorn * dx) continue;
            const double gap = gapAlong(X, normal, phi, dx);
            if (!(gap > 0)) continue;
            const Vec3 deep = deepBelow(X, normal, kDeep * mesh.spacing(), phi, dx);
            if (const auto found = deep != X ? mesh.locate(deep) : std::nullopt) lips[i] = {gap, found->point};
        }
    });
    return lips;
}

}  // namespace vdbfrac::contact
