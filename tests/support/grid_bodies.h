// Bodies as level sets, and what is measured of them.
#pragma once

#include "openvdb_access.h"

#include <vdbfrac/grid/body_level_set.h>
#include <vdbfrac/grid/vdb_file.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace vdbfrac::test {

using grid::LevelSet;

inline constexpr std::uint64_t kPlenty = std::uint64_t{4} << 30;  // bytes
inline constexpr double kDx = 0.04;
// tools::meshToVolume leaves out voxels that are 2.8 to 3 voxels from an edge across both of its faces.
inline constexpr double kMeshBand = 0.9;
// tools::levelSetRebuild goes through a mesh of its own, whose creases show in the outer half of the band.
inline constexpr double kRebuiltBand = 0.5, kRebuilt = 0.15;  // of the band; of a voxel
// A voxel's share is taken from phi at its center alone: second order in dx / radius of curvature.
inline constexpr double kVolumeTolerance = 0.01;

inline scene::Grid gridOf(double dx)
{
    scene::Grid grid;
    grid.voxelSize = dx;
    return grid;
}

inline scene::Body bodyOf(decltype(scene::Body::shape) shape)
{
    scene::Body body;
    body.name = "thing";
    body.shape = std::move(shape);
    body.place = "scene.toml:7:1";
    return body;
}

inline Primitive sphere(double radius, const Vec3& center = Vec3(0.013, -0.2, 0.31))
{
    Primitive p;
    p.kind = Primitive::Kind::sphere;
    p.radius = radius;
    p.center = center;
    return p;
}

inline Primitive box(const Vec3& size)
{
    Primitive p;
    p.size = size;
    p.center = Vec3(0.007, 0.011, -0.003);
    return p;
}

inline LevelSet make(const scene::Body& body, double dx = kDx) { return grid::makeLevelSet(body, gridOf(dx), kPlenty); }

/// Volume by the share of each voxel that lies inside a plane at the distance phi.
inline double volume(const LevelSet& phi)
{
    const openvdb::FloatGrid& grid = *phi.grid().grid;
    const double dx = phi.voxelSize();
    openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    const auto accessor = grid.getConstAccessor();
    double voxels = 0;
    for (auto ijk = box.begin(); ijk; ++ijk) voxels += std::clamp(0.5 - accessor.getValue(*ijk) / dx, 0., 1.);
    return voxels * dx * dx * dx;
}

/// Largest difference of two level sets where the first is nearer to its surface than `within` bands.
inline double difference(const LevelSet& a, const LevelSet& b, double within = 1)
{
    const auto other = b.grid().grid->getConstAccessor();
    double worst = 0;
    for (auto v = a.grid().grid->cbeginValueOn(); v; ++v)
        if (std::abs(*v) < within * a.background())
            worst = std::max(worst, std::abs(double(*v) - other.getValue(v.getCoord())));
    return worst;
}

inline std::string cubeObj(const std::string& lastFace = "f 2 4 8 6\n")
{
    std::string text;
    for (int i = 0; i < 8; ++i)
        text += "v " + std::to_string(i & 1) + " " + std::to_string(i >> 1 & 1) + " " + std::to_string(i >> 2) + "\n";
    return text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\n" + lastFace;
}

template <class E>
std::string complaint(const scene::Body& body, double dx = kDx)
{
    try {
        make(body, dx);
    } catch (const E& e) {
        return e.what();
    }
    return "";
}

inline void expectLevelSet(const LevelSet& phi)
{
    const openvdb::FloatGrid& grid = *phi.grid().grid;
    EXPECT_EQ(grid.getGridClass(), openvdb::GRID_LEVEL_SET);
    EXPECT_TRUE(grid.transform().indexToWorld(openvdb::Vec3d(0)).eq(openvdb::Vec3d(0)));
    for (auto v = grid.cbeginValueAll(); v; ++v) EXPECT_LE(std::abs(*v), grid.background());
}

}  // namespace vdbfrac::test
