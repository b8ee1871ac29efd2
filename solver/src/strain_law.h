// The strain laws (material.h) one tet at a time, for what the kernel does not do. Not installed.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/solver/material.h>
#include <vdbfrac/tetmesh/cell.h>

#include <array>
#include <cstddef>
#include <span>

namespace vdbfrac::solver {

/// What the energy is a square of, and what takes stresses to the frame in space: of the tets of an element and of
/// their mean.
struct StrainsOf {
    static constexpr std::size_t kMost = tetmesh::kMaxTets + 1;
    std::array<Mat3, kMost> e;
    std::array<Mat3, kMost> A;  ///< P = A (2 mu e + lambda tr(e) I)
};

/// What a law makes of F, and of the two matrices R and T that are kept of its tangent (TetTangent).
class StrainLaw {
public:
    virtual ~StrainLaw() = default;

    /// Of at most kMost.
    virtual void measure(std::span<const Mat3> F, StrainsOf& strains) const = 0;
    /// Of T over mu V / h^2, which leaves the tangent semidefinite; `share` of linear elasticity is in it.
    virtual double minEigenvalue(double share) const = 0;
    /// R of a cell from the mean of those of its parts.
    virtual Mat3 meanRotation(const Mat3& mean) const = 0;
    /// T of a tet from its share of that of its cell.
    virtual Mat3 ofTet(const Mat3& R, const Mat3& T) const = 0;
    /// A tet's block of its vertices i and j with gradients gi and gj, without dilatation; `mu` times its volume.
    virtual Mat3 block(const Vec3& gi, const Vec3& gj, const Mat3& R, const Mat3& T, double mu) const = 0;
};

const StrainLaw& lawOf(Strain);

}  // namespace vdbfrac::solver
