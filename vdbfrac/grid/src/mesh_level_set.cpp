#include "body_sources.h"
#include "settle_signs.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/grid/level_set_surface.h>
#include <vdbfrac/grid/relevel.h>
#include <vdbfrac/tetmesh/planar.h>
#include <vdbfrac/tetmesh/surface_input.h>

#include <openvdb/tools/MeshToVolume.h>

#include <cmath>
#include <limits>
#include <vector>

namespace vdbfrac::grid {

namespace {

/// The polygons of a closed surface stay closed, planar or not.
Triangles triangles(const tetmesh::PolygonSoup& soup, double dx)
{
    Triangles t;
    t.points.reserve(soup.points.size());
    for (const Vec3& X : soup.points) t.points.push_back(X / dx);
    std::vector<Vec3> corners;
    for (const std::vector<std::size_t>& p : soup.polygons) {
        corners.clear();
        for (const std::size_t corner : p) corners.push_back(soup.points[corner]);
        tetmesh::eachTriangle(corners, [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            t.corners.push_back({std::uint32_t(p[a]), std::uint32_t(p[b]), std::uint32_t(p[c])});
        });
    }
    return t;
}

/// Of triangles, their tree, and the normals of their edges and corners while these are found.
constexpr double kBytesPerTriangle = 140;

double triangleCount(const tetmesh::PolygonSoup& soup)
{
    double count = 0;
    for (const std::vector<std::size_t>& p : soup.polygons) count += p.size() > 2 ? double(p.size() - 2) : 0;
    return count;
}

void requireSolid(const tetmesh::SurfaceReport& report, const scene::MeshFile& mesh, const Build& build)
{
    const std::string file = mesh.file.string();
    if (!report.lower.allFinite() || !report.upper.allFinite())
        complain(build, file + " has coordinates that are not finite once scaled and moved", "", "check 'scale'");
    if (!report.closed && report.openEdges == 0)
        complain(build, file + " has no faces with area", "a closed surface", "");
    if (report.closed) return;
    complain(
        build, file + " is not closed: " + std::to_string(report.openEdges) + " open edges", "a closed surface",
        "repair it: vdbfrac relevel " + file + " -o solid.vdb --voxel " +
            shortNumber(build.grid.voxelSize / mesh.scale) + ", and give shape = { vdb = " +
            (scene::placeOf(mesh).isMoved() ? "{ file = \"solid.vdb\", ... } } with the same scale, rotate, translate"
                                            : "\"solid.vdb\" }") +
            "; 'vdbfrac embed' then carries the mesh itself along, with its texture coordinates");
}

}  // namespace

Voxelized voxelize(const Triangles& triangles, double voxelSize, float halfWidth)
{
    constexpr int kExact = openvdb::tools::DISABLE_INTERSECTING_VOXEL_REMOVAL | openvdb::tools::DISABLE_RENORMALIZATION;
    const auto transform = openvdb::math::Transform::createLinearTransform(voxelSize);
    auto closest = openvdb::Int32Grid::create(openvdb::util::INVALID_IDX);
    closest->setTransform(transform);
    auto phi = openvdb::tools::meshToVolume<openvdb::FloatGrid>(triangles, *transform, halfWidth, halfWidth, kExact,
                                                                closest.get());
    phi->setGridClass(openvdb::GRID_LEVEL_SET);
    return {phi, closest};
}

SurfaceGrid fromSurface(const tetmesh::PolygonSoup& soup, const tetmesh::SurfaceReport& report, const Build& build)
{
    const double dx = build.grid.voxelSize;
    const double longest = (report.upper - report.lower).maxCoeff();
    if (dx > longest)
        complain(build, "voxels of " + shortNumber(dx) + " m are larger than the whole surface",
                 "up to " + shortNumber(longest) + " m, better a tenth of it", "check its units");
    const Vec3 band = Vec3::Constant((build.grid.halfWidth + 1) * dx);
    requireReach(build, report.lower - band, report.upper + band);
    requireMemory(build,
                  bytesOfBand(report.area / (dx * dx), build.grid.halfWidth) + kBytesPerTriangle * triangleCount(soup));
    if (soup.points.size() > std::numeric_limits<std::uint32_t>::max() || report.area == 0)
        complain(build, "a surface without area or with too many points", "", "");

    const Triangles mesh = triangles(soup, dx);
    const Voxelized made = voxelize(mesh, dx, float(build.grid.halfWidth));
    const std::int64_t gaps = settleSigns(*made.phi, *made.closest, mesh);
    return {made.phi, gaps};
}

std::string gapText(std::int64_t gaps, double voxelSize)
{
    return std::to_string(gaps) +
           " pairs of neighbouring voxels have a gap between them that is too narrow for voxels of " +
           shortNumber(voxelSize) + " m, and is filled; take smaller voxels, or make it wider";
}

double volumeChange(double made, double input) { return input > 0 ? made / input - 1 : 0; }

std::string volumeText(double made, double input, double voxelSize)
{
    constexpr double kRoundedOff = .03;
    const double change = volumeChange(made, input);
    if (std::abs(change) <= kRoundedOff) return "";
    return "the input encloses " + shortNumber(input, 4) + " m^3, the level set " + shortNumber(made, 4) + " m^3 (" +
           (change > 0 ? "+" : "") + shortNumber(100 * change, 3) + " %): " +
           (change < 0 ? "parts of it are too thin"
                       : "hollows that are closed on all sides are filled, or gaps are too narrow") +
           " for voxels of " + shortNumber(voxelSize, 4) + " m";
}

openvdb::FloatGrid::Ptr fromMesh(const scene::MeshFile& mesh, const Build& given)
{
    tetmesh::PolygonSoup soup = tetmesh::readSurface(mesh.file, given.memoryLimit);
    for (const scene::FilePlace place = scene::placeOf(mesh); Vec3 & X : soup.points) X = place(X);
    const tetmesh::SurfaceReport report = tetmesh::examine(soup);
    requireSolid(report, mesh, given);
    const Build build = outlined(given, report.lower, report.upper);
    const SurfaceGrid made = fromSurface(soup, report, build);
    if (!build.notes) return made.phi;
    constexpr double kLost = .5;  // shells that overlap count more than once
    const double volume = enclosedVolume(wrap(made.phi)), ofMesh = std::abs(report.volume);
    const std::string another = volume < kLost * ofMesh ? volumeText(volume, ofMesh, build.grid.voxelSize) : "";
    if (made.gaps > 0) build.notes->push_back(build.subject + ": " + gapText(made.gaps, build.grid.voxelSize));
    if (!another.empty()) build.notes->push_back(build.subject + ": " + another);
    return made.phi;
}

}  // namespace vdbfrac::grid
