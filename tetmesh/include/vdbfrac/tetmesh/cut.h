// One tet cut by a linear phi.
//
// phi < 0 is material. The zero crossing of an edge is reckoned from its inside to its outside end, so all tets round
// an edge find the same point to the bit.
#pragma once

#include <vdbfrac/base/vec.h>

#include <array>
#include <cstdint>

namespace vdbfrac::tetmesh {

/// The material part of a tet and the piece of surface in it.
struct TetCut {
    double fraction = 0;             ///< material volume / tet volume, in [0, 1]
    std::array<double, 4> moment{};  ///< integral of N_a over the material / tet volume; they sum to fraction
    int polygonSize = 0;             ///< 0 (uncut), 3 or 4 corners, normal away from the material
    std::array<std::array<std::uint8_t, 2>, 4> edge{};  ///< tet vertices of each polygon corner: {inside, outside}
    std::array<double, 4> t{};                          ///< crossing from the inside to the outside vertex, in [0, 1]
};

/// Cuts the tet `vertex` (any scale) by `phi` at its vertices. Values exactly 0 count as outside.
TetCut cutTet(const std::array<Vec3, 4>& vertex, const std::array<double, 4>& phi);

/// |phi| below this fraction of dx is taken as 0 by the cut (and only by it): a crossing that near to a node
/// would make pieces whose volume is lost in rounding.
inline constexpr double kSnap = 1e-6;

}  // namespace vdbfrac::tetmesh
