// Ductile fracture by a level set: the surface eats into material whose elastic energy exceeds its fracture resistance.
//
// Hegemann et al. 2013, section 5. Psi, the energy that drives it, is averaged over the material within l of a voxel
// node; kappa is the fracture resistance [J/m^3]. fracture_law.h has what a scene gives and what kappa and l follow
// from it. Keys scale kappa over time, and so Gc alike and sigma_t by the root: l stays.
#include "all.h"
#include "fracture_arrivals.h"
#include "fracture_driving.h"
#include "fracture_law.h"
#include "fracture_places.h"

#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/grid/griffith.h>
#include <vdbfrac/grid/tension.h>
#include <vdbfrac/grid/transfer.h>
#include <vdbfrac/tetmesh/nodes_around.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

namespace vdbfrac::effects {

namespace {

using scene::Values;

constexpr const char* kMargin = "margin";

/// Averaged tension: the surface eats what it touches, material this near to it [voxels], a voxel and what phi may be
/// off. Farther in, where the energy of a tip may be higher than at the tip, a crack would leave bridges behind.
constexpr double kTouch = 1.05;
constexpr double kMaxMove = 0.5;  // voxels that phi moves by before it is re-levelled

/// Material that may move, and Psi there.
struct Driven {
    std::vector<VoxelPhi> band;
    std::vector<double> psi;    // J/m^3
    std::vector<double> share;  // of the speed that Psi gives the front
    std::vector<Vec3> points;   // of the crack's middle, where it passes them [voxels]
    std::int64_t looked = 0;
    std::optional<Coord> seed;  // where a crack starts inside
};

/// A body's Psi in the last step.
struct Tension {
    double largest = 0;         // J/m^3
    double load = 0;            // root of it over kappa: how far the load is, if it grows as it is
    grid::VoxelValues margins;  // Psi / kappa at the front, if a scene asks for it
};

class Fracture : public core::Effect,
                 public core::GridStage,
                 public core::StepLimit,
                 public core::FrameSource,
                 public core::Persistent {
public:
    Fracture(const Values& values, const scene::Scene& scene)
        : values_(values),
          grid_(scene.grid),
          dx_(grid_.voxelSize),
          isTension_(values.text("driver") == "tension"),
          nucleatesInside_(values.text("nucleation") == "inside"),
          frontCfl_(scene.time.frontCfl),
          resistance_(values.has("keys") ? values.curve("keys") : scene::Curve()),
          fps_(scene.time.fps),
          tellsMargin_(std::count(scene.output.vdb.begin(), scene.output.vdb.end(), kMargin) > 0),
          margin_(values.has("grip_margin") ? values.number("grip_margin") : 2 * grid_.coarsening * dx_),
          places_(values, grid_.coarsening * dx_),
          unused_(unusedResistances(values, scene))
    {
        for (const scene::Body& body : scene.bodies) keys_[body.name] = fractureKeys(values, body.material);
    }

    std::string name() const override { return "fracture"; }
    void join(core::Stages& stages) override
    {
        stages.grid.push_back(this);
        stages.limits.push_back(this);
        stages.frames.push_back(this);
        stages.persistent.push_back(this);
    }

    void start(const core::SolvedStep&, std::span<const core::Body> bodies, std::vector<std::string>& notes) override
    {
        notes.insert(notes.end(), unused_.begin(), unused_.end());
        places_.note(bodies, dx_, notes);
        for (const core::Body& body : bodies) {
            FractureLaw& law = laws_[body.name];
            law = fractureLaw(keys_.at(body.name), grid_, body.name, body.material, notes);
            law.leastFactor = places_.leastOf(*body.mesh, dx_);
            arrival_.try_emplace(body.name);
        }
    }
    double largestStep(const solver::State&, double) override { return limit_; }
    grid::PhiChanges update(const core::GridContext& context, const core::Body& body, grid::LevelSet& phi) override;

    std::vector<Field> fields() const override
    {
        std::vector<Field> fields = {{"arrival", "s"}};
        if (isTension_) fields.push_back({kMargin, "1"});
        return fields;
    }
    core::FrameGrid take(const core::Body& body, const std::string& field) const override
    {
        const auto margins = tension_.find(body.name);
        if (field != kMargin) return timesOf(arrival_.at(body.name));
        return margins == tension_.end() ? grid::VoxelValues() : margins->second.margins;
    }
    void save(std::span<const core::Body> bodies, core::Archive& archive) const override;
    void restoreFrom(const core::Archive& archive, std::span<const core::Body> bodies) override;
    void refineFrom(const core::Refinement& wide, std::span<const core::Body> bodies) override;

private:
    /// Material that no grip holds: the rest neither tears nor counts in averages.
    grid::VoxelFilter freeMaterial(const core::GridContext& context, const core::Body& body) const
    {
        return [&](Coord c) { return context.gripDistance(body, dx_ * c.toVec()) >= margin_; };
    }
    Driven driven(const core::GridContext& context, const core::Body& body, const FractureLaw& law);
    Driven drivenByTension(const core::GridContext& context, const core::Body& body, const FractureLaw& law);
    /// The step [s] that takes the front frontCfl_ voxels; it may speed up by kFaster.
    double longestStep(double waveSpeed, double fastest) const
    {
        constexpr double kFaster = .2;  // of the speed of Rayleigh waves, which it never passes
        return frontCfl_ * dx_ / (waveSpeed * std::min(1., values_.number("front_speed") * fastest + kFaster));
    }
    void lookAhead(const core::GridContext& context, const core::Body& body, double kappa, double largest, Coord where);
    bool isFrame(double time) const { return std::abs(time * fps_ - std::round(time * fps_)) < 1e-6; }
    void noteArrivals(const core::Body& body, const Driven& front, const grid::PhiChanges& changes, double time);
    grid::Relevelling relevelling(long long update) const;

    Values values_;
    scene::Grid grid_;
    double dx_;
    bool isTension_;  // the driver
    bool nucleatesInside_;
    double frontCfl_;
    scene::Curve resistance_;  // factor on kappa
    double fps_;
    bool tellsMargin_;
    double margin_;  // m, round grips
    FracturePlaces places_;
    std::vector<std::string> unused_;           // notes on resistances of no body
    std::map<std::string, Tension> tension_;    // by body
    std::map<std::string, FractureKeys> keys_;  // by body
    std::map<std::string, FractureLaw> laws_;   // by body
    std::map<std::string, Arrivals> arrival_;   // by body
    double limit_ = kInfinity;                  // s
    double limitTime_ = -1;                     // step to which limit_ belongs
    std::map<std::string, long long> updates_;  // by body: times the front was moved
};

Driven Fracture::drivenByTension(const core::GridContext& context, const core::Body& body, const FractureLaw& law)
{
    const grid::VoxelFilter isFree = freeMaterial(context, body);
    // Voxels of the gap stay as they are: raising phi there would eat into the faces behind a tip, and a crack be twice
    // as wide.
    const double deepest = law.radius > 0 ? -kTouch * dx_ : -kInfinity;
    const auto isFront = [&](Coord c) {
        const float phi = body.mesh->phi()(c);
        return phi < 0 && phi >= deepest && isFree(c);
    };
    const DrivingEnergy driving(context, body);
    const auto stress = [&](std::uint32_t e) { return driving.stress(e); };
    const double E = body.material.youngsModulus(), nu = body.material.poissonRatio();
    grid::TensionAverage average{law.radius, E, nu, isFree, law.perRelease, places_.onVoxels(dx_), law.leastFactor};
    const grid::CrackPath path = pathOf(arrival_[body.name], body.mesh->phi());
    const grid::Loaded loaded{
        *body.mesh, driving.energy(), stress, isFront, [&](std::uint32_t e) { return context.elementForces(body, e); },
        &path};
    const grid::TensionAbove above = grid::tensionAbove(law.kappa, loaded, average, tension_[body.name].largest);
    if (tellsMargin_ && isFrame(context.time)) {
        constexpr double kLittle = .05;  // of kappa; less is left out of the grid
        grid::VoxelValues& margins = tension_[body.name].margins =
            grid::tensionAtFront(loaded, average, kLittle * law.kappa);
        for (float& psi : margins.scalars) psi = float(double(psi) / law.kappa);
    }
    Driven driven{grid::sampleBand(body.phi, above.voxels), {}, {}, {}, above.stresses, {}};
    double largest = above.largest;
    Coord where = above.where;
    if (nucleatesInside_) {
        // Nearer to a surface that would only leave bridges ahead of a crack.
        const double depth = std::min(law.radius, grid_.halfWidth * dx_);
        const auto isInside = [&](Coord c) { return body.mesh->phi()(c) <= -.999 * depth && isFree(c); };
        average.perRelease = 0;  // there is no tip yet
        const grid::TensionAbove inside =
            grid::tensionAbove(law.kappa, {*body.mesh, loaded.energy, stress, isInside}, average, law.kappa);
        driven.looked += inside.stresses;
        if (inside.largest > law.kappa) driven.seed = inside.where;
        if (inside.largest > largest) largest = inside.largest, where = inside.where;
    }
    lookAhead(context, body, law.kappa, largest, where);
    for (std::size_t i = 0, n = 0; i < above.voxels.size() && n < driven.band.size(); ++i)
        if (driven.band[n].voxel == above.voxels[i]) {
            driven.psi.push_back(above.psi[i]), driven.share.push_back(above.share[i]);
            driven.points.push_back(above.points[i]);
            ++n;
        }
    return driven;
}

Driven Fracture::driven(const core::GridContext& context, const core::Body& body, const FractureLaw& law)
{
    if (isTension_) return drivenByTension(context, body, law);
    const DrivingEnergy driving(context, body);
    const std::span<const double> own = driving.energy();
    std::vector<Coord> voxels = tetmesh::nodesAround(body.mesh->voxelsAbove(own, law.leastFactor * law.kappa),
                                                     grid::reachWithin(law.radius / dx_));
    const grid::VoxelFilter isFree = freeMaterial(context, body);
    std::erase_if(voxels, [&](const Coord& c) { return body.mesh->phi()(c) >= 0 || !isFree(c); });
    Driven driven{grid::sampleBand(body.phi, voxels), {}, {}, {}, 0, {}};
    voxels.clear();
    for (const VoxelPhi& b : driven.band) voxels.push_back(b.voxel);
    driven.looked = std::int64_t(voxels.size());
    const auto energy = [&](std::uint32_t e, int t) { return own[tetmesh::tetEntry(e, std::size_t(t))]; };
    driven.psi = law.radius > 0 ? grid::averagedEnergy(*body.mesh, energy, voxels, law.radius, isFree)
                                : grid::nodalEnergy(*body.mesh, energy, voxels);
    for (std::size_t i = 0; i < voxels.size(); ++i) driven.psi[i] /= places_.factor(dx_ * voxels[i].toVec());
    driven.share.assign(voxels.size(), 1);
    return driven;
}

/// Where it tears next and at how much of the load, from the largest Psi [J/m^3] and its voxel; automatic steps end
/// there.
void Fracture::lookAhead(const core::GridContext& context, const core::Body& body, double kappa, double largest,
                         Coord where)
{
    constexpr double kLate = .01;  // of the load at the onset
    Tension& tension = tension_[body.name];
    const double load = std::sqrt(largest / kappa), rate = (load - tension.load) / context.dt;
    if (load <= 1 && rate > 0) limit_ = std::min(limit_, std::max(1 - load, kLate) / rate);
    tension.largest = largest, tension.load = load;
    if (load == 0) return;
    const auto known = context.measured.find("fracture_load_factor");
    if (known != context.measured.end() && known->second <= 1 / load) return;  // another body tears before
    context.measured["fracture_load_factor"] = 1 / load;
    for (int axis : {0, 1, 2})
        context.measured[std::string("fracture_next_") + "xyz"[axis] + "_m"] = dx_ * where.toVec()[axis];
}

void Fracture::noteArrivals(const core::Body& body, const Driven& front, const grid::PhiChanges& changes, double time)
{
    auto& arrival = arrival_[body.name];
    const std::vector<VoxelPhi>& band = front.band;  // sorted
    const auto pointAt = [&](const Coord& c) {
        const auto it =
            std::lower_bound(band.begin(), band.end(), c, [](const VoxelPhi& b, Coord v) { return b.voxel < v; });
        const std::size_t i = std::size_t(it - band.begin());
        return it != band.end() && it->voxel == c && i < front.points.size() ? front.points[i] : c.toVec();
    };
    for (const auto& [voxel, value] : changes)
        // The mesh still has the old phi.
        if (value >= 0 && body.mesh->phi()(voxel) < 0) arrival.emplace(voxel, Arrival{float(time), pointAt(voxel)});
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
    FractureLaw law = laws_.at(body.name);
    law.kappa *= resistance_.at(context.time);
    const solver::Material& m = body.material;
    const double waveSpeed = grid::rayleighSpeed(m.mu, m.poissonRatio(), m.rho);
    (void)context.tetEnergy();  // timed on its own
    if (limitTime_ != context.time) limit_ = kInfinity, limitTime_ = context.time;

    Driven front;
    {
        const StageTimer timer(context.ledger, "fracture");
        front = driven(context, body, law);
        context.ledger.count("fracture", "voxels", front.looked);
    }
    std::vector<VoxelPhi>& band = front.band;
    // Hegemann's Psi - kappa with a mobility that falls with Psi: cracks run at front_speed c_R (1 - kappa / Psi).
    std::vector<double> driving;  // the Psi [J/m^3] that moves each voxel node at that speed
    double fastest = 0;           // in front_speed c_R
    for (std::size_t i = 0; i < front.psi.size(); ++i) {
        const double speed = std::max(0., 1 - law.kappa / front.psi[i]) * front.share[i];
        driving.push_back(law.kappa * (1 + speed));
        fastest = std::max(fastest, speed);
    }
    const double eps = values_.number("front_width") * dx_;
    const double mobility = values_.number("front_speed") * waveSpeed * std::numbers::pi * eps / law.kappa;
    const double possible = waveSpeed * context.dt, most = std::min(possible, frontCfl_ * dx_);
    const int parts = std::max(1, int(std::ceil(most / (kMaxMove * dx_) - 1e-9)));
    grid::GriffithStep step{law.kappa, eps, 0, most / parts};

    grid::PhiChanges all;
    const auto raise = [&](const grid::PhiChanges& raised) {
        limit_ = std::min(limit_, longestStep(waveSpeed, fastest));
        const StageTimer timer(context.ledger, "relevel");
        grid::RelevelWork work;
        const grid::PhiChanges changes = grid::raiseAndRelevel(phi, raised, work, relevelling(++updates_[body.name]));
        context.ledger.count("fracture", "moved_voxels", std::int64_t(raised.size()));
        context.ledger.count("relevel", "leaves", work.leaves);
        context.ledger.count("relevel", "voxels", work.voxels);
        grid::follow(band, changes);
        all.insert(all.end(), changes.begin(), changes.end());
    };
    if (front.seed) raise(grid::holeRound(*front.seed, eps, dx_));
    bool heldBack = false;
    for (int part = 0; part < parts; ++part) {
        grid::PhiChanges raised;
        // One pseudo-time step for all voxels, as long as the fastest allows (CFL): clipping each on its own would let
        // the flanks of a crack catch up with its tip.
        const double wanted = step.s = mobility * context.dt / parts;
        for (std::size_t i = 0; i < band.size(); ++i)
            step.s = std::min(step.s, griffithTime(band[i].phi, driving[i], step.maxMove, step));
        for (std::size_t i = 0; i < band.size(); ++i) {
            const double phi = griffithUpdate(band[i].phi, driving[i], step);
            if (float(phi) > band[i].phi) raised.emplace_back(band[i].voxel, float(phi));
        }
        if (raised.empty()) break;
        heldBack = heldBack || (most < possible && step.s < wanted);
        raise(raised);
    }
    context.ledger.count("fracture", "held_back", heldBack);
    noteArrivals(body, front, all, context.time);
    return all;
}

void Fracture::save(std::span<const core::Body> bodies, core::Archive& archive) const
{
    archive.put("fracture.limit", std::vector<double>{limit_, limitTime_});
    for (const core::Body& body : bodies) {
        const std::string name = "fracture." + body.name;
        effects::save(arrival_.at(body.name), name, archive);
        const auto updates = updates_.find(body.name);
        const auto tension = tension_.find(body.name);
        archive.put(name + ".tension", tension == tension_.end()
                                           ? std::vector<double>{0, 0}
                                           : std::vector<double>{tension->second.largest, tension->second.load});
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
        arrival_[body.name] = restoredArrivals(name, body, archive);
        const std::vector<double> tension = archive.get<double>(name + ".tension", 2);
        if (!(tension[0] >= 0) || !(tension[1] >= 0))
            archive.complain("the tension of body '" + body.name + "' is out of range");
        tension_[body.name] = {tension[0], tension[1], {}};
        const std::int64_t updates = archive.getOne<std::int64_t>(name + ".updates");
        if (updates < 0 || updates >= std::numeric_limits<std::int64_t>::max() / 2)
            archive.complain("the number of updates of the front in body '" + body.name + "' is out of range");
        updates_[body.name] = updates;
    }
}

void Fracture::refineFrom(const core::Refinement& wide, std::span<const core::Body> bodies)
{
    restoreFrom(wide.archive, wide.bodies);
    for (const core::Body& body : bodies)
        arrival_[body.name] = arrivalsOnFiner(arrival_[body.name], body.mesh->restPhi(), body.mesh->phi());
}

std::unique_ptr<core::Effect> make(const Values& values, const scene::Scene& scene)
{
    return std::make_unique<Fracture>(values, scene);
}

}  // namespace

EffectInfo fracture()
{
    return {
        {"fracture", "Tearing: give kappa, or toughness, or toughness and strength.", fractureTable(), checkFracture},
        "after the solve on the grid, limit on the time step, fields 'arrival', 'margin'",
        make,
        true,
        {"arrival", kMargin}};
}

}  // namespace vdbfrac::effects
