// The matrix of a linear system, assembled. Not installed.
#pragma once

#include <vdbfrac/solver/linear_solver.h>

#include <Eigen/SparseCore>

#include <span>

namespace vdbfrac::solver {

/// Lower triangle of A, rows and columns 3 node + axis. Fixed nodes and nodes without material have the identity; `extra`
/// [N/m], if any, is added to the diagonal.
Eigen::SparseMatrix<double> assemble(const LinearSystem& system, std::span<const float> extra);

}  // namespace vdbfrac::solver
