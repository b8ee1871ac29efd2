// A spring between two points of the material: the smallest potential that couples nodes.
#pragma once

#include <vdbfrac/solver/potential.h>
#include <vdbfrac/tetmesh/embedded_surface.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace vdbfrac::test {

/// U = k/2 (|p - q| - L)^2. Its Hessian is k n n^T along the spring and k (1 - L/|p - q|) across it, which is left out
/// where it is negative.
class Spring : public solver::Potential {
public:
    Spring(const tetmesh::EmbeddedPoint& p, const tetmesh::EmbeddedPoint& q, double stiffness, double length)
        : p_(p), q_(q), k_(stiffness), L_(length)
    {
    }

    double evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const override
    {
        const Vec3 d = p_.at(x) - q_.at(x);
        const double stretch = d.norm() - L_;
        const Vec3 force = d.norm() > 0 ? Vec3(k_ * stretch / d.norm() * d) : Vec3::Zero();
        for (std::size_t a = 0; a < 4; ++a) {
            gradient[p_.node[a]] += p_.weight[a] * force;
            gradient[q_.node[a]] -= q_.weight[a] * force;
        }
        return 0.5 * k_ * stretch * stretch;
    }

    void linearize(std::span<const Vec3> x, std::vector<solver::Coupling>& couplings) const override
    {
        const Vec3 d = p_.at(x) - q_.at(x);
        if (!(d.norm() > 0)) return;
        const Vec3 n = d.normalized();
        const Mat3 along = n * n.transpose();
        const Mat3 Q = k_ * (along + std::max(0., 1 - L_ / d.norm()) * (Mat3::Identity() - along));
        solver::Coupling c;
        for (std::size_t a = 0; a < 4; ++a) {
            c.node[a] = p_.node[a], c.weight[a] = float(p_.weight[a]);
            c.node[4 + a] = q_.node[a], c.weight[4 + a] = -float(q_.weight[a]);
        }
        c.Q = {float(Q(0, 0)), float(Q(1, 1)), float(Q(2, 2)), float(Q(1, 2)), float(Q(2, 0)), float(Q(0, 1))};
        couplings.push_back(c);
    }

    solver::EnergyFlow flow(const solver::Leg& leg) const override { return solver::storedFlow(*this, leg); }
    double energy(std::span<const Vec3> x) const
    {
        const double stretch = (p_.at(x) - q_.at(x)).norm() - L_;
        return 0.5 * k_ * stretch * stretch;
    }

protected:
    tetmesh::EmbeddedPoint p_, q_;

private:
    double k_, L_;  // N/m, m
};

}  // namespace vdbfrac::test
