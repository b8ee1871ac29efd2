#include "assembly.h"

#include <vector>

namespace vdbfrac::solver {

Eigen::SparseMatrix<double> assemble(const LinearSystem& system, std::span<const float> extra)
{
    const ElasticOperator& elastic = system.elastic;
    const std::size_t nodes = elastic.nodeCount();
    std::vector<Eigen::Triplet<double>> entries;
    const auto add = [&](std::size_t row, std::size_t column, double value) {
        if (row >= column) entries.emplace_back(int(row), int(column), value);
    };
    std::size_t element = 0;
    for (const ElementSet& set : elastic.sets())
        for (const tetmesh::CellElement& e : set.elements) {
            const ElasticOperator::ElementMatrix K = elastic.elementMatrix(system.tangent, element++);
            for (std::size_t a = 0; a < 8; ++a)
                for (std::size_t b = 0; b < 8; ++b) {
                    const std::size_t na = set.firstNode + e.node[a], nb = set.firstNode + e.node[b];
                    if (na < nb || system.fixed[na] || system.fixed[nb]) continue;
                    for (std::size_t i = 0; i < 3; ++i)
                        for (std::size_t j = 0; j < 3; ++j)
                            add(3 * na + i, 3 * nb + j, K(Eigen::Index(3 * a + i), Eigen::Index(3 * b + j)));
                }
        }
    for (std::size_t n = 0; n < nodes; ++n) {
        const bool free = !system.fixed[n] && elastic.stiffness()[n] > 0;
        const double value = free ? elastic.mass()[n] * system.massFactor + (extra.empty() ? 0. : double(extra[n])) : 1.;
        for (std::size_t i = 0; i < 3; ++i) add(3 * n + i, 3 * n + i, value);
    }
    Eigen::SparseMatrix<double> A(Eigen::Index(3 * nodes), Eigen::Index(3 * nodes));
    A.setFromTriplets(entries.begin(), entries.end());
    return A;
}

}  // namespace vdbfrac::solver
