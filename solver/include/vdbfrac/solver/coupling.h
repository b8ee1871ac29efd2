// What couples nodes beyond the elements: contact, springs, attachments, colliders.
//
// A coupling is a share of the Hessian of a potential, H(i, j) = weight_i weight_j Q: the second derivative of
// q(sum weight_i x_i), exact where q is quadratic. Points in the material are sums over the nodes of their tets, so a
// coupling of two points has the weights of one and, with the other sign, those of the other.
#pragma once

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/base/vec.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::solver {

/// A symmetric 3x3 block: xx, yy, zz, yz, zx, xy.
using SymmetricBlock = std::array<float, 6>;

template <class V>
V multiply(const SymmetricBlock& Q, const V& u)
{
    using Real = typename V::Scalar;
    const Real xx(Q[0]), yy(Q[1]), zz(Q[2]), yz(Q[3]), zx(Q[4]), xy(Q[5]);
    return V(xx * u[0] + xy * u[1] + zx * u[2], xy * u[0] + yy * u[1] + yz * u[2], zx * u[0] + yz * u[1] + zz * u[2]);
}

/// The same of any 3x3 block, its terms in the same order.
template <class V>
V multiply(const Eigen::Matrix3f& m, const V& u)
{
    using Real = typename V::Scalar;
    const auto row = [&](int i) { return Real(m(i, 0)) * u[0] + Real(m(i, 1)) * u[1] + Real(m(i, 2)) * u[2]; };
    return V(row(0), row(1), row(2));
}

struct Coupling {
    static constexpr std::size_t kNodes = 8;
    std::array<std::uint32_t, kNodes> node{};  ///< of the system, each once; those of weight 0 do not count
    std::array<float, kNodes> weight{};
    SymmetricBlock Q{};  ///< positive semidefinite [N/m]

    double trace() const { return double(Q[0]) + double(Q[1]) + double(Q[2]); }
    /// Does it hold the nodes against something that is none of them? Forces of others add up to 0.
    bool isExternal() const;
};

/// A share H(i, j) = g_i g_j^T: the curvature of an energy of one number, the root of its second derivative times the
/// gradient of that number. For numbers of an element, as its volume: its nodes are of one part, and sum g_i is 0.
struct ScalarCoupling {
    static constexpr std::size_t kNodes = Coupling::kNodes;
    std::array<std::uint32_t, kNodes> node{};      ///< of the system; those with g 0 do not count
    std::array<Eigen::Vector3f, kNodes> gradient;  ///< (N/m)^(1/2)
};

/// Both kinds.
struct CouplingsOf {
    std::span<const Coupling> points;
    std::span<const ScalarCoupling> scalars = {};

    std::size_t size() const { return points.size() + scalars.size(); }
    bool empty() const { return size() == 0; }
};

/// Largest angular frequency [1/s] that couplings alone give to lumped masses [kg], or more (Gershgorin).
double highestFrequency(const CouplingsOf& couplings, std::span<const double> mass);

/// The sum of couplings as a sparse symmetric matrix of 3x3 blocks, with rows for the nodes that they couple. It does
/// not depend on the number of threads.
class NodeBlocks {
public:
    NodeBlocks() = default;
    /// `nodes`: of the system.
    NodeBlocks(const CouplingsOf& couplings, std::size_t nodes);

    /// Nodes of a coarser system from which each node takes its value, half from each; those that are none count as
    /// `coarseNodes` or more.
    using Parents = std::span<const std::array<std::uint32_t, 2>>;
    /// P^T H P, P being the interpolation by `parents`, over nodes that are not fixed.
    NodeBlocks restricted(Parents parents, std::span<const std::uint8_t> fixed, std::size_t coarseNodes) const;

    bool empty() const { return row_.empty(); }
    std::size_t rows() const { return row_.size(); }
    std::uint32_t node(std::size_t row) const { return row_[row]; }  ///< rising
    /// The first row of a node from this one on, or rows().
    std::size_t rowFrom(std::size_t node) const
    {
        return std::size_t(std::ranges::lower_bound(row_, node) - row_.begin());
    }
    struct Entry {
        std::uint32_t node;     ///< column; rising within a row
        Eigen::Matrix3f block;  ///< symmetric on the diagonal
    };
    std::span<const Entry> entries(std::size_t row) const
    {
        return {entry_.data() + start_[row], entry_.data() + start_[row + 1]};
    }
    SymmetricBlock diagonal(std::size_t row) const;
    /// What stands for a row in a block-Jacobi iteration: its diagonal block and a quarter of the size of the others. A
    /// node in a coupling of eight moves with the seven others; with its own block alone the largest eigenvalue is 4
    /// where the elements have 1.8, so they are damped less, with all of the others stiff modes are slow.
    SymmetricBlock damping(std::size_t row) const;

    /// Calls add(node, (H u) of the node) for its rows, in parallel; returns u.H u.
    template <class V, class Add>
    double multiply(std::span<const V> u, const Add& add) const;

    std::size_t bytes() const;

private:
    template <class Emit>
    void assemble(std::vector<std::uint32_t> rows, const Emit& emit);

    std::vector<std::uint32_t> row_;
    std::vector<std::size_t> start_;  // of each row in entry_, and the end
    std::vector<Entry> entry_;
};

template <class V, class Add>
double NodeBlocks::multiply(std::span<const V> u, const Add& add) const
{
    constexpr std::size_t kRowChunk = 256;
    return orderedSum(row_.size(), kRowChunk, [&](std::size_t begin, std::size_t end) {
        double energy = 0;
        for (std::size_t r = begin; r < end; ++r) {
            V sum = V::Zero();
            for (const Entry& e : entries(r)) sum += solver::multiply(e.block, u[e.node]);
            add(row_[r], sum);
            energy += double(u[row_[r]].dot(sum));
        }
        return energy;
    });
}

}  // namespace vdbfrac::solver
