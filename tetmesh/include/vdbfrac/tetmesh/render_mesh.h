// A surface with all that a renderer needs of it.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/surface.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace vdbfrac::tetmesh {

/// Polygons with texture coordinates, normals, groups and materials, as .obj files have them.
struct RenderMesh {
    static constexpr std::uint32_t kNone = 0xffffffff;
    struct Corner {
        std::uint32_t point = 0, uv = kNone, normal = kNone;
    };
    std::vector<Vec3> points;  ///< m
    std::vector<Vec3> uvs;     ///< two coordinates, or three
    std::vector<Vec3> normals;
    std::vector<Corner> corners;
    std::vector<std::uint32_t> faceEnd;          ///< of each face: the end of its corners
    std::vector<std::uint32_t> group, material;  ///< of each face: which name, or kNone
    std::vector<std::string> groups, materials, libraries;
    std::string torn = "inside";  ///< the material of faces that fracture makes of it

    std::size_t faces() const { return faceEnd.size(); }
    std::span<const Corner> face(std::size_t f) const
    {
        const std::uint32_t begin = f == 0 ? 0 : faceEnd[f - 1];
        return std::span(corners).subspan(begin, faceEnd[f] - begin);
    }
    void addFace(std::span<const Corner> corners, std::uint32_t group, std::uint32_t material);
};

/// The triangles of all faces, as eachTriangle() has them, and the face of each.
struct Fans {
    std::vector<std::array<std::uint32_t, 3>> corners;  ///< places in RenderMesh::corners
    std::vector<std::uint32_t> face;
};
Fans fansOf(const RenderMesh& mesh);

/// Corners of the parts of one triangle of a mesh: its own, and new ones between them, which the mesh gets the texture
/// coordinates and normals of.
class PartCorners {
public:
    PartCorners(RenderMesh& mesh, const std::array<RenderMesh::Corner, 3>& triangle) : mesh_(mesh), triangle_(triangle)
    {
    }
    RenderMesh::Corner at(std::uint32_t point);

private:
    RenderMesh::Corner between(std::uint32_t point);

    RenderMesh& mesh_;
    std::array<RenderMesh::Corner, 3> triangle_;
    std::vector<RenderMesh::Corner> made_;
};

RenderMesh renderMesh(const PolygonSoup& soup);
PolygonSoup soupOf(const RenderMesh& mesh);

/// Normals of corners: of the faces round a point, weighted by their area, as far as they do not turn by more than
/// `crease` [degrees] against the face of the corner. Replaces those that there are. `part`, where it is given, is what
/// each face is part of: different ones meet in edges.
void setNormals(RenderMesh& mesh, double crease, std::span<const std::uint32_t> part = {});

/// Reads a surface as readSurface does; of an .obj also texture coordinates, normals, groups, materials and the names
/// of material libraries; of a .ply texture coordinates (s t, u v, or texture_u texture_v) and normals of its points.
/// Indices of texture coordinates and normals that are not there count as none. Throws as readSurface does.
RenderMesh readRenderMesh(const std::filesystem::path& file, std::uint64_t memoryLimit = ~std::uint64_t{0});

/// What is drawn of one frame: faces of fragments, some of them torn.
struct DrawnTopology {
    RenderMesh mesh;                      ///< at rest
    std::vector<std::uint32_t> fragment;  ///< of each face: the fragment's lasting id
    std::vector<std::uint8_t> torn;       ///< of each face: 1 on a face made by fracture
    /// From one face up to another: those of the outer surface that cracks have taken, where they are drawn too.
    std::array<std::uint32_t, 2> taken{};
    bool isTaken(std::size_t face) const { return face >= taken[0] && face < taken[1]; }
};

/// The name of a face's material: that of torn faces where it is torn, its own, or "outside" where it has none.
std::string_view materialOf(const DrawnTopology& drawn, std::size_t face);

/// A body of a frame, as it is deformed.
struct DrawnPart {
    const DrawnTopology& topology;
    std::span<const Vec3> points, normals;  ///< m
};

/// The points that faces use, rising.
std::vector<std::uint32_t> usedPoints(const RenderMesh& mesh);
/// Normals of corners, rising; none where a corner has none.
std::vector<std::uint32_t> usedNormals(const RenderMesh& mesh);
/// The points that some faces use, or what else their corners have a number of; rising.
std::vector<std::uint32_t> usedBy(const RenderMesh& mesh, std::span<const std::uint32_t> faces,
                                  std::uint32_t RenderMesh::Corner::*number = &RenderMesh::Corner::point);

DrawnTopology drawnTopology(const Surface& surface);
/// The triangles of a frame.
Surface triangleSurface(const DrawnTopology& topology, std::span<const Vec3> points);

}  // namespace vdbfrac::tetmesh
