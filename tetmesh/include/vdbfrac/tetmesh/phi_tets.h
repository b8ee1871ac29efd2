// The tets near the surface with phi in them: how deep a point of the deformed material lies.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace vdbfrac::tetmesh {

using TetMatrix = std::array<std::array<double, 4>, 4>;

/// A tet, or a part of one, in which phi is linear as the cut sees it. A tet holds one piece of material, so its phi
/// tells one side of a crack from the other where phi on the voxels has both.
struct PhiTet {
    std::uint32_t element = 0;
    std::uint32_t part = 0;               ///< into PhiTets::inside
    std::array<std::uint32_t, 4> node{};  ///< of the whole tet, in nodes of the body
    std::array<float, 4> phi{};           ///< what phi of the part comes to at these nodes [m]
};

struct PhiTets {
    std::vector<PhiTet> tets;  ///< by rising element
    /// Of each kind of part: times barycentric coordinates in the tet it gives those in the part. The first is a whole
    /// tet.
    std::vector<TetMatrix> inside{{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}};
};

}  // namespace vdbfrac::tetmesh
