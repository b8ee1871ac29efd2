// How good the tets of a mesh are.
#pragma once

#include <vdbfrac/tetmesh/tet_mesh.h>

#include <array>
#include <cstdint>

namespace vdbfrac::tetmesh {

inline constexpr std::size_t kDihedralBins = 18;  ///< of 10 degrees

struct TetQuality {
    std::int64_t inverted = 0;                            ///< tets of volume <= 0
    double volume = 0;                                    ///< of all [m^3]
    double smallestVolume = 0;                            ///< of a tet [m^3]
    double smallestDihedral = 180, largestDihedral = 0;   ///< angle between two faces of a tet [degrees]
    std::array<std::int64_t, kDihedralBins> dihedrals{};  ///< how many angles are in [10 b, 10 b + 10) degrees
    /// 3 x radius of the inscribed over that of the circumscribed ball: 1 for a regular tet, 0 for a flat one.
    double smallestRadiusRatio = 1, meanRadiusRatio = 0;
};

/// A mesh without tets has the values above. The same bits for any number of threads.
TetQuality qualityOf(const TetMesh& mesh);

}  // namespace vdbfrac::tetmesh
