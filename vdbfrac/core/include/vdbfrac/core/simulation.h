// The simulation: phi -> cut -> solve -> stages on the grid -> phi. One direction; phi is the only feedback.
#pragma once

#include <vdbfrac/base/ledger.h>
#include <vdbfrac/core/ancestry.h>
#include <vdbfrac/core/archive.h>
#include <vdbfrac/core/body.h>
#include <vdbfrac/core/stages.h>
#include <vdbfrac/scene/scene.h>
#include <vdbfrac/solver/element.h>
#include <vdbfrac/solver/integrator.h>
#include <vdbfrac/tetmesh/cut_mesh_surface.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace vdbfrac::core {

/// Energy that no account names is told beyond this share of what was put in.
inline constexpr double kMaxUnnamedShare = 0.01;

/// A step that is not solved, ends deep in something, or flies apart is capped, and never accepted silently.
enum class Outcome { converged, cutback, capped };

/// One row of stats.csv.
struct StepRecord {
    int step = 0;
    double time = 0;  ///< s, at the end
    double dt = 0;    ///< s
    Outcome outcome = Outcome::converged;
    int cutbacks = 0;  ///< times dt was halved for this step
    int newtonIterations = 0, linearIterations = 0, projections = 0;
    double residual = 0;       ///< relative to the largest force
    double minResidual = 0;    ///< smallest of the Newton iterates
    double kineticEnergy = 0;  ///< J
    double elasticEnergy = 0;  ///< J; both of the material that there is when the step is over
    double unnamedShare = 0;   ///< energy that no account names, of all that was put in so far; both up to this step
    double volume = 0;         ///< m^3 of material
    std::size_t fragments = 0;
    std::size_t nodes = 0;
    std::int64_t tets = 0;
    std::vector<Vec3> gripLoad;  ///< N, force of each grip on the material
    /// What has come into kinetic and elastic energy over the step, and gone [J]; docs/output.md says what of each
    /// name. Each by its own formula; work_GRIP + EFFECT_work - EFFECT_dissipated - removed - integrator less the
    /// change of both together is "unnamed".
    std::map<std::string, double> energyFlow;
    std::map<std::string, double> measured;  ///< what effects tell of the step, by columns of stats.csv
    Ledger work;                             ///< of this step
};

/// J that no account has to explain: of strains that are rounding, or that Newton's tolerance leaves in what moves as a
/// whole.
double energyOfNoise(std::span<const Body> bodies);

class StepControl;

class Simulation {
public:
    /// Builds bodies, lattice and first cut. `effects` must outlive the simulation. `memoryLimit` [bytes] bounds what
    /// the input may ask for. Throws InputError (empty body, grip that holds nothing, ...), FileError, LimitError.
    Simulation(const scene::Scene& scene, std::span<Effect* const> effects, std::uint64_t memoryLimit);
    ~Simulation();

    /// One time step that ends no later than `until` [s], which has to be after time(): InputError. Throws LimitError
    /// when forces or positions are beyond what a double holds, also after dt was cut back: there is nothing to go on
    /// from.
    StepRecord step(double until);
    /// Frames after the first whose time has come.
    int framesDone() const;
    /// One time step that ends with the next frame at the latest: runs that step so have the same bits.
    StepRecord stepInFrame() { return step((framesDone() + 1) / timeSettings_.fps); }

    double time() const { return time_; }
    std::span<const Body> bodies() const { return bodies_; }
    std::span<const Vec3> x() const { return state_.x; }
    std::span<const Vec3> v() const { return state_.v; }
    const Stages& stages() const { return stages_; }
    const solver::ElasticOperator& elastic() const { return *elastic_; }
    const solver::Integrator& integrator() const { return *integrator_; }
    /// Nodes that a grip holds or pulls, rising; until the next step.
    std::span<const std::uint32_t> gripNodes(std::size_t grip) const;

    /// Nodal elastic energy density [J/m^3] of a body on its band and inside.
    grid::VoxelValues energyField(const Body& body) const;
    /// Fingerprint of x, v, phi, fragments and time: of what the next step depends on, all but what effects keep to
    /// themselves, so that an effect which never acts does not show.
    std::uint64_t stateHash() const;
    int steps() const { return steps_; }

