// Texture coordinates and normals for the parts of cut triangles. Not installed.
#pragma once

#include "skin_topology.h"

#include <vdbfrac/skin/skin_cut.h>
#include <vdbfrac/tetmesh/render_mesh.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace vdbfrac::skin {

/// The outer surface as it was given, with its triangles.
struct GivenSkin {
    const SkinTopology& topology;
    const tetmesh::RenderMesh& mesh;
    const tetmesh::Fans& fans;

    const tetmesh::RenderMesh::Corner& corner(std::uint32_t triangle, std::size_t k) const
    {
        return mesh.corners[fans.corners[triangle][k]];
    }
};

/// Somewhere on it.
struct SkinPlace {
    std::uint32_t triangle;
    Vec3 at;  ///< m
};

/// Of each place of the surface: do texture coordinates or normals jump at an edge that ends there?
std::vector<std::uint8_t> seamsOf(const GivenSkin& skin);

/// Points of rims move over the outer surface when lips are closed, out of the triangle that a part belongs to. Their
/// corners get what the surface has where they lie, as far as no seam is between; else what it has at the nearest
/// place on the side of the seam where the middle of the part lies.
class SkinCorners {
public:
    /// `isSeam`: as seamsOf tells; `points`: those of the cut; `drawn`: gets what is new.
    SkinCorners(const GivenSkin& skin, std::span<const std::uint8_t> isSeam, std::span<const SkinCut::Point> points,
                tetmesh::RenderMesh& drawn)
        : skin_(skin), isSeam_(isSeam), points_(points), drawn_(drawn)
    {
    }

    /// The corners of parts, numbered as SkinCut::Part has them. Those at one point share what they have where no seam
    /// is near, and those of one chart, which follow each other.
    std::vector<std::array<tetmesh::RenderMesh::Corner, 3>> of(std::span<const SkinCut::Part> parts);

private:
    struct Made {
        std::optional<Vec3> uv, normal;  // none where the triangle has none
    };

    /// Of a part: triangles on whose side of the seams it has its texture coordinates and its normals.
    struct Chart {
        std::uint32_t uv = 0, normal = 0;
        bool operator==(const Chart&) const = default;
    };

    const Vec3& place(std::uint32_t point) const;
    Chart chartOf(const SkinCut::Part& part) const;
    std::optional<SkinPlace> awayFromSeams(std::uint32_t triangle, const Vec3& X) const;
    Made madeAt(const Chart& chart, const Vec3& X, const std::optional<SkinPlace>& place) const;
    tetmesh::RenderMesh::Corner givenCorner(const SkinCut::Part& part, std::uint32_t point, const Chart& chart);

    GivenSkin skin_;
    std::span<const std::uint8_t> isSeam_;
    std::span<const SkinCut::Point> points_;
    tetmesh::RenderMesh& drawn_;
};

}  // namespace vdbfrac::skin
