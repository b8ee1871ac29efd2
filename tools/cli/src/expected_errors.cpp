#include "expected_errors.h"

#include "newtons_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <ranges>

namespace vdbfrac::cli {

namespace {

/// The finest specimen that is no finer than a body; none if all are.
template <class Measured, class Data = std::ranges::range_value_t<Measured>>
const Data* noFiner(const Measured& measured, double cells)
{
    const Data* found = nullptr;
    for (const Data& data : measured)
        if (data.cells <= cells) found = &data;
    return found;
}

/// As a table of the scene has it: only under toughness alone G is what tears.
bool tearsAtToughness(const scene::Scene& scene)
{
    const auto table = std::find_if(scene.tables.begin(), scene.tables.end(),
                                    [](const scene::NamedValues& t) { return t.name == "fracture"; });
    return table != scene.tables.end() && table->values.has("toughness") && !table->values.has("strength") &&
           table->values.text("driver") == "tension" && table->values.number("average") > 0;
}

}  // namespace

std::string expectedErrors(const scene::Scene& scene, const core::SceneEstimate& estimate)
{
    constexpr double kRounding = 1.05;  // the outline may be as much narrower than the body
    const double h = scene.grid.voxelSize * scene.grid.coarsening;
    std::string text;
    for (const core::BodyEstimate& e : estimate.bodies) {
        const Bounds bounds = e.bounds();
        const double cells = (bounds.upper - bounds.lower).minCoeff() / h;
        text += fmt::format("expected: body '{}' is {:.3g} lattice cells across", e.body->name, cells);
        if (const auto* bending = noFiner(kBendingErrors, kRounding * cells))
            text += fmt::format("; bars of {:g} were off by up to {:.2g} % in bending, {:.2g} % in torsion",
                                bending->cells, bending->bending, bending->torsion);
        else
            text += fmt::format("; less than {:g} were not measured", kBendingErrors[0].cells);
        const auto* tearing = tearsAtToughness(scene) ? noFiner(kTearingErrors, kRounding * cells) : nullptr;
        if (tearing)
            text += fmt::format(
                "; notched plates and beams of {:g} tore within {:.2g} % of the load, {:.2g} degrees of the way",
                tearing->cells, tearing->load, tearing->slope);
        text += " (docs/newtons.md)\n";
    }
    return text;
}

}  // namespace vdbfrac::cli
