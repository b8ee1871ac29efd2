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
/// place this side of the seam.
class SkinCorners {
public:
    /// `isSeam`: as seamsOf tells; `points`: those of the cut; `drawn`: gets what is new.
    SkinCorners(const GivenSkin& skin, std::span<const std::uint8_t> isSeam, std::span<const SkinCut::Point> points,
                tetmesh::RenderMesh& drawn)
        : skin_(skin), isSeam_(isSeam), points_(points), drawn_(drawn)
    {
    }

    /// The corners of parts, numbered as SkinCut::Part has them. Those at one point share what they have where no seam
    /// is near, and those of one triangle, which follow each other.
    std::vector<std::array<tetmesh::RenderMesh::Corner, 3>> of(std::span<const SkinCut::Part> parts);

private:
    struct Made {
        std::optional<Vec3> uv, normal;  // none where the triangle has none
    };

    std::optional<SkinPlace> awayFromSeams(std::uint32_t triangle, const SkinCut::Point& point) const;
    Made madeAt(std::uint32_t triangle, const SkinCut::Point& point, const std::optional<SkinPlace>& place) const;

    GivenSkin skin_;
    std::span<const std::uint8_t> isSeam_;
    std::span<const SkinCut::Point> points_;
    tetmesh::RenderMesh& drawn_;
};

}  // namespace vdbfrac::skin
