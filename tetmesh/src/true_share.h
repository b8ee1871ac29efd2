// How much of a tet is material, by the true shape of the body. Not installed.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/body_mesh.h>
#include <vdbfrac/tetmesh/cut.h>

#include <array>
#include <cstdint>
#include <vector>

namespace vdbfrac::tetmesh {

/// A tet as tets of equal volume: parts^3 by `divideTet`.
struct DividedTet {
    std::vector<std::array<double, 4>> points;  ///< barycentric
    std::vector<std::array<std::uint16_t, 4>> tets;
};
DividedTet divideTet(int parts);

/// Volumes of the true shape in tets, for one thread.
class TrueShare {
public:
    /// `shape` has to outlive this.
    TrueShare(const RestShape& shape, double voxelSize);

    /// Material volume over tet volume, of a tet of about a voxel: phi is linear in each of its parts.
    double of(const std::array<Vec3, 4>& X);
    /// Faces of the tet that was measured last which material lies on: bit a is that opposite to vertex a.
    std::uint8_t faces() const;

private:
    bool isLinear() const;
    double ofPart(const std::array<std::uint16_t, 4>& part) const;

    const RestShape& shape_;
    double dx_;
    DividedTet parts_;
    std::array<std::uint16_t, 4> corners_{};  // points that are the vertices
    std::vector<Vec3> X_;                     // of the parts' points
    std::vector<double> phi_;
};

/// What takes the linear cut of a tet to its true volume: `share` of it is material, `linear` by the cut.
double correction(double share, double linear);
/// Multiplies the volumes of a cut; no tet holds more than itself.
void scale(TetCut& cut, double factor);
/// A tet that phi does not cut, of which a part is material.
TetCut wholeCut(double fraction);

/// A tet without a vertex inside holds material when it is at least this share of it: less is not worth its nodes.
inline constexpr double kMinShare = 0.02;

}  // namespace vdbfrac::tetmesh
