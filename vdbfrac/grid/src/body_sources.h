// What a body is made of before analytic solids are united with it and taken from it. Not installed.
#pragma once

#include "openvdb_access.h"
#include <vdbfrac/base/number_text.h>

#include <vdbfrac/scene/scene.h>
#include <vdbfrac/tetmesh/surface_input.h>

#include <cstdint>
#include <string>
#include <vector>

namespace vdbfrac::grid {

/// What every source of a level set has to know.
struct Build {
    scene::Grid grid;
    std::uint64_t memoryLimit = 0;              ///< bytes
    std::string place;                          ///< of the body in its scene, for complaints
    std::string subject;                        ///< what it is called in complaints: "body 'block'"
    std::vector<std::string>* notes = nullptr;  ///< what may not be as it was meant, for whom it concerns
    /// Most voxels along the longest side, larger ones than the grid's if need be; 0: as many as there are.
    int across = 0;
};

/// Of a shape with these bounds: with the voxel size that `across` asks for.
Build outlined(Build build, const Vec3& lower, const Vec3& upper);

/// Farthest voxel from the origin along an axis. Well inside 32 bits, and floats of this size still tell voxels apart.
inline constexpr double kFarthestVoxel = 1 << 23;

/// OpenVDB takes a transform with a determinant below 3e-15 for singular.
inline constexpr double kSmallestVoxel = 1.5e-5;  // m

/// Bytes of a leaf of 8^3 floats with its share of the nodes above it.
inline constexpr double kBytesPerLeaf = 2400;

/// Peak bytes of making a band of `halfWidth` voxels on both sides of a surface that has the area of `faces` voxel
/// faces: distances, the closest polygon of each voxel and the copies that threads make before they are joined, in
/// leaves that reach 4.5 voxels beyond the band on average. Fitted to measured runs of meshToVolume.
inline double bytesOfBand(double faces, int halfWidth)
{
    constexpr double kFixed = 16e6, kPerVoxel = 16;
    return kFixed + kPerVoxel * faces * (2. * halfWidth + 9);
}

/// Throws InputError at `build.place`.
[[noreturn]] void complain(const Build& build, const std::string& what, const std::string& allowed,
                           const std::string& hint);

/// Throws InputError when the voxel size is not finite or below kSmallestVoxel.
void requireVoxelSize(const Build& build);

/// Throws LimitError when `bytes` pass the limit, naming body and voxel size.
void requireMemory(const Build& build, double bytes);

/// Throws InputError when a box [m] has a corner that is not finite or beyond kFarthestVoxel.
void requireReach(const Build& build, const Vec3& lower, const Vec3& upper);

/// A surface as a level set, by the closest triangle of each voxel of the band; what no way from outside leads to is
/// inside. Checks reach and memory; `report` is of the soup, and every index is in range.
struct SurfaceGrid {
    openvdb::FloatGrid::Ptr phi;
    std::int64_t gaps = 0;  ///< pairs of neighbouring voxels inside with a gap between them, which is filled
};
SurfaceGrid fromSurface(const tetmesh::PolygonSoup& soup, const tetmesh::SurfaceReport& report, const Build& build);

/// Is any voxel inside?
bool hasMaterial(const openvdb::FloatGrid& grid);

/// A closed mesh as a level set, by the closest triangle of each voxel of the band. Orientation does not matter.
openvdb::FloatGrid::Ptr fromMesh(const scene::MeshFile& mesh, const Build& build);

/// A level set of a file; rebuilt from its surface when voxel size, band or origin are not those of the scene.
openvdb::FloatGrid::Ptr fromVdb(const scene::VdbFile& file, const Build& build);

}  // namespace vdbfrac::grid
