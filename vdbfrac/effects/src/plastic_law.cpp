#include "plastic_law.h"

#include <vdbfrac/scene/review.h>

#include <cmath>

namespace vdbfrac::effects {

namespace {

using scene::Key;
using scene::Type;

constexpr const char* kMaterial = "material";

const Key kYieldStress = {"yield_stress",
                          Type::number,
                          "Pa",
                          "von Mises stress beyond which it flows: in a bar, its pull over its section",
                          scene::kRequired,
                          0};
const Key kHardening = {
    "hardening", Type::number, "Pa", "what the yield stress gains with a plastic strain of 1", "0", 0};
const Key kRelaxation = {"relaxation", Type::number,
                         "s",          "time in which the stress beyond the yield falls to 1/e of it; 0: at once",
                         "0",          0};

const Key kMaterialKeys[] = {
    {"name", Type::label, "", "name of a [material.NAME] table", scene::kRequired},
    kYieldStress,
    kHardening,
    kRelaxation,
};

void completeMaterial(scene::Review& material)
{
    std::vector<std::string> names;
    for (const scene::Material& m : material.scene().materials) names.push_back(m.name);
    material.requireOneOf("name", names);
    material.requireNewName(material.parent().tables(kMaterial));
}

const scene::TableSpec kMaterialSpec = {.name = "plasticity.material",
                                        .doc = "How bodies of one material flow, in place of how all do.",
                                        .keys = kMaterialKeys,
                                        .complete = completeMaterial};

const Key kKeys[] = {
    kYieldStress,
    kHardening,
    kRelaxation,
    {"max_stretch", Type::number, "", "times its length that a bar can flow to; from there on it is elastic", "4", 1.01,
     100},
    {"fracture_share", Type::number, "",
     "part of the work of tension on what flows that drives cracks beside the elastic energy, while it is pulled",
     "0.1", 0, 1},
    {.name = kMaterial,
     .member = Type::tables,
     .doc = "materials that flow otherwise, in place of the first three",
     .defaultText = scene::kOptional,
     .table = &kMaterialSpec},
};

}  // namespace

std::span<const Key> plasticityTable() { return kKeys; }

double PlasticLaw::yieldStrain(double a) const { return std::sqrt(2. / 3) * (yieldStress + hardening * a) / (2 * mu); }

double PlasticLaw::energyAtYield(double a) const
{
    const double stress = yieldStress + hardening * a, E = 9 * K * mu / (3 * K + mu);
    return stress * stress / (2 * E);
}

double PlasticLaw::share(double dt) const
{
    const double relaxed = relaxation > 0 ? -std::expm1(-dt / relaxation) : 1;
    return relaxed / (1 + hardening / (3 * mu));
}

PlasticLaw plasticLaw(const scene::Values& values, const std::string& name, const solver::Material& material)
{
    const scene::Values& own = values.named(kMaterial, name);
    return {own.number("yield_stress"),
            own.number("hardening"),
            own.number("relaxation"),
            values.number("max_stretch"),
            values.number("fracture_share"),
            material.mu,
            material.lambda + 2. / 3 * material.mu};
}

}  // namespace vdbfrac::effects
