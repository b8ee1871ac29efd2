// Ductile fracture by a level set: the surface eats into material whose elastic energy exceeds its fracture resistance.
//
// Hegemann et al. 2013, section 5. Psi nodal energy over material parts; kappa fracture resistance [J/m^3]; Gc
// toughness [J/m^2]; sigma_t tensile strength [Pa]; h lattice spacing; C discretisation factor; l averaging radius:
//   kappa                  as given: strength of a smooth bar sqrt(2 E kappa), cracked samples weaken as h shrinks
//   toughness              kappa = C Gc / h: at a crack tip the energy spent per area is then Gc at any h
//   toughness + strength   kappa = sigma_t^2 / (2 E), Psi averaged over l = 2 A E Gc / sigma_t^2
// Keys scale kappa over time, and so Gc alike and sigma_t by the root: l stays.
#include "all.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/grid/griffith.h>
#include <vdbfrac/grid/transfer.h>
#include <vdbfrac/solver/corotational.h>
#include <vdbfrac/solver/element.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

namespace vdbfrac::effects {

namespace {

using scene::Key;
using scene::Type;
using scene::Values;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// C for nodal energies on the six-tet lattice, from pulled strips and notched plates (docs/physics.md).
constexpr double kTipFactor = 0.25;
/// A: ratio of averaging radius to E Gc / sigma_t^2, halved.
constexpr double kAverageFactor = 0.235;
/// phi moves by no more than this part of a voxel before it is re-levelled.
constexpr double kMaxMove = 0.5;

const Key kKeys[] = {
    {"kappa", Type::number, "J/m^3", "fracture resistance; a smooth bar tears at the strain sqrt(2 kappa / E)", "", 0,
     kInfinity, true},
    {"toughness", Type::number, "J/m^2", "energy a crack takes per area, at any resolution; instead of kappa", "", 0,
     kInfinity, true},
    {"strength", Type::number, "Pa", "stress at which an uncracked bar tears; with toughness", "", 0, kInfinity, true},
    {"keys", Type::curve, "",
     "factor on the resistance kappa over time; toughness goes with it, strength with its root", "", 0, kInfinity,
     true},
    {"driver",
     Type::choice,
     "",
     "energy that drives the crack: all of it, or only what pulls",
     "\"full\"",
     -kInfinity,
     kInfinity,
     false,
     false,
     {"full", "tension"}},
    {"front_speed", Type::number, "",
     "speed of the front at twice the resistance, in Rayleigh wave speeds; the front never passes 1", "1", 0, kInfinity,
     true},
    {"front_width", Type::number, "voxels", "width of the smoothed delta that spreads the update round the surface",
     "1.25", 1, 1.5},
    {"relevel",
     Type::choice,
     "",
     "differences with which phi is made a distance again behind the front",
     "\"weno5\"",
     -kInfinity,
     kInfinity,
     false,
     false,
     {"weno5", "first_order"}},
    {"relevel_every", Type::integer, "", "updates of the front from one re-levelling to the next; 0: never", "1", 0,
     1000},
    {"grip_margin", Type::number, "m", "no fracture nearer to a grip than this; left out: two lattice cells", "", 0},
};

std::string check(const Values& v)
{
    if (v.has("kappa") == v.has("toughness")) return "fracture needs exactly one of kappa and toughness";
    if (v.has("strength") && !v.has("toughness")) return "fracture.strength goes with toughness, not with kappa";
    return {};
}

/// What tears one body.
struct Law {
    double kappa = 0;      // J/m^3
    double radius = 0;     // m, of the average; 0: nodal energies as they are
    double waveSpeed = 0;  // m/s, Rayleigh
};

class Fracture : public core::Effect,
                 public core::GridStage,
                 public core::StepLimit,
                 public core::FrameSource,
                 public core::Persistent {
public:
    Fracture(const Values& values, const scene::Scene& scene)
        : values_(values),
          dx_(scene.grid.voxelSize),
          h_(scene.grid.coarsening * dx_),
          frontCfl_(scene.time.frontCfl),
          resistance_(values.has("keys") ? values.curve("keys") : scene::Curve()),
          margin_(values.has("grip_margin") ? values.number("grip_margin") : 2 * h_)
    {
    }

    std::string name() const override { return "fracture"; }
    void join(core::Stages& stages) override
    {
        stages.grid.push_back(this);
        stages.limits.push_back(this);
        stages.frames.push_back(this);
        stages.persistent.push_back(this);
    }

    void start(std::span<const core::Body> bodies, std::vector<std::string>& notes) override
    {
        for (const core::Body& body : bodies) laws_[body.name] = lawOf(body, notes);
    }

    double largestStep() const override { return limit_; }
    grid::PhiChanges update(const core::GridContext& context, const core::Body& body, grid::LevelSet& phi) override;

    std::vector<Field> fields() const override { return {{"arrival", "s"}}; }
    core::FrameGrid take(const core::Body& body, const std::string&) const override { return arrivals(body); }
    grid::VoxelValues arrivals(const core::Body& body) const
    {
        grid::VoxelValues values;
        values.background = -1;
        if (const auto it = arrival_.find(body.name); it != arrival_.end())
            for (const auto& [voxel, time] : it->second) {
                values.coords.push_back(voxel);
                values.scalars.push_back(time);
            }
        return values;
    }

    void save(std::span<const core::Body> bodies, core::Archive& archive) const override;
    void restoreFrom(const core::Archive& archive, std::span<const core::Body> bodies) override;

private:
    Law lawOf(const core::Body& body, std::vector<std::string>& notes) const;
    std::vector<VoxelPhi> candidates(const core::GridContext& context, const core::Body& body, const Law& law) const;
    std::vector<double> energies(const core::GridContext& context, const core::Body& body, const Law& law,
                                 const std::vector<VoxelPhi>& band) const;
    void noteArrivals(const core::Body& body, const grid::PhiChanges& changes, double time);
    grid::Relevelling relevelling(long long update) const;

    Values values_;
    double dx_, h_, frontCfl_;
    scene::Curve resistance_;  // factor on kappa
    double margin_;
    std::map<std::string, Law> laws_;                        // by body
    std::map<std::string, std::map<Coord, float>> arrival_;  // by body: time [s] at which a voxel node failed
    double limit_ = kInfinity;                               // s
    double limitTime_ = -1;                                  // step to which limit_ belongs
    std::map<std::string, long long> updates_;               // by body: times the front was moved
};

Law Fracture::lawOf(const core::Body& body, std::vector<std::string>& notes) const
{
    const solver::Material& m = body.material;
    const double E = m.youngsModulus();
    Law law;
    law.waveSpeed = grid::rayleighSpeed(m.mu, m.poissonRatio(), m.rho);
    if (values_.has("kappa")) {
        law.kappa = values_.number("kappa");
        return law;
    }
    const double Gc = values_.number("toughness");
    law.kappa = kTipFactor * Gc / h_;
    if (!values_.has("strength")) return law;
    const double strength = values_.number("strength"), radius = 2 * kAverageFactor * E * Gc / (strength * strength);
    const bool resolved = h_ <= radius / 2 && 2 * dx_ <= radius / 4;  // a crack is up to two voxels wide
    const auto rough = [](double v) { return shortNumber(v, 3); };
    if (resolved) {
        constexpr double kWidest = 24;  // voxels; the cost of an average goes with the cube
        law.kappa = strength * strength / (2 * E);
        law.radius = std::min(radius, kWidest * dx_);
        if (law.radius == radius) return law;
        notes.push_back("body '" + body.name + "': strength and toughness together average the energy over " +
                        rough(radius) + " m, here over " + rough(law.radius) +
                        " m: notches tear before toughness says so");
        return law;
    }
    notes.push_back("body '" + body.name + "': strength and toughness together need voxels of " +
                    rough(std::min(radius / 8, radius * dx_ / (2 * h_))) + " m or less; at " + rough(dx_) +
                    " m toughness is honoured, a smooth bar tears at " + rough(std::sqrt(2 * E * law.kappa)) + " Pa");
    return law;
}

/// Material voxels of the band that may move: some tet near by exceeds the resistance, and no grip is close.
std::vector<VoxelPhi> Fracture::candidates(const core::GridContext& context, const core::Body& body,
                                           const Law& law) const
{
    const std::span<const double> own = context.tetEnergy().subspan(tetmesh::tetEntry(body.firstElement, 0),
                                                                    tetmesh::tetEntry(body.mesh->elements().size(), 0));
    std::vector<Coord> voxels = body.mesh->voxelsAbove(own, law.kappa);
    if (law.radius > 0) voxels = grid::voxelsAround(voxels, int(std::floor(law.radius / dx_)));
    std::erase_if(voxels, [&](const Coord& c) { return context.gripDistance(body, dx_ * c.toVec()) < margin_; });
    // Material only: raising phi in the gap would eat into the faces behind the tip, and a crack be twice as wide.
    std::erase_if(voxels, [&](const Coord& c) { return body.mesh->phi()(c) >= 0; });
    return grid::sampleBand(body.phi, voxels);
}

std::vector<double> Fracture::energies(const core::GridContext& context, const core::Body& body, const Law& law,
                                       const std::vector<VoxelPhi>& band) const
{
    const std::span<const double> all = context.tetEnergy();
    const auto full = [&](std::uint32_t e, int t) {
        return all[tetmesh::tetEntry(body.firstElement + e, std::size_t(t))];
    };
    const std::span<const Vec3> x = context.x.subspan(body.firstNode);
    const auto tension = [&](std::uint32_t e, int t) {
        const tetmesh::TetGradients* const own = body.mesh->gradients().empty() ? nullptr : &body.mesh->gradients()[e];
        const Mat3 F = solver::deformationGradient({body.mesh->elements()[e], own, h_}, std::size_t(t), x);
        return solver::tensilePart(full(e, t), F, body.material);
    };
    const grid::TetEnergy energy =
        values_.text("driver") == "tension" ? grid::TetEnergy(tension) : grid::TetEnergy(full);
    std::vector<Coord> voxels;
    for (const VoxelPhi& b : band) voxels.push_back(b.voxel);
    return law.radius > 0 ? grid::averagedEnergy(*body.mesh, energy, voxels, law.radius)
                          : grid::nodalEnergy(*body.mesh, energy, voxels);
}

void Fracture::noteArrivals(const core::Body& body, const grid::PhiChanges& changes, double time)
{
    auto& arrival = arrival_[body.name];
    for (const auto& [voxel, value] : changes)
        // The mesh still has the old phi.
        if (value >= 0 && body.mesh->phi()(voxel) < 0) arrival.emplace(voxel, float(time));
}

grid::Relevelling Fracture::relevelling(long long update) const
{
    const long long every = values_.integer("relevel_every");
    grid::Relevelling how;
    how.firstOrder = values_.text("relevel") == "first_order";
    if (every == 0 || update % every != 0) how.sweeps = 0;
    return how;
}

grid::PhiChanges Fracture::update(const core::GridContext& context, const core::Body& body, grid::LevelSet& phi)
{
    Law law = laws_.at(body.name);
    law.kappa *= resistance_.at(context.time);
    (void)context.tetEnergy();  // timed on its own
    if (limitTime_ != context.time) limit_ = kInfinity, limitTime_ = context.time;

    std::vector<VoxelPhi> band;
    std::vector<double> psi;
    {
        const StageTimer timer(context.ledger, "fracture");
        band = candidates(context, body, law);
        psi = energies(context, body, law, band);
        context.ledger.count("fracture", "voxels", std::int64_t(band.size()));
    }
    const double eps = values_.number("front_width") * dx_;
    // Mobility: at Psi = 2 kappa the front (phi = 0) moves at front_speed * c_R.
    const double mobility = values_.number("front_speed") * law.waveSpeed * std::numbers::pi * eps / law.kappa;
    const double possible = law.waveSpeed * context.dt, most = std::min(possible, frontCfl_ * dx_);
    const int parts = std::max(1, int(std::ceil(most / (kMaxMove * dx_) - 1e-9)));
    grid::GriffithStep step{law.kappa, eps, 0, most / parts};

    grid::PhiChanges all;
    bool heldBack = false;
    for (int part = 0; part < parts; ++part) {
        grid::PhiChanges raised;
        // One pseudo-time step for all voxels, as long as the fastest allows (CFL): clipping each on its own would let
        // the flanks of a crack catch up with its tip.
        const double wanted = step.s = mobility * context.dt / parts;
        for (std::size_t i = 0; i < band.size(); ++i)
            step.s = std::min(step.s, griffithTime(band[i].phi, psi[i], step.maxMove, step));
        for (std::size_t i = 0; i < band.size(); ++i) {
            const double phi = griffithUpdate(band[i].phi, psi[i], step);
            if (float(phi) > band[i].phi) raised.emplace_back(band[i].voxel, band[i].phi = float(phi));
        }
        if (raised.empty()) break;
        heldBack = heldBack || (most < possible && step.s < wanted);
        limit_ = std::min(limit_, frontCfl_ * dx_ / law.waveSpeed);
        const StageTimer timer(context.ledger, "relevel");
        grid::RelevelWork work;
        const grid::PhiChanges changes = grid::raiseAndRelevel(phi, raised, work, relevelling(++updates_[body.name]));
        context.ledger.count("fracture", "moved_voxels", std::int64_t(raised.size()));
        context.ledger.count("relevel", "leaves", work.leaves);
        context.ledger.count("relevel", "voxels", work.voxels);
        all.insert(all.end(), changes.begin(), changes.end());
    }
    context.ledger.count("fracture", "held_back", heldBack);
    noteArrivals(body, all, context.time);
    return all;
}

void Fracture::save(std::span<const core::Body> bodies, core::Archive& archive) const
{
    archive.put("fracture.limit", std::vector<double>{limit_, limitTime_});
    for (const core::Body& body : bodies) {
        const std::string name = "fracture." + body.name;
        const grid::VoxelValues arrival = arrivals(body);
        archive.put(name + ".arrival.voxels", arrival.coords);
        archive.put(name + ".arrival.times", arrival.scalars);
        const auto updates = updates_.find(body.name);
        archive.putOne<std::int64_t>(name + ".updates", updates == updates_.end() ? 0 : updates->second);
    }
}

void Fracture::restoreFrom(const core::Archive& archive, std::span<const core::Body> bodies)
{
    const std::vector<double> limit = archive.get<double>("fracture.limit", 2);
    if (!(limit[0] > 0)) archive.complain("the fracture's time step is not positive");
    limit_ = limit[0], limitTime_ = limit[1];
    for (const core::Body& body : bodies) {
        const std::string name = "fracture." + body.name;
        const auto voxels = archive.get<Coord>(name + ".arrival.voxels");
        const auto times = archive.get<float>(name + ".arrival.times", voxels.size());
        auto& arrival = arrival_[body.name];
        for (std::size_t i = 0; i < voxels.size(); ++i) {
            if (!body.mesh->phi().contains(voxels[i]) || !std::isfinite(times[i]))
                archive.complain("it lists a failed voxel outside body '" + body.name + "'");
            arrival.emplace(voxels[i], times[i]);
        }
        const std::int64_t updates = archive.getOne<std::int64_t>(name + ".updates");
        if (updates < 0 || updates >= std::numeric_limits<std::int64_t>::max() / 2)
            archive.complain("the number of updates of the front in body '" + body.name + "' is out of range");
        updates_[body.name] = updates;
    }
}

std::unique_ptr<core::Effect> make(const Values& values, const scene::Scene& scene)
{
    if (values.text("driver") == "tension" && scene.solver.strain != scene::Strain::corotational)
        throw InputError({"fracture.driver",
                          "\"tension\" takes the pulling part of corotational energy, but solver.strain is \"" +
                              nameOf(scene.solver.strain) + "\"",
                          "\"full\"", "leave one of the two keys out"});
    return std::make_unique<Fracture>(values, scene);
}

}  // namespace

EffectInfo fracture()
{
    return {{"fracture", "Tearing: give kappa, or toughness, or toughness and strength.", kKeys, check},
            "after the solve on the grid, limit on the time step, field 'arrival'",
            make,
            true,
            {"arrival"}};
}

}  // namespace vdbfrac::effects
