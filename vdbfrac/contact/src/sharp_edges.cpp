#include "sharp_edges.h"

#include "near_points.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/phi_sampler.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <functional>

namespace vdbfrac::contact {

namespace {

// Voxels. The cut may be this far below a smooth surface, and below an edge by up to a voxel.
constexpr double kBelow = 0.12, kFarthest = 1;
constexpr double kAbove = 0.2;  // voxels: what is farther out, as phi tells it a voxel outside, is no edge
constexpr double kNear = 2.5;   // voxels: faces this near meet
constexpr double kFit = 0.05;   // voxels: faces that miss the point where they meet by more than this are round
constexpr double kTurn = 0.15;  // of the largest eigenvalue: faces that differ by less than 40 degrees are one

struct Triangle {
    Vec3 centre, normal;
    double area = 0;
};

/// A plane through a point, with the weight of its triangle.
struct Face {
    Vec3 at, normal;
    double weight = 0;
};

using Phi = std::function<double(const Vec3&)>;

Triangle triangleOf(const tetmesh::EmbeddedSurface& cut, std::size_t t, std::span<const Vec3> X)
{
    const auto& [a, b, c] = cut.triangles[t];
    const Vec3 twice = (X[b] - X[a]).cross(X[c] - X[a]);
    return {(X[a] + X[b] + X[c]) / 3, twice.stableNormalized(), .5 * twice.norm()};
}

/// Is a point one voxel outside of a triangle nearer to the surface than that? Inside, a thin wall would bend phi.
bool isBelow(const Triangle& t, const Phi& phi, double dx) { return phi(t.centre + dx * t.normal) < (1 - kBelow) * dx; }

/// The face that a triangle lies on, as phi has it a voxel outside; without weight where the surface is not flat.
Face faceOf(const Triangle& t, const Phi& phi, double dx)
{
    constexpr double kSteep = 0.003, kAlong = 0.7;
    const Vec3 above = t.centre + dx * t.normal;
    Vec3 slope;
    for (int k = 0; k < 3; ++k) {
        const Vec3 step = .5 * dx * Vec3::Unit(k);
        slope[k] = (phi(above + step) - phi(above - step)) / dx;
    }
    const Vec3 normal = slope.stableNormalized();
    const bool isFlat = std::abs(slope.norm() - 1) < kSteep && normal.dot(t.normal) > kAlong;
    return {above - phi(above) * normal, normal, isFlat ? t.area : 0};
}

/// Those near a triangle that turn the same way; the other side of a wall does not.
std::vector<Face> facesNear(const NearPoints<Face>& faces, const Triangle& t, double width)
{
    constexpr double kFacing = 0.3;  // cosine
    std::vector<Face> all;
    faces.visitNear(t.centre, [&](const Face& f) {
        if ((f.at - t.centre).norm() < width && f.normal.dot(t.normal) > kFacing) all.push_back(f);
    });
    return all;
}

/// The nearest point to `at` where faces meet, by least squares; `at` where they do not.
Vec3 meetingPoint(const Vec3& at, std::span<const Face> faces, double dx)
{
    Mat3 A = Mat3::Zero();
    Vec3 b = Vec3::Zero(), way = Vec3::Zero();
    for (const Face& f : faces) {
        A += f.weight * f.normal * f.normal.transpose();
        b += f.weight * f.normal.dot(f.at - at) * f.normal;
    }
    const Eigen::SelfAdjointEigenSolver<Mat3> modes(A);
    for (int k = 0; k < 3; ++k)
        if (const double stiff = modes.eigenvalues()[k]; stiff > kTurn * modes.eigenvalues()[2])
            way += modes.eigenvectors().col(k).dot(b) / stiff * modes.eigenvectors().col(k);
    double misfit = 0, weight = 0;
    for (const Face& f : faces) misfit += f.weight * std::pow(f.normal.dot(f.at - at - way), 2), weight += f.weight;
    const bool meet = way.norm() < kFarthest * dx && misfit < kFit * kFit * dx * dx * weight;
    return meet ? Vec3(at + way) : at;
}

}  // namespace

std::vector<EdgePoint> edgePoints(const tetmesh::EmbeddedSurface& cut, std::span<const Vec3> X,
                                  std::span<const std::uint8_t> isTorn, const grid::LevelSet& level)
{
    const double dx = level.voxelSize();
    const Phi phi = grid::phiSampler(level);
    const std::size_t count = cut.triangles.size();
    // Beside a crack nothing holds what lies outside of the cut.
    const auto isWhole = [&](std::size_t t) {
        return std::ranges::none_of(cut.triangles[t], [&](std::uint32_t p) { return isTorn[p] != 0; });
    };
    const auto below = gatherChunks<std::uint32_t>(count, kChunk, [&](std::size_t begin, std::size_t end, auto& all) {
        for (std::size_t t = begin; t < end; ++t)
            if (isWhole(t) && isBelow(triangleOf(cut, t, X), phi, dx)) all.push_back(std::uint32_t(t));
    });
    NearPoints<Face> near(kNear * dx);
    for (const std::uint32_t t : below) near.openNear(triangleOf(cut, t, X).centre);
    const auto faces = gatherChunks<Face>(count, kChunk, [&](std::size_t begin, std::size_t end, auto& all) {
        for (std::size_t t = begin; t < end; ++t) {
            const Triangle triangle = triangleOf(cut, t, X);
            if (cut.torn[t] || !near.isOpen(triangle.centre) || std::ranges::binary_search(below, t)) continue;
            if (const Face face = faceOf(triangle, phi, dx); face.weight > 0) all.push_back(face);
        }
    });
    for (const Face& f : faces)
        if (near.isOpen(f.at)) near.add(f.at, f);
    return gatherChunks<EdgePoint>(below.size(), kChunk, [&](std::size_t begin, std::size_t end, auto& all) {
        for (std::size_t i = begin; i < end; ++i) {
            const Triangle t = triangleOf(cut, below[i], X);
            const Vec3 at = meetingPoint(t.centre, facesNear(near, t, kNear * dx), dx);
            const bool isOut = (at - t.centre).dot(t.normal) > kBelow * dx;
            if (isOut && phi(at + dx * t.normal) < (1 + kAbove) * dx) all.push_back({below[i], at});
        }
    });
}

}  // namespace vdbfrac::contact
