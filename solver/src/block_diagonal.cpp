#include "block_diagonal.h"

#include "node_loops.h"

namespace vdbfrac::solver {

namespace {

/// The inverse of a definite block that single precision can hold as one; else of its size times the identity.
SymmetricBlock inverted(const ElasticOperator::PackedBlock& m, double size)
{
    constexpr double kWorst = 1e-7;  // of det to the cube of the mean eigenvalue: condition numbers up to 1e6
    const double xx = m[0], yy = m[1], zz = m[2], yz = m[3], zx = m[4], xy = m[5];
    const double a[6] = {yy * zz - yz * yz, zz * xx - zx * zx, xx * yy - xy * xy, zx * xy - xx * yz, xy * yz - yy * zx, yz * zx - zz * xy};
    const double det = xx * a[0] + xy * a[5] + zx * a[4], mean = (xx + yy + zz) / 3;
    const bool definite = xx > 0 && a[2] > 0 && det > kWorst * mean * mean * mean;
    SymmetricBlock inverse;
    for (int k = 0; k < 6; ++k) inverse.v[k] = float(definite ? a[k] / det : k < 3 ? 1 / size : 0.);
    return inverse;
}

}  // namespace

void invertDiagonal(const LinearSystem& system, std::span<const float> extra, std::span<SymmetricBlock> inverse)
{
    const std::span<const double> mass = system.elastic.mass(), stiffness = system.elastic.stiffness();
    const auto sums = system.elastic.diagonal(system.tangent);
    eachNode<double>(inverse.size(), [&](std::size_t i) {
        const double added = mass[i] * system.massFactor + (extra.empty() ? 0. : double(extra[i])), size = stiffness[i] + added;
        ElasticOperator::PackedBlock block = sums(i);
        block.head<3>().array() += added;
        inverse[i] = system.fixed[i] || !(size > 0) ? SymmetricBlock{} : inverted(block, size);
    });
}

}  // namespace vdbfrac::solver
