#include "solver_settings.h"

namespace vdbfrac::core {

namespace {

solver::LinearMethod methodOf(scene::LinearSolver linear)
{
    switch (linear) {
    case scene::LinearSolver::automatic: return solver::LinearMethod::automatic;
    case scene::LinearSolver::jacobi: return solver::LinearMethod::jacobi;
    case scene::LinearSolver::multigrid: return solver::LinearMethod::multigrid;
    case scene::LinearSolver::direct: return solver::LinearMethod::direct;
    }
    return {};
}

solver::LinearPrecision precisionOf(scene::Precision precision)
{
    return precision == scene::Precision::doubles ? solver::LinearPrecision::doubles : solver::LinearPrecision::mixed;
}

solver::NewtonTangent tangentOf(scene::Tangent tangent)
{
    switch (tangent) {
    case scene::Tangent::exact: return solver::NewtonTangent::exact;
    case scene::Tangent::projected: return solver::NewtonTangent::projected;
    case scene::Tangent::warped: return solver::NewtonTangent::warped;
    }
    return {};
}

solver::Strain strainOf(scene::Strain strain)
{
    switch (strain) {
    case scene::Strain::corotational: return solver::Strain::corotational;
    case scene::Strain::linear: return solver::Strain::linear;
    case scene::Strain::green: return solver::Strain::green;
    }
    return {};
}

}  // namespace

solver::NewtonSettings newtonSettingsOf(const scene::Solver& s)
{
    return {s.newtonTolerance,        s.newtonIterations,       s.linearTolerance,   s.linearIterations,
            methodOf(s.linearSolver), precisionOf(s.precision), tangentOf(s.tangent)};
}

solver::Scheme schemeOf(const scene::Solver& s)
{
    switch (s.integrator) {
    case scene::Integrator::backwardEuler: return solver::Scheme::backwardEuler;
    case scene::Integrator::midpoint: return solver::Scheme::midpoint;
    case scene::Integrator::sdirk2: return solver::Scheme::sdirk2;
    case scene::Integrator::symplecticEuler: return solver::Scheme::symplecticEuler;
    case scene::Integrator::forwardEuler: return solver::Scheme::forwardEuler;
    case scene::Integrator::statics: return solver::Scheme::statics;
    }
    return {};
}

solver::Elasticity elasticityOf(const scene::Solver& s)
{
    return {s.cellDilation ? solver::Volumetric::cell : solver::Volumetric::none, strainOf(s.strain), s.meanStrain};
}

}  // namespace vdbfrac::core
