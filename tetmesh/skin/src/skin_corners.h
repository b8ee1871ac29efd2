// Texture coordinates and normals for the parts of cut triangles. Not installed.
#pragma once

#include "skin_topology.h"

#include <vdbfrac/skin/skin_cut.h>
#include <vdbfrac/tetmesh/render_mesh.h>

#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::skin {

/// Points of rims move over the outer surface when lips are closed, out of the triangle that a part belongs to. Their
/// corners get what the surface has where they lie, as far as no seam is between; else what it has at the nearest
/// place this side of the seam.
class SkinCorners {
public:
    /// `given`: the outer surface, with its triangles; `points`: those of the cut; `drawn`: gets what is new.
    SkinCorners(const SkinTopology& skin, const tetmesh::RenderMesh& given, const tetmesh::Fans& fans,
                std::span<const SkinCut::Point> points, tetmesh::RenderMesh& drawn)
        : skin_(skin), given_(given), fans_(fans), points_(points), drawn_(drawn)
    {
    }

    /// The corner at a point, numbered as SkinCut::Part has them, of a part of a triangle. Parts of one triangle share
    /// corners that are asked for one after the other.
    tetmesh::RenderMesh::Corner at(std::uint32_t triangle, std::uint32_t point);

private:
    using Corner = tetmesh::RenderMesh::Corner;
    using Values = std::vector<Vec3> tetmesh::RenderMesh::*;
    using Number = std::uint32_t Corner::*;
    struct Place {
        std::uint32_t triangle = 0;
        Vec3 shares = Vec3::Zero();  // of its corners
    };

    const Corner& corner(std::uint32_t triangle, std::size_t k) const
    {
        return given_.corners[fans_.corners[triangle][k]];
    }
    std::uint32_t between(std::uint32_t triangle, const SkinCut::Point& point, Values values, Number number) const;
    Place nearest(std::uint32_t triangle, const Vec3& X, Values values, Number number) const;
    bool isSeam(std::uint32_t edge, std::uint32_t a, std::uint32_t b, Values values, Number number) const;

    const SkinTopology& skin_;
    const tetmesh::RenderMesh& given_;
    const tetmesh::Fans& fans_;
    std::span<const SkinCut::Point> points_;
    tetmesh::RenderMesh& drawn_;
    std::uint32_t triangle_ = SkinCut::kNoSkin;  // that `made_` belongs to
    std::vector<Corner> made_;
};

}  // namespace vdbfrac::skin
