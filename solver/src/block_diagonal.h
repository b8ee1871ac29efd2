// Inverses of the 3x3 diagonal blocks of a linear system, in single precision. Not installed.
#pragma once

#include <vdbfrac/solver/linear_solver.h>

#include <cstdint>
#include <span>

namespace vdbfrac::solver {

/// Symmetric 3x3 block: xx, yy, zz, yz, zx, xy.
struct SymmetricBlock {
    float v[6] = {};

    template <class V>
    V operator*(const V& r) const
    {
        using Real = typename V::Scalar;
        const Real xx = Real(v[0]), yy = Real(v[1]), zz = Real(v[2]), yz = Real(v[3]), zx = Real(v[4]), xy = Real(v[5]);
        return V(xx * r[0] + xy * r[1] + zx * r[2], xy * r[0] + yy * r[1] + yz * r[2], zx * r[0] + yz * r[1] + zz * r[2]);
    }
};

/// Writes the inverse block of each node to `inverse`: 0 at fixed nodes and where there is no material; a multiple of
/// the identity where the block is not positive definite. `extra` [N/m], if any, is added to the diagonal.
void invertDiagonal(const LinearSystem& system, std::span<const float> extra, std::span<SymmetricBlock> inverse);

}  // namespace vdbfrac::solver
