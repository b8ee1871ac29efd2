#include "assembly.h"

#include <vector>

namespace vdbfrac::solver {

Eigen::SparseMatrix<double> assemble(const LinearSystem& system)
{
    std::vector<Eigen::Triplet<double>> entries;
    eachEntry(system, {}, [&](Eigen::Index row, Eigen::Index column, double value) {
        entries.emplace_back(int(row), int(column), value);
    });
    const Eigen::Index size = Eigen::Index(3 * system.elastic.nodeCount());
    Eigen::SparseMatrix<double> A(size, size);
    A.setFromTriplets(entries.begin(), entries.end());
    return A;
}

}  // namespace vdbfrac::solver
