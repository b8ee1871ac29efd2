#include "solver_settings.h"

#include <map>
#include <string>

namespace vdbfrac::core {

namespace {

/// The scene has checked the names.
template <class T>
using Names = std::map<std::string, T>;

}  // namespace

solver::NewtonSettings newtonSettingsOf(const scene::Solver& s)
{
    using enum solver::NewtonTangent;
    static const Names<solver::LinearMethod> methods = {{"auto", solver::LinearMethod::automatic},
                                                        {"jacobi", solver::LinearMethod::jacobi},
                                                        {"multigrid", solver::LinearMethod::multigrid},
                                                        {"direct", solver::LinearMethod::direct}};
    static const Names<solver::NewtonTangent> tangents = {
        {"exact", exact}, {"projected", projected}, {"warped", warped}};
    return {s.newtonTolerance,
            s.newtonIterations,
            s.linearTolerance,
            s.linearIterations,
            methods.at(s.linearSolver),
            s.precision == "double" ? solver::LinearPrecision::doubles : solver::LinearPrecision::mixed,
            tangents.at(s.tangent)};
}

solver::Scheme schemeOf(const scene::Solver& s)
{
    using enum solver::Scheme;
    static const Names<solver::Scheme> schemes = {
        {"backward_euler", backwardEuler},     {"midpoint", midpoint},          {"sdirk2", sdirk2},
        {"symplectic_euler", symplecticEuler}, {"forward_euler", forwardEuler}, {"static", statics}};
    return schemes.at(s.integrator);
}

solver::Elasticity elasticityOf(const scene::Solver& s)
{
    using enum solver::Strain;
    static const Names<solver::Strain> strains = {{"corotational", corotational}, {"linear", linear}, {"green", green}};
    return {s.cellDilation ? solver::Volumetric::cell : solver::Volumetric::none, strains.at(s.strain)};
}

}  // namespace vdbfrac::core
