// The shortest weighted mean of a few vectors. Not installed.
#pragma once

#include <Eigen/Core>

namespace vdbfrac::solver {

/// Most vectors: all of their subsets are tried.
inline constexpr int kMaxMeans = 8;

/// Weights w >= 0 with sum 1 that make w.G w least. G: products of 1 to kMaxMeans vectors with each other.
Eigen::VectorXd shortestMean(const Eigen::MatrixXd& G);

}  // namespace vdbfrac::solver
