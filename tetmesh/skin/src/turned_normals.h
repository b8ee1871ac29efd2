// Given normals turn as the surface does that is drawn. Not installed.
//
// Those that are equal at a point belong to one smooth piece of surface there: they turn as the area vector of its
// faces, and of those beside them. So shading is as smooth as the surface is, and edges that were sharp stay so,
// whatever the cells under them do.
#pragma once

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/tetmesh/render_mesh.h>

#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::skin {

class TurnedNormals {
public:
    /// The first `given` normals of what is drawn; each is of one point. Torn faces take no part, and faces that cracks
    /// have taken where there are others. `places`: of each of the first points a number that those with equal
    /// coordinates share, as split points do at seams.
    TurnedNormals(const tetmesh::DrawnTopology& drawn, std::size_t given, std::span<const std::uint32_t> places);

    /// Writes them for the same mesh with its points elsewhere [m].
    void turn(const tetmesh::RenderMesh& mesh, std::span<const Vec3> points, std::span<Vec3> normals) const;

private:
    void groupNormals(const tetmesh::DrawnTopology& drawn, std::span<const std::uint32_t> places);
    std::vector<Vec3> areas(const tetmesh::RenderMesh& mesh, std::span<const Vec3> points) const;

    std::vector<std::uint32_t> groupOf_;  // of each given normal; kNone: no face has it
    Groups facesOf_;                      // of each group
    std::vector<Vec3> rest_;              // m^2, of each group
};

}  // namespace vdbfrac::skin
