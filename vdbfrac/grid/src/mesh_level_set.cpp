#include "body_sources.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/tetmesh/surface_input.h>

#include <openvdb/tools/MeshToVolume.h>

#include <Eigen/Geometry>

#include <array>
#include <limits>
#include <numbers>
#include <vector>

namespace vdbfrac::grid {

namespace {

/// What tools::meshToVolume asks a mesh for. Points are in voxels.
struct Triangles {
    std::vector<Vec3> points;
    std::vector<std::array<std::uint32_t, 3>> corners;

    std::size_t polygonCount() const { return corners.size(); }
    std::size_t pointCount() const { return points.size(); }
    std::size_t vertexCount(std::size_t) const { return 3; }
    void getIndexSpacePoint(std::size_t n, std::size_t v, openvdb::Vec3d& p) const
    {
        const Vec3& X = points[corners[n][v]];
        p = {X.x(), X.y(), X.z()};
    }
};

void place(tetmesh::PolygonSoup& soup, const scene::MeshFile& mesh)
{
    const Vec3 r = mesh.rotate * (std::numbers::pi / 180);
    const Mat3 R = (Eigen::AngleAxisd(r.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(r.y(), Vec3::UnitY()) *
                    Eigen::AngleAxisd(r.x(), Vec3::UnitX()))
                       .toRotationMatrix();
    for (Vec3& X : soup.points) X = R * (mesh.scale * X) + mesh.translate;
}

/// Fans of triangles; the polygons of a closed surface stay closed, planar or not.
Triangles triangles(const tetmesh::PolygonSoup& soup, double dx)
{
    Triangles t;
    t.points.reserve(soup.points.size());
    for (const Vec3& X : soup.points) t.points.push_back(X / dx);
    for (const std::vector<std::size_t>& p : soup.polygons)
        for (std::size_t c = 2; c < p.size(); ++c)
            t.corners.push_back({std::uint32_t(p[0]), std::uint32_t(p[c - 1]), std::uint32_t(p[c])});
    return t;
}

void requireSolid(const tetmesh::SurfaceReport& report, const scene::MeshFile& mesh, const Build& build)
{
    const std::string file = mesh.file.string();
    if (!report.lower.allFinite() || !report.upper.allFinite())
        complain(build, file + " has coordinates that are not finite once scaled and moved", "", "check 'scale'");
    if (!report.closed && report.openEdges == 0)
        complain(build, file + " has no faces with area", "a closed surface", "");
    if (!report.closed)
        complain(build, file + " is not closed: " + std::to_string(report.openEdges) + " open edges",
                 "a closed surface", "close its holes in a modelling program, or give a level set (.vdb) instead");
}

}  // namespace

openvdb::FloatGrid::Ptr fromSurface(const tetmesh::PolygonSoup& soup, const tetmesh::SurfaceReport& report, const Build& build)
{
    const double dx = build.grid.voxelSize;
    const Vec3 band = Vec3::Constant((build.grid.halfWidth + 1) * dx);
    requireReach(build, report.lower - band, report.upper + band);
    requireMemory(build, bytesOfBand(report.area / (dx * dx), build.grid.halfWidth));
    if (soup.points.size() > std::numeric_limits<std::uint32_t>::max() || report.area == 0)
        complain(build, "a surface without area or with too many points", "", "");

    const auto transform = openvdb::math::Transform::createLinearTransform(dx);
    const float width = float(build.grid.halfWidth);
    auto grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(triangles(soup, dx), *transform, width, width);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    return grid;
}

openvdb::FloatGrid::Ptr fromMesh(const scene::MeshFile& mesh, const Build& build)
{
    tetmesh::PolygonSoup soup = tetmesh::readSurface(mesh.file, build.memoryLimit);
    place(soup, mesh);
    const tetmesh::SurfaceReport report = tetmesh::examine(soup);
    requireSolid(report, mesh, build);
    return fromSurface(soup, report, build);
}

}  // namespace vdbfrac::grid
