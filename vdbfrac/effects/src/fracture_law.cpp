#include "fracture_law.h"

#include "fracture_places.h"

#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/scene/review.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace vdbfrac::effects {

namespace {

using scene::Key;
using scene::Type;

constexpr const char* kMaterial = "material";

const Key kOfKappa = {
    "kappa", Type::number, "J/m^3", "Fracture resistance; a smooth bar tears at the strain sqrt(2 kappa / E).", "",
    0,       kInfinity,    true};
const Key kOfToughness = {
    "toughness", Type::number, "J/m^2", "Energy a crack takes per area, whatever the resolution; instead of kappa.", "",
    0,           kInfinity,    true};
const Key kOfStrength = {"strength", Type::number, "Pa", "Stress at which an uncracked bar tears; with toughness.", "",
                         0,          kInfinity,    true};

const Key kMaterialKeys[] = {
    {"name", Type::label, "", "Name of a [material.NAME] table.", scene::kRequired},
    kOfKappa,
    kOfToughness,
    kOfStrength,
};

/// What is wrong with how resistances go together, where `table` has them; "" for nothing.
std::string checkResistance(const scene::Values& v, const std::string& table)
{
    if (v.has("kappa") == v.has("toughness"))
        return table + " needs exactly one of kappa [J/m^3] and toughness [J/m^2]";
    if (v.has("strength") && !v.has("toughness")) return table + ".strength goes with toughness, not with kappa";
    return {};
}

void completeMaterial(scene::Review& material)
{
    material.requireMaterial(kMaterial);
    if (!material.isSound) return;
    if (std::string wrong = checkResistance(material.values, material.path()); !wrong.empty())
        material.complain("", {wrong});
}

const scene::TableSpec kMaterialSpec = {.name = "fracture.material",
                                        .doc = "What tears bodies of one material, in place of what all have.",
                                        .keys = kMaterialKeys,
                                        .complete = completeMaterial};

const Key kKeys[] = {
    kOfKappa,
    kOfToughness,
    kOfStrength,
    {.name = kMaterial,
     .member = Type::tables,
     .doc = "Materials with a resistance of their own, in place of these three.",
     .defaultText = scene::kOptional,
     .table = &kMaterialSpec},
    {"keys", Type::curve, "",
     "Factor on the resistance kappa over time; toughness scales with it, strength with its square root.", "", 0,
     kInfinity, true},
    {"driver",
     Type::choice,
     "",
     "Elastic energy that drives the crack: all of it, or only that of the tension that opens it.",
     "\"tension\"",
     -kInfinity,
     kInfinity,
     false,
     false,
     {"full", "tension"}},
    {"average", Type::number, "cells",
     "Radius over which that energy is averaged: with 3 cracks follow the load, not the lattice.", "3", 0, 8},
    {"nucleation",
     Type::choice,
     "",
     "Where cracks start: at the surface only, or inside too, with a hole as wide as the front.",
     "\"surface\"",
     -kInfinity,
     kInfinity,
     false,
     false,
     {"surface", "inside"}},
    {"front_speed", Type::number, "",
     "Speed that an overloaded front tends to, in Rayleigh wave speeds; it never exceeds 1.", "1", 0, kInfinity, true},
    {"front_width", Type::number, "voxels", "Width of the smoothed delta that spreads the update round the surface.",
     "1.25", 1, 1.5},
    {"relevel",
     Type::choice,
     "",
     "Finite differences by which phi is redistanced behind the front.",
     "\"weno5\"",
     -kInfinity,
     kInfinity,
     false,
     false,
     {"weno5", "first_order"}},
    {"relevel_every", Type::integer, "", "Updates of the front from one re-levelling to the next; 0: never.", "1", 0,
     1000},
    {"grip_margin", Type::number, "m", "Nothing tears nearer to a grip than this; default: two lattice cells.", "", 0},
};

/// kappa h / Gc without an average, for nodal energies on the six-tet lattice.
constexpr double kNodalFactor = 0.25;

/// A by the driver, the lattice and Poisson's ratio, as `vdbfrac calibrate` measures it (docs/calibration.md).
struct TipFactors {
    scene::LatticeKind lattice;
    bool isTension;
    std::array<double, 3> A;  // at kRatios
};
constexpr std::array<double, 3> kRatios = {0, .3, .45};
constexpr TipFactors kTipFactors[] = {
    {scene::LatticeKind::six, true, {.341, .373, .406}},      {scene::LatticeKind::five, true, {.318, .342, .379}},
    {scene::LatticeKind::delaunay, true, {.368, .422, .516}}, {scene::LatticeKind::six, false, {.336, .309, .272}},
    {scene::LatticeKind::five, false, {.325, .291, .266}},    {scene::LatticeKind::delaunay, false, {.304, .287, .271}},
};

std::string rough(double v) { return shortNumber(v, 3); }

}  // namespace

std::span<const Key> fractureTable()
{
    static const std::vector<Key> all = [] {
        std::vector<Key> keys(std::begin(kKeys), std::end(kKeys));
        const std::span<const Key> places = fracturePlaceKeys();
        keys.insert(keys.end(), places.begin(), places.end());
        return keys;
    }();
    return all;
}

