#include "expected_errors.h"

#include "newtons_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <ranges>
#include <vector>

namespace vdbfrac::cli {

namespace {

/// The finest specimen that is no finer than a body; none if all are.
template <class Measured>
auto noFiner(const Measured& measured, double cells)
{
    const std::ranges::range_value_t<Measured>* found = nullptr;
    for (const auto& data : measured)
        if (data.cells <= cells && (!found || data.cells > found->cells)) found = &data;
    return found;
}

/// Bars of the body's lattice, and of its nu or the next larger one; none for elements that were not measured.
std::vector<BendingError> barsLike(const scene::Scene& scene, const scene::Body& body)
{
    const scene::Solver usual;
    if (scene.solver.cellDilation != usual.cellDilation || scene.solver.meanStrain != usual.meanStrain ||
        scene.solver.strain != usual.strain)
        return {};
    const double nu = scene.materialOf(body).poissonRatio;
    std::vector<BendingError> bars;
    for (const BendingError& bar : kBendingErrors) {
        if (bar.lattice != scene.grid.lattice || bar.nu < nu || (!bars.empty() && bar.nu > bars.front().nu)) continue;
        bars.push_back(bar);
    }
    return bars;
}

/// Plates and beams of the scene's lattice.
std::vector<TearingError> platesLike(const scene::Scene& scene)
{
    std::vector<TearingError> plates;
    std::ranges::copy_if(kTearingErrors, std::back_inserter(plates),
                         [&](const TearingError& plate) { return plate.lattice == scene.grid.lattice; });
    return plates;
}

/// How wide a body is where it is narrowest [m], at the most.
double leastWidth(const core::BodyEstimate& e)
{
    const Bounds bounds = e.bounds();
    const auto* solid = std::get_if<Primitive>(&e.body->shape);
    return std::min((bounds.upper - bounds.lower).minCoeff(), solid ? 2 * halfThickness(*solid) : INFINITY);
}

/// As tables of the scene have it: only under toughness alone G is what tears.
bool tearsAtToughness(const scene::Scene& scene, const scene::Body& body)
{
    const scene::Values* fracture = scene.table("fracture");
    if (!fracture || fracture->text("driver") != "tension" || fracture->number("average") <= 0) return false;
    const scene::Values& law = fracture->named("material", body.material);
    return law.has("toughness") && !law.has("strength");
}

/// Two digits that count, and never an exponent.
std::string percentText(double percent)
{
    return percent < 10 ? fmt::format("{:.2g}", percent) : fmt::format("{:.0f}", percent);
}

}  // namespace

std::string expectedErrors(const scene::Scene& scene, const core::SceneEstimate& estimate)
{
    constexpr double kRounding = 1.05;  // the outline may be as much narrower than the body
    const double h = scene.grid.voxelSize * scene.grid.coarsening;
    std::string text;
    for (const core::BodyEstimate& e : estimate.bodies) {
        const double cells = leastWidth(e) / h;
        text += fmt::format("expected error: body '{}' is {:.3g} lattice cells across{}", e.body->name, cells,
                            e.body->cut.empty() ? "" : " (less where parts are cut from it)");
        const std::vector<BendingError> bars = barsLike(scene, *e.body);
        const std::vector<TearingError> plates =
            tearsAtToughness(scene, *e.body) ? platesLike(scene) : std::vector<TearingError>();
        if (const BendingError* bending = noFiner(bars, kRounding * cells))
            text += fmt::format(
                "; in tests, bars of {:g} cells and a Poisson's ratio of {:g} were up to {} % off in bending "
                "stiffness, {} % in torsional",
                bending->cells, bending->nu, percentText(bending->bending), percentText(bending->torsion));
        else
            text += bars.empty() ? "; no bars like it were measured"
                                 : fmt::format("; bars of fewer than {:g} cells were not measured", bars.front().cells);
        if (const TearingError* tearing = noFiner(plates, kRounding * cells))
            text += fmt::format(
                "; notched plates and beams of {:g} cells tore within {} % of the theoretical load and {:.2g} "
                "degrees of the path",
                tearing->cells, percentText(tearing->load), tearing->slope);
        text += " (docs/newtons.md)\n";
    }
    return text;
}

}  // namespace vdbfrac::cli
