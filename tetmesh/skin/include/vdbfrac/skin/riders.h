// Points near the material as sums over nodes of the body, each on its side of the cracks.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/body_mesh.h>
#include <vdbfrac/skin/crack_field.h>

#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::skin {

struct Rider {
    Vec3 X;        ///< m
    Coord anchor;  ///< voxel node on the side of the cracks that the point belongs to
};

/// What crackField takes for a body: nothing where six tets to a cell are cut, which joins nodes as phi's are joined;
/// other meshes have to be asked, and those whose tets stay whole. The arguments have to live as long.
FragmentAt fragmentsAt(const tetmesh::BodyMesh& body, std::span<const std::uint32_t> fragmentOfNode);

/// What carries riders, one by one.
struct Embedded {
    std::vector<tetmesh::EmbeddedPoint> points;
    std::vector<Coord> from;      ///< voxel nodes at which material was found
    std::vector<double> outside;  ///< m: how far outside of its tet a rider is; 0 in it
    std::int64_t far = 0;         ///< riders more than a tet's height outside
};

/// Each rider in a tet that has material at its anchor, or at the nearest node that no crack parts from it: the one it
/// lies in, or nearest to. `fragment`: where it is given, the tet has to be in the fragment of the anchor, by
/// `fragmentOfNode`.
Embedded embedRiders(const tetmesh::BodyMesh& body, const CrackField& cracks, std::span<const Rider> riders,
                     const FragmentAt& fragment, std::span<const std::uint32_t> fragmentOfNode);

}  // namespace vdbfrac::skin