std::string checkFracture(const scene::Values& v)
{
    if (std::string wrong = checkResistance(v, "fracture"); !wrong.empty()) return wrong;
    if (v.text("nucleation") == "inside" && (v.text("driver") != "tension" || v.number("average") <= 1))
        return "fracture.nucleation = \"inside\" goes with driver = \"tension\" and an average over more than a cell";
    return {};
}

FractureKeys fractureKeys(const scene::Values& values, const std::string& material)
{
    const scene::Values& own = values.named(kMaterial, material);
    const auto number = [&](const char* key) { return own.has(key) ? std::optional(own.number(key)) : std::nullopt; };
    return {number("kappa"), number("toughness"), number("strength"), values.number("average"),
            values.text("driver") == "tension"};
}

std::vector<std::string> unusedResistances(const scene::Values& values, const scene::Scene& scene)
{
    if (!values.has(kMaterial)) return {};
    std::vector<std::string> notes;
    const auto isOf = [](const std::string& name) { return [&](const scene::Body& b) { return b.material == name; }; };
    bool isUsed = false;
    for (const scene::Body& body : scene.bodies) isUsed = isUsed || &values.named(kMaterial, body.material) == &values;
    if (!isUsed)
        notes.push_back("what [fracture] gives for all tears no body: each has a fracture.material of its own");
    for (const scene::Values& own : values.tables(kMaterial))
        if (std::ranges::none_of(scene.bodies, isOf(own.text("name"))))
            notes.push_back("fracture.material '" + own.text("name") + "' tears no body: none is made of it");
    return notes;
}

double tipFactor(bool isTension, scene::LatticeKind lattice, double nu)
{
    const auto row = std::find_if(std::begin(kTipFactors), std::end(kTipFactors), [&](const TipFactors& f) {
        return f.lattice == lattice && f.isTension == isTension;
    });
    const double at = std::clamp(nu, kRatios.front(), kRatios.back());
    const std::size_t i = at < kRatios[1] ? 0 : 1;
    return std::lerp(row->A[i], row->A[i + 1], (at - kRatios[i]) / (kRatios[i + 1] - kRatios[i]));
}

FractureLaw fractureLaw(const FractureKeys& keys, const scene::Grid& grid, const std::string& body,
                        const solver::Material& material, std::vector<std::string>& notes)
{
    constexpr double kMaxRadius = 24;  // voxels; the cost of an average goes with the cube
    const double dx = grid.voxelSize, h = grid.coarsening * dx, E = material.youngsModulus();
    const double A = tipFactor(keys.isTension, grid.lattice, material.poissonRatio());
    FractureLaw law;
    law.radius = keys.average * h;
    if (law.radius <= dx) law.radius = 0;                                            // no other voxel is within it
    const double perToughness = law.radius > 0 ? A / law.radius : kNodalFactor / h;  // 1/m
    const auto note = [&](const std::string& text) { notes.push_back("body '" + body + "': " + text); };
    if (keys.kappa) {
        law.kappa = *keys.kappa;
        note("kappa = " + rough(law.kappa) + " J/m^3 is a toughness of " + rough(law.kappa / perToughness) +
             " J/m^2 on this lattice");
        return law;
    }
    const double Gc = *keys.toughness;
    FractureLaw tough = law;
    tough.kappa = perToughness * Gc;
    if (keys.isTension && law.radius > 0) tough.perRelease = perToughness;
    if (!keys.strength) {
        constexpr double kFarthest = 5;  // strain: no soft solid holds much more
        if (const double strain = std::sqrt(2 * tough.kappa / E); strain > kFarthest)
            note("with a toughness of " + rough(Gc) + " J/m^2 and no strength a smooth bar tears at " +
                 rough(1 + strain) + " times its length on voxels of " + rough(dx) +
                 " m, beyond any soft solid: check units, or give a strength");
        return tough;
    }
    const double strength = *keys.strength, radius = 2 * A * E * Gc / (strength * strength);
    if (strength >= E)
        note("a strength of " + rough(strength) + " Pa is " + rough(strength / E) +
             " times Young's modulus, more than any soft solid has: check units");
    const double narrowest = law.radius > 0 ? law.radius : std::max(2 * h, 8 * dx);  // a crack is up to two voxels wide
    if (radius < narrowest) {
        constexpr double kSmooth = 1.5;  // of kappa: what smooth faces hold on fine lattices (docs/physics.md)
        const double stress = std::sqrt(2 * E * tough.kappa);
        note("strength and toughness together need voxels of " + rough(dx * radius / narrowest) + " m or less; at " +
             rough(dx) + " m toughness is honoured, as without strength: a smooth bar tears at " + rough(stress) +
             (tough.perRelease > 0 ? " to " + rough(std::sqrt(kSmooth) * stress) : "") + " Pa");
        return tough;
    }
    law.kappa = strength * strength / (2 * E);
    law.radius = std::min(radius, kMaxRadius * dx);
    if (law.radius < radius)
        note("strength and toughness together average the energy over " + rough(radius) + " m, here over " +
             rough(law.radius) + " m: notches tear before toughness says so");
    return law;
}

}  // namespace vdbfrac::effects
