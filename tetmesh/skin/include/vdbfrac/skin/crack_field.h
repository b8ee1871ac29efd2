// The cracks of a body alone, apart from its outer surface.
//
// phi is the distance to the surface of what is left, skin and cracks together. c is the distance to the cracks: phi
// where it was raised, carried on to the skin and through it, so that what is drawn can be cut cleanly.
#pragma once

#include <vdbfrac/tetmesh/node_field.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace vdbfrac::skin {

struct CrackField {
    /// c [m] on voxel nodes: above 0 where a crack has taken the material, below elsewhere, -3 voxels where no crack is
    /// near. A node that has material has c < 0, one that was torn c > 0, and no |c| is below kLeast voxels.
    tetmesh::NodeField<float> c;
    /// Nodes near cracks that have c < 0 but no material, rising, each with the node of the material that it goes with.
    std::vector<std::pair<Coord, Coord>> material;
};

/// The fragment of the material at a voxel node; none where there is no material. Called from any thread.
using FragmentAt = std::function<std::optional<std::uint32_t>(Coord voxel)>;

/// `rest` and `now`: phi [m] at the start and at present, on the same box; dx: voxel size [m]; `between`: nodes between
/// parts that are apart at rest. Edges between nodes with
/// c < 0 do not join material that is apart: as the nodes of phi are joined, which is what a lattice of six tets to a
/// cell cuts by, and as `fragment` says, where it is given, for a mesh that is cut otherwise.
CrackField crackField(const tetmesh::NodeField<float>& rest, const tetmesh::NodeField<float>& now, double dx,
                      const FragmentAt& fragment = {}, std::span<const Coord> between = {});

/// Voxels outside of the body to which cracks go on: outer surfaces of any make stay within. What leads round a crack
/// farther out holds nothing together.
inline constexpr double kBeyond = 2.5;
/// Does a way over a voxel node hold together what lies at its ends? c and phi at rest there [m].
inline bool holdsTogether(double c, double rest, double dx) { return !(c > 0) && rest < kBeyond * dx; }
/// In voxels. Keeps crossings apart from the nodes.
inline constexpr double kLeast = 1e-3;
/// In voxels: by less, re-levelling may have moved phi where nothing tore.
inline constexpr double kRaised = 0.25;

}  // namespace vdbfrac::skin
