#include "turned_normals.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/base/polygon.h>

#include <Eigen/Geometry>

#include <algorithm>

namespace vdbfrac::skin {

using tetmesh::RenderMesh;

TurnedNormals::TurnedNormals(const tetmesh::DrawnTopology& drawn, std::size_t given,
                             std::span<const std::uint32_t> places)
    : groupOf_(given, RenderMesh::kNone)
{
    groupNormals(drawn, places);
    rest_ = areas(drawn.mesh, drawn.mesh.points);
}

void TurnedNormals::groupNormals(const tetmesh::DrawnTopology& drawn, std::span<const std::uint32_t> places)
{
    const RenderMesh& mesh = drawn.mesh;
    constexpr double kEqual = 1e-6;  // squared distance of unit vectors: a twentieth of a degree
    const std::size_t given = groupOf_.size();
    std::vector<std::uint32_t> pointOf(given, RenderMesh::kNone);
    const auto eachCorner = [&](const auto& visit) {
        for (std::uint32_t f = 0; f < mesh.faces(); ++f)
            for (const RenderMesh::Corner& c : mesh.face(f))
                if (!drawn.torn[f] && c.normal < given) visit(f, c);
    };
    eachCorner([&](std::uint32_t, const RenderMesh::Corner& c) {
        pointOf[c.normal] = c.point < places.size() ? places[c.point] : c.point;
    });
    const Groups normalsOf = groupItems(mesh.points.size(), [&](const auto& add) {
        for (std::uint32_t n = 0; n < given; ++n)
            if (pointOf[n] != RenderMesh::kNone) add(pointOf[n], n);
    });
    std::uint32_t groups = 0;
    for (std::size_t p = 0; p < mesh.points.size(); ++p)
        for (const std::uint32_t n : normalsOf[p]) {
            const auto isEqual = [&](std::uint32_t other) {
                return groupOf_[other] != RenderMesh::kNone &&
                       (mesh.normals[other] - mesh.normals[n]).squaredNorm() < kEqual;
            };
            const auto same = std::ranges::find_if(normalsOf[p], isEqual);
            groupOf_[n] = same != normalsOf[p].end() ? groupOf_[*same] : groups++;
        }
    std::vector<std::uint8_t> isLeft(groups, 0);  // does a face that is left have it?
    eachCorner([&](std::uint32_t f, const RenderMesh::Corner& c) { isLeft[groupOf_[c.normal]] |= !drawn.isTaken(f); });
    facesOf_ = groupItems(groups, [&](const auto& add) {
        eachCorner([&](std::uint32_t f, const RenderMesh::Corner& c) {
            if (!drawn.isTaken(f) || !isLeft[groupOf_[c.normal]]) add(groupOf_[c.normal], f);
        });
    });
}

/// Of the groups [m^2], half by their own faces and half by the groups beside them: at the rim of a crack faces are
/// slivers, which alone tell nothing.
std::vector<Vec3> TurnedNormals::areas(const RenderMesh& mesh, std::span<const Vec3> points) const
{
    constexpr double kBeside = 1. / 18;  // a half where each point has six triangles
    const auto sums = [&](const auto& ofFace) {
        std::vector<Vec3> ofEachFace(mesh.faces()), ofGroup(facesOf_.start.size() - 1, Vec3::Zero());
        parallelChunks(ofEachFace.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            for (std::size_t f = begin; f < end; ++f) ofEachFace[f] = ofFace(mesh.face(f));
        });
        parallelChunks(ofGroup.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            for (std::size_t g = begin; g < end; ++g)
                for (const std::uint32_t f : facesOf_[g]) ofGroup[g] += ofEachFace[f];
        });
        return ofGroup;
    };
    using Face = std::span<const RenderMesh::Corner>;
    std::vector<Vec3> own = sums([&](const Face& face) {
        return Vec3(.5 * doubleArea(face.size(), [&](std::size_t k) -> const Vec3& { return points[face[k].point]; }));
    });
    const std::vector<Vec3> beside = sums([&](const Face& face) {
        Vec3 sum = Vec3::Zero();
        for (const RenderMesh::Corner& c : face)
            if (c.normal < groupOf_.size()) sum += own[groupOf_[c.normal]];
        return sum;
    });
    for (std::size_t g = 0; g < own.size(); ++g) own[g] += kBeside * beside[g];
    return own;
}

void TurnedNormals::turn(const RenderMesh& mesh, std::span<const Vec3> points, std::span<Vec3> normals) const
{
    const std::vector<Vec3> now = areas(mesh, points);
    parallelChunks(groupOf_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) {
            normals[n] = mesh.normals[n];
            const std::uint32_t g = groupOf_[n];
            if (g == RenderMesh::kNone || rest_[g].isZero() || now[g].isZero()) continue;
            const auto turn = Eigen::Quaterniond::FromTwoVectors(rest_[g], now[g]);
            normals[n] = (turn * mesh.normals[n]).stableNormalized();
        }
    });
}

}  // namespace vdbfrac::skin