    /// Everything the next step depends on that does not come from the scene.
    void save(Archive& archive) const;
    /// Goes on from there: for a simulation of the same scene that has made no step. The steps that follow have the
    /// bits of those that would have followed save. Throws FileError for what save cannot have written; then the
    /// simulation is of no use.
    void restoreFrom(const Archive& archive);
    /// The same for a scene with other settings, as far as core/branch.h lets them differ: effects that the archive
    /// does not know begin anew, energies are computed again. Throws InputError for a grip that would jump.
    void branchFrom(const Archive& archive);
    /// Takes over the state of a simulation of the same scene with voxels twice as wide, which has been restored from
    /// `archive`: for one that has made no step. Positions and velocities are those of the wide lattice, cracks too.
    void refineFrom(const Simulation& wide, const Archive& archive);
    /// Of the bodies as they are now: rest positions, phi and fragments.
    std::uint64_t bodiesHash() const;
    struct Totals {
        double volume = 0, elasticEnergy = 0, kineticEnergy = 0;  ///< m^3, J, J
    };
    Totals totals() const;
    /// Which nodes those of now were a frame ago; null unless output.motion asks for it.
    const Ancestry* ancestry() const { return ancestry_.get(); }
    double volume() const;  ///< m^3 of material
    double startVolume() const;
    std::size_t fragments() const;
    std::size_t fragmentsAsleep() const;

private:
    class Grips;
    class StateFields;

    void addBody(const scene::Scene& scene, const scene::Body& body, std::uint64_t memoryLimit);
    void setInitialVelocity(const scene::Body& spec, const Body& body);
    struct Attempt;
    Attempt solveOrCutBack(StepRecord& record, double dt, double shortest);
    void tellUnsolved(std::uint32_t node, std::map<std::string, double>& measured) const;
    void solve(StepRecord& record, double until);
    void countSolve(StepRecord& record, const solver::ElasticWork& before, std::size_t couplings) const;
    void takeReports(StepRecord& record) const;
    void beginEnergy();
    void book(StepRecord& record, const solver::StepReport& report, const solver::ElasticOperator& after,
              double startEnergy);
    using AskAsleep = void (SleepStage::*)(const SleepContext&, std::span<std::uint8_t>);
    bool askAsleep(double time, double dt, bool converged, AskAsleep ask);
    bool wakeStruck(double dt);
    void putToSleep(StepRecord& record, bool converged);
    void changeAsleep();
    void holdAsleep();
    void wakeRecut(const Body& body, const tetmesh::CutUpdate& update);
    void clearAsleep(std::vector<double>& density) const;
    void restoreBodies(const Archive& archive);
    void restoreProgress(const Archive& archive);
    void start(Effect& effect);
    void restoreEffects(const Archive& archive, const std::function<void(Persistent&)>& restore);
    bool isAdmissible(double dt) const;
    void updateGrid(StepRecord& record);
    bool recut(StepRecord& record, std::size_t body, const grid::PhiChanges& changes);
    void carryOver(Body& body, const tetmesh::CutUpdate& update, std::size_t oldCount);
    void number();
    std::unique_ptr<solver::ElasticOperator> makeOperator() const;
    void bindOperator();
    void rebuild();
    std::unique_ptr<solver::ElasticOperator> letFlow(double dt) const;
    solver::ElementOf elementOf(const Body& body, std::uint32_t element) const;
    void letGoOfGrips();
    void measure(StepRecord& record) const;
    double kineticEnergy(std::span<const Vec3> v) const;
    void warnOfLongSteps();
    int frameUnderWay() const;  // after the first: that which ends now or next

    scene::Time timeSettings_;
    scene::Solver solverSettings_;
    double h_ = 1;
    std::vector<Body> bodies_;
    std::uint32_t nextFragment_ = 0;
    Stages stages_;
    std::vector<std::string> potentialNames_;                      // of the effects that stages_.solve are of
    std::vector<std::string> flowNames_;                           // of the effects that stages_.flow are of
    std::vector<Effect*> persistentOwners_;                        // the effects that stages_.persistent are of
    std::map<std::string, std::vector<std::string>> effectNotes_;  // those in stages_.notes, by the names of effects
    solver::State state_, saved_;                                  // now, and at the start of the step
    std::vector<std::uint8_t> asleep_;                             // of each fragment, by its id; empty: nobody decides
    std::vector<double> density_;                                  // J/m^3, of all tets; kept for its memory
    std::unique_ptr<solver::ElasticOperator> elastic_;
    std::unique_ptr<solver::Integrator> integrator_;
    std::unique_ptr<Grips> grips_;
    std::unique_ptr<StepControl> stepControl_;
    std::unique_ptr<FrameSource> fields_;
    std::unique_ptr<Ancestry> ancestry_;
    double elasticEnergy_ = 0, kineticEnergy_ = 0;  // J
    double putIn_ = 0, unnamed_ = 0;                // J since the start
    double netIn_ = 0, mostIn_ = 0;                 // J: less what was taken out or dissipated; the most of it so far
    bool balanced_ = false;                         // the state solves the equations of the last step, on this mesh
    double time_ = 0;
    int steps_ = 0;
};

}  // namespace vdbfrac::core
