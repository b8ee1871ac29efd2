#include <vdbfrac/core/joined_lips.h>

#include "arrival_frames.h"

#include <vdbfrac/grid/voxel_values.h>

#include <Eigen/Geometry>

#include <array>
#include <cstdint>
#include <variant>

namespace vdbfrac::core {

namespace {

std::vector<skin::Opposite> lipsOf(const tetmesh::DrawnTopology& drawn, double dx)
{
    const tetmesh::RenderMesh& mesh = drawn.mesh;
    std::vector<std::array<std::uint32_t, 3>> torn;
    std::vector<Vec3> normal(mesh.points.size(), Vec3::Zero());
    for (std::size_t f = 0; f < mesh.faces(); ++f) {
        const auto c = mesh.face(f);
        if (drawn.torn[f]) {
            torn.push_back({c[0].point, c[1].point, c[2].point});
            continue;
        }
        Vec3 area = Vec3::Zero();
        for (std::size_t k = 1; k + 1 < c.size(); ++k)
            area += (mesh.points[c[k].point] - mesh.points[c[0].point])
                        .cross(mesh.points[c[k + 1].point] - mesh.points[c[0].point]);
        for (const tetmesh::RenderMesh::Corner& corner : c) normal[corner.point] += area;
    }
    for (Vec3& n : normal) n.stableNormalize();
    std::vector<skin::Opposite> lips = skin::oppositeFaces(mesh.points, torn, normal, dx);
    const std::vector<skin::Opposite> rims = skin::oppositeRims(mesh.points, torn, normal, dx);
    lips.insert(lips.end(), rims.begin(), rims.end());
    return lips;
}

}  // namespace

JoinedLips::JoinedLips(const tetmesh::DrawnTopology& drawn, const Stages& stages, const Body& body, double fps)
{
    constexpr double kMet = 0.05;  // voxels: lips that are farther apart at rest have not been closed
    isJoined_.assign(drawn.mesh.points.size(), 0);
    const auto arrival = stages.sourceOf("arrival");
    if (!arrival) return;
    const double dx = body.phi.voxelSize();
    const std::vector<Vec3>& rest = drawn.mesh.points;
    std::vector<Vec3> X;
    for (const skin::Opposite& lip : lipsOf(drawn, dx)) {
        const Vec3 gap = lip.at(rest) - rest[lip.point];
        if (gap.norm() > kMet * dx) continue;
        isJoined_[lip.point] = 1;
        lips_.push_back(lip);
        gap_.push_back(gap);
        X.push_back(rest[lip.point]);
    }
    const auto values = std::get<grid::VoxelValues>(arrival->source->take(body, arrival->field.name));
    for (const float time : grid::sample(values, dx, X)) frame_.push_back(frameOfArrival(time, fps));
}

void JoinedLips::join(std::size_t frame, DrawnBody& drawn) const
{
    constexpr int kRounds = 3;  // each lip moves while the other does
    std::vector<Vec3> other(lips_.size());
    const auto joinBy = [&](std::vector<Vec3>& values, double ofGap) {
        for (int round = 0; round < kRounds; ++round) {
            for (std::size_t i = 0; i < lips_.size(); ++i) other[i] = lips_[i].at(values) - ofGap * gap_[i];
            for (std::size_t i = 0; i < lips_.size(); ++i)
                if (Vec3& own = values[lips_[i].point]; frame < frame_[i]) own = 0.5 * (own + other[i]);
        }
    };
    joinBy(drawn.points, 1);
    joinBy(drawn.velocity, 0);
}

}  // namespace vdbfrac::core
