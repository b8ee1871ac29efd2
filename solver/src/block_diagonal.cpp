#include "block_diagonal.h"

#include <vdbfrac/base/parallel.h>

namespace vdbfrac::solver {

namespace {

/// The inverse of a definite block that single precision can hold as one; else of its size times the identity.
SymmetricBlock inverted(const Mat3& m, double size)
{
    constexpr double kWorst = 1e-7;  // of det to the cube of the mean eigenvalue: condition numbers up to 1e6
    const double xx = m(0, 0), yy = m(1, 1), zz = m(2, 2), yz = m(1, 2), zx = m(2, 0), xy = m(0, 1);
    const double a[6] = {yy * zz - yz * yz, zz * xx - zx * zx, xx * yy - xy * xy, zx * xy - xx * yz, xy * yz - yy * zx, yz * zx - zz * xy};
    const double det = xx * a[0] + xy * a[5] + zx * a[4], mean = (xx + yy + zz) / 3;
    const bool definite = xx > 0 && a[2] > 0 && det > kWorst * mean * mean * mean;
    SymmetricBlock inverse;
    for (int k = 0; k < 6; ++k) inverse.v[k] = float(definite ? a[k] / det : k < 3 ? 1 / size : 0.);
    return inverse;
}

}  // namespace

void invertDiagonal(const LinearSystem& system, std::span<const float> extra, std::vector<Mat3>& scratch, std::span<SymmetricBlock> inverse)
{
    const std::span<const double> mass = system.elastic.mass(), stiffness = system.elastic.stiffness();
    const auto added = [&](std::size_t i) { return mass[i] * system.massFactor + (extra.empty() ? 0. : double(extra[i])); };
    scratch.resize(inverse.size());
    parallelChunks(inverse.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) scratch[i] = added(i) * Mat3::Identity();
    });
    system.elastic.addDiagonal(system.tangent, scratch);
    parallelChunks(inverse.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const double size = stiffness[i] + added(i);
            inverse[i] = system.fixed[i] || !(size > 0) ? SymmetricBlock{} : inverted(scratch[i], size);
        }
    });
}

}  // namespace vdbfrac::solver
