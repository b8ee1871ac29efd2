// The matrix of a linear system, assembled. Not installed.
#pragma once

#include <vdbfrac/solver/linear_solver.h>

#include <Eigen/SparseCore>

#include <span>

namespace vdbfrac::solver {

/// Calls add(row, column, value) for all that adds up to the lower triangle of A; rows and columns are 3 node + axis.
/// Fixed nodes and nodes without material have the identity; `extra` [N/m], if any, is added to the diagonal.
template <class Add>
void eachEntry(const LinearSystem& system, std::span<const float> extra, const Add& add)
{
    const ElasticOperator& elastic = system.elastic;
    std::size_t element = 0;
    for (const ElementSet& set : elastic.sets())
        for (const tetmesh::CellElement& e : set.elements) {
            const ElasticOperator::ElementMatrix K = elastic.elementMatrix(system.tangent, element++);
            for (Eigen::Index i = 0; i < 24; ++i)
                for (Eigen::Index j = 0; j < 24; ++j) {
                    const std::size_t a = set.firstNode + e.node[std::size_t(i / 3)],
                                      b = set.firstNode + e.node[std::size_t(j / 3)];
                    const Eigen::Index row = Eigen::Index(3 * a) + i % 3, column = Eigen::Index(3 * b) + j % 3;
                    if (row >= column && !system.fixed[a] && !system.fixed[b]) add(row, column, K(i, j));
                }
        }
    for (std::size_t r = 0; system.blocks && r < system.blocks->rows(); ++r)
        for (const NodeBlocks::Entry& e : system.blocks->entries(r)) {
            const std::uint32_t a = system.blocks->node(r), b = e.node;
            if (system.fixed[a] || system.fixed[b] || a < b) continue;
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) {
                    const Eigen::Index row = Eigen::Index(3 * a) + i, column = Eigen::Index(3 * b) + j;
                    if (row >= column) add(row, column, double(e.block(i, j)));
                }
        }
    for (std::size_t n = 0; n < elastic.nodeCount(); ++n) {
        const bool free = !system.fixed[n] && elastic.stiffness()[n] > 0;
        const double value =
            free ? elastic.mass()[n] * system.massFactor + (extra.empty() ? 0. : double(extra[n])) : 1.;
        for (Eigen::Index i = 0; i < 3; ++i) add(Eigen::Index(3 * n) + i, Eigen::Index(3 * n) + i, value);
    }
}

Eigen::SparseMatrix<double> assemble(const LinearSystem& system);

}  // namespace vdbfrac::solver
