#include "shortest_mean.h"

#include <Eigen/Dense>

#include <cassert>
#include <vector>

namespace vdbfrac::solver {

namespace {

/// Weights, of any sign, with sum 1 that make w.G w least where only those of the subset are not 0.
Eigen::VectorXd minOfSubset(const Eigen::MatrixXd& G, unsigned subset)
{
    std::vector<int> in;
    for (int i = 0; i < G.rows(); ++i)
        if (subset >> i & 1) in.push_back(i);
    Eigen::MatrixXd own = G(in, in);
    own.array() += own.diagonal().maxCoeff();  // changes w.G w by a constant, and no mean of 0 makes it singular
    const Eigen::VectorXd y =
        own.completeOrthogonalDecomposition().solve(Eigen::VectorXd::Ones(Eigen::Index(in.size())));
    Eigen::VectorXd w = Eigen::VectorXd::Zero(G.rows());
    for (std::size_t i = 0; i < in.size(); ++i) w[in[i]] = y[Eigen::Index(i)] / y.sum();
    return w;
}

}  // namespace

Eigen::VectorXd shortestMean(const Eigen::MatrixXd& G)
{
    assert(G.rows() >= 1 && G.rows() <= kMaxMeans);
    Eigen::VectorXd best = Eigen::VectorXd::Unit(G.rows(), 0);
    for (unsigned subset = 1; subset < 1u << G.rows(); ++subset) {
        const Eigen::VectorXd w = minOfSubset(G, subset);
        if (w.minCoeff() >= 0 && w.dot(G * w) < best.dot(G * best)) best = w;  // false where it is not a number
    }
    return best;
}

}  // namespace vdbfrac::solver
