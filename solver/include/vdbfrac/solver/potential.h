// Something that has an energy over a time step: what joins the solve besides inertia and elasticity.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/solver/elastic_operator.h>

#include <span>

namespace vdbfrac::solver {

/// What is known when a step begins.
struct StepStart {
    std::span<const Vec3> x;  ///< [m] at the start
    std::span<const Vec3> v;  ///< [m/s]
    double dt = 0;            ///< s
    const ElasticOperator& elastic;
};

/// U(x) with its gradient and a positive semidefinite approximation of its Hessian, each checked against the other
/// by finite differences in the tests. Forces that do not come from an energy of x alone (damping) use one that
/// holds for this step only.
class Potential {
public:
    virtual ~Potential() = default;
    virtual void begin(const StepStart&) {}
    /// Value [J]; adds the gradient [N].
    virtual double evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const = 0;
    /// out += H u. Constant over the step.
    virtual void addProduct(std::span<const Vec3> /*u*/, std::span<Vec3> /*out*/) const {}
    /// Adds the 3x3 diagonal blocks of H.
    virtual void addDiagonal(std::span<Mat3> /*blocks*/) const {}
};

}  // namespace vdbfrac::solver
