#include "block_diagonal.h"

#include <vdbfrac/base/parallel.h>

#include <Eigen/Dense>

namespace vdbfrac::solver {

namespace {

/// The inverse of a definite block that single precision can hold as one; else of its size times the identity.
SymmetricBlock inverted(const Mat3& block, double size)
{
    constexpr double kWorst = 1e-5;  // of the smallest pivot to the size: beyond, rounding to floats could lose definiteness
    const Eigen::LDLT<Mat3> factor(block);
    const bool safe = factor.info() == Eigen::Success && factor.vectorD().minCoeff() > kWorst * block.trace();
    const Mat3 inverse = safe ? Mat3(factor.solve(Mat3::Identity())) : Mat3(Mat3::Identity() / size);
    return {{float(inverse(0, 0)), float(inverse(1, 1)), float(inverse(2, 2)), float(inverse(1, 2)), float(inverse(2, 0)),
             float(inverse(0, 1))}};
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
