#include "plastic_law.h"

#include <vdbfrac/scene/review.h>

#include <cmath>

namespace vdbfrac::effects {

namespace {

using scene::Key;
using scene::Type;

constexpr const char* kMaterial = "material";

const Key kYieldStress = {
    "yield_stress",
    Type::number,
    "Pa",
    "Von Mises stress beyond which it flows; in a bar under tension, its force over its cross-section.",
    scene::kRequired,
    0};
Key hardening(const char* defaultText)
{
    return {
        "hardening", Type::number, "Pa", "Increase of the yield stress per unit of plastic strain.", defaultText, 0};
}
Key relaxation(const char* defaultText)
{
    return {"relaxation", Type::number,
            "s",          "Time in which stress beyond the yield stress decays to 1/e; 0: at once.",
            defaultText,  0};
}

const Key kMaterialKeys[] = {
    {"name", Type::label, "", "Name of a [material.NAME] table.", scene::kRequired},
    kYieldStress,
    hardening(scene::kOptional),
    relaxation(scene::kOptional),
};

/// What is wrong with how keys go together; "" for nothing. `of`: where those are that are left out.
std::string checkFlow(const scene::Values& v, const scene::Values& of, const std::string& table)
{
    const double time = (v.has("relaxation") ? v : of).number("relaxation");
    return v.number("yield_stress") == 0 && time == 0
               ? table + ".yield_stress = 0 needs a relaxation: what yields at once, under any load, has no shape"
               : std::string();
}

void completeMaterial(scene::Review& material)
{
    material.requireMaterial(kMaterial);
    if (!material.isSound) return;
    if (std::string wrong = checkFlow(material.values, material.parent(), material.path()); !wrong.empty())
        material.complain("", {wrong});
}

const scene::TableSpec kMaterialSpec = {.name = "plasticity.material",
                                        .doc = "How bodies of one material flow, in place of how all do.",
                                        .keys = kMaterialKeys,
                                        .complete = completeMaterial};

const Key kKeys[] = {
    kYieldStress,
    hardening("0"),
    relaxation("0"),
    {"max_stretch", Type::number, "",
     "Largest plastic stretch: a bar flows to at most this many times its length, and is elastic from there on.", "4",
     1.01, 100},
    {"fracture_share", Type::number, "",
     "Fraction of the plastic work done in tension that drives cracks, in addition to the elastic energy, while it is "
     "pulled.",
     "0.1", 0, 1},
    {.name = kMaterial,
     .member = Type::tables,
     .doc = "Materials that flow differently; keys they leave out are as above.",
     .defaultText = scene::kOptional,
     .table = &kMaterialSpec},
};

}  // namespace

std::span<const Key> plasticityTable() { return kKeys; }

std::string checkPlasticity(const scene::Values& values) { return checkFlow(values, values, "plasticity"); }

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
    const auto number = [&](const char* key) { return (own.has(key) ? own : values).number(key); };
    return {number("yield_stress"),
            number("hardening"),
            number("relaxation"),
            values.number("max_stretch"),
            values.number("fracture_share"),
            material.mu,
            material.lambda + 2. / 3 * material.mu};
}

}  // namespace vdbfrac::effects
