// Faces that look inward are turned, with their normals.
#include "voxel_box.h"

#include <vdbfrac/tetmesh/winding.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>

using namespace vdbfrac;
using tetmesh::RenderMesh;

namespace {

RenderMesh turned(RenderMesh mesh, const std::function<bool(std::size_t)>& turns)
{
    for (std::size_t f = 0, begin = 0; f < mesh.faces(); begin = mesh.faceEnd[f++])
        if (turns(f))
            std::reverse(mesh.corners.begin() + std::ptrdiff_t(begin), mesh.corners.begin() + mesh.faceEnd[f]);
    return mesh;
}

/// Do all faces look outward of a convex mesh round the origin, and their normals with them?
void expectOutward(const RenderMesh& mesh)
{
    for (std::size_t f = 0; f < mesh.faces(); ++f) {
        const auto c = mesh.face(f);
        const auto at = [&](std::size_t k) -> const Vec3& { return mesh.points[c[k].point]; };
        EXPECT_GT((at(1) - at(0)).cross(at(2) - at(0)).dot(at(0)), 0) << f;
        for (const auto& corner : c) EXPECT_GT(mesh.normals[corner.normal].dot(at(0)), 0) << f;
    }
}

TEST(Winding, OfAClosedShellIsOutward)
{
    const RenderMesh box = test::withNormals(test::voxelBox({4, 3, 2}, .1));
    for (const double away : {0., 1e7})
        for (const std::size_t every : {1, 2, 3, 7}) {
            RenderMesh mesh = turned(box, [&](std::size_t f) { return f % every == 0; });
            for (Vec3& p : mesh.points) p.array() += away;
            EXPECT_EQ(tetmesh::windShells(mesh), (box.faces() + every - 1) / every) << away;
            for (Vec3& p : mesh.points) p.array() -= away;
            expectOutward(mesh);
        }
    RenderMesh right = box;
    EXPECT_EQ(tetmesh::windShells(right), 0u);
    EXPECT_EQ(right.normals.size(), box.normals.size());
}

/// A point may have any number of faces round it: what looks at all pairs of them takes minutes here.
TEST(Winding, OfAPointedShellTakesNoLonger)
{
    constexpr std::uint32_t kSides = 200000;
    RenderMesh mesh;
    mesh.points = {Vec3(0, 1, 0), Vec3(0, -1, 0)};
    for (std::uint32_t k = 0; k < kSides; ++k) {
        const double angle = 2 * std::numbers::pi * k / kSides;
        mesh.points.emplace_back(std::sin(angle), 0, std::cos(angle));
    }
    for (std::uint32_t k = 0; k < kSides; ++k) {
        const std::uint32_t a = 2 + k, b = 2 + (k + 1) % kSides;
        const RenderMesh::Corner top[] = {{0}, {a}, {b}}, low[] = {{1}, {b}, {a}};
        mesh.addFace(top, RenderMesh::kNone, RenderMesh::kNone),
            mesh.addFace(low, RenderMesh::kNone, RenderMesh::kNone);
    }
    mesh = turned(std::move(mesh), [](std::size_t f) { return f % 5 == 0; });
    EXPECT_EQ(tetmesh::windShells(mesh), 2 * kSides / 5);
}

/// A corner that a face has twice is no edge.
TEST(Winding, DoesNotMindRepeatedCorners)
{
    RenderMesh mesh;
    const RenderMesh box = turned(test::withNormals(test::voxelBox({4, 3, 2}, .1)), [](std::size_t) { return true; });
    mesh.points = box.points, mesh.normals = box.normals;
    for (std::size_t f = 0; f < box.faces(); ++f) {
        std::vector<RenderMesh::Corner> face(box.face(f).begin(), box.face(f).end());
        if (f == 7) face.push_back(face.back());
        mesh.addFace(face, RenderMesh::kNone, RenderMesh::kNone);
    }
    EXPECT_EQ(tetmesh::windShells(mesh), box.faces());
}

TEST(Winding, OfAnOpenShellIsThatOfMostFaces)
{
    RenderMesh sheet = test::withNormals(test::voxelBox({4, 3, 2}, .1));
    sheet.faceEnd.resize(24), sheet.corners.resize(96), sheet.group.resize(24), sheet.material.resize(24);
    RenderMesh mesh = turned(sheet, [](std::size_t f) { return f % 3 == 0; });
    EXPECT_EQ(tetmesh::windShells(mesh), 8u);
    for (std::size_t f = 0; f < 24; ++f) EXPECT_EQ(mesh.face(f)[1].point == sheet.face(f)[1].point, true) << f;
    mesh = turned(sheet, [](std::size_t) { return true; });
    EXPECT_EQ(tetmesh::windShells(mesh), 0u);
}

/// A band with half a turn has one side only, and stays as it is.
TEST(Winding, OfWhatHasOneSideIsKept)
{
    constexpr std::uint32_t kQuads = 6;
    RenderMesh band;
    for (std::uint32_t i = 0; i <= kQuads; ++i)
        band.points.push_back(Vec3(i, 0, 0)), band.points.push_back(Vec3(i, 1, 0));
    band.points[2 * kQuads] = band.points[1], band.points[2 * kQuads + 1] = band.points[0];
    for (std::uint32_t i = 0; i < kQuads; ++i) {
        const RenderMesh::Corner quad[4] = {{2 * i}, {2 * i + 2}, {2 * i + 3}, {2 * i + 1}};
        band.addFace(quad, RenderMesh::kNone, RenderMesh::kNone);
    }
    EXPECT_EQ(tetmesh::windShells(band), 0u);
}

}  // namespace
