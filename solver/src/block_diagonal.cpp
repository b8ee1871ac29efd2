#include "block_diagonal.h"

#include "node_loops.h"

#include <array>

namespace vdbfrac::solver {

namespace {

/// The inverse of a definite block that single precision can hold as one; else of its size times the identity.
std::array<double, 6> inverted(const ElasticOperator::PackedBlock& m, double size)
{
    constexpr double kWorst = 1e-7;  // of det to the cube of the mean eigenvalue: condition numbers up to 1e6
    const double xx = m[0], yy = m[1], zz = m[2], yz = m[3], zx = m[4], xy = m[5];
    const std::array<double, 6> a = {yy * zz - yz * yz, zz * xx - zx * zx, xx * yy - xy * xy,
                                     zx * xy - xx * yz, xy * yz - yy * zx, yz * zx - zz * xy};
    const double det = xx * a[0] + xy * a[5] + zx * a[4], mean = (xx + yy + zz) / 3;
    const bool definite = xx > 0 && a[2] > 0 && det > kWorst * mean * mean * mean;
    if (!definite) return {1 / size, 1 / size, 1 / size, 0, 0, 0};
    return {a[0] / det, a[1] / det, a[2] / det, a[3] / det, a[4] / det, a[5] / det};
}

}  // namespace

void invertDiagonal(const LinearSystem& system, std::span<const float> extra, BlockDiagonal& inverse)
{
    const std::span<const double> mass = system.elastic.mass(), stiffness = system.elastic.stiffness();
    const auto sums = system.elastic.diagonal(system.tangent, system.blocks);
    inverse.resize(mass.size());
    eachNode<double>(mass.size(), [&](std::size_t i) {
        const double added = mass[i] * system.massFactor + (extra.empty() ? 0. : double(extra[i])),
                     size = stiffness[i] + added;
        ElasticOperator::PackedBlock block = sums(i);
        block.head<3>().array() += added;
        const std::array<double, 6> result =
            system.fixed[i] || !(size > 0) ? std::array<double, 6>{} : inverted(block, size);
        for (std::size_t k = 0; k < 6; ++k) inverse.at(i, k) = float(result[k]);
    });
}

}  // namespace vdbfrac::solver
