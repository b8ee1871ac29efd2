// The places of a step where an effect can join. The core walks these lists; it does not know what is in them.
#pragma once

#include <vdbfrac/base/ledger.h>
#include <vdbfrac/base/primitive.h>
#include <vdbfrac/core/archive.h>
#include <vdbfrac/core/body.h>
#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/grid/vdb_file.h>
#include <vdbfrac/solver/backward_euler.h>
#include <vdbfrac/solver/potential.h>
#include <vdbfrac/tetmesh/element_forces.h>
#include <vdbfrac/tetmesh/render_mesh.h>

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace vdbfrac::core {

/// A limit on the time step ("auto" substeps). Asked before the stability of an explicit integrator is, for which a
/// potential can take note of the couplings there are.
class StepLimit {
public:
    virtual ~StepLimit() = default;
    /// s; infinity for none. time [s]: when the step begins.
    virtual double largestStep(const solver::State& state, double time) = 0;
    /// Where the scene fixes the steps: are those that are longer cut back?
    virtual bool cutsBack() const { return false; }
};

/// A step whose equations are solved, on the mesh they were solved on.
struct SolvedStep {
    std::span<const Vec3> x;  ///< m, all nodes of the system
    double time = 0;          ///< s, at the end of the step
    double dt = 0;            ///< s
};

/// Looks on between the solve and what changes the mesh after it.
class Observer {
public:
    virtual ~Observer() = default;
    virtual void observe(const SolvedStep& step) = 0;
};

/// What drives cracks beside the elastic energy Psi [J/m^3]: work Psi / max(atYield, Psi), so all of it where material
/// yields, and nothing where nothing pulls.
struct DrivingWork {
    float work = 0, atYield = 0;  ///< J/m^3; `atYield` 0: none
};

/// Material that flows: what its tets have flowed, and from what strain on they do. Integrators that take a step to
/// somewhere else than where its equations are solved do not go with it.
class FlowStage {
public:
    virtual ~FlowStage() = default;
    /// Fills in the flow and the yield of a body's elements. They stay where they are until flow() returns true or
    /// carry() is called.
    virtual void describe(const Body& body, solver::ElementSet& elements) const = 0;
    /// Before each try to solve a step, over dt [s].
    virtual void begin(double dt) = 0;
    /// The step is kept: material flows, and until begin() the energy is what is stored. Returns whether any did.
    virtual bool flow(const SolvedStep& step, const solver::ElasticOperator& elastic) = 0;
    /// The mesh of a body is another: before RecutStage, and while no operator has asked.
    virtual void carry(const Body& body, const tetmesh::CutUpdate& update) = 0;
    /// Of a body's tets by tetmesh::tetEntry; empty: none.
    virtual std::span<const DrivingWork> drivingWork(const Body& body) const = 0;
};

/// What the stages on the grid see after the solve.
struct GridContext : SolvedStep {
    /// Signed distance [m] in rest space to the nearest grip of a body; infinity without grips.
    std::function<double(const Body&, const Vec3& X)> gripDistance;
    /// Energy density [J/m^3] of all tets of the system (by tetmesh::tetEntry), computed when first asked for in a
    /// step.
    std::function<std::span<const double>()> tetEnergy;
    /// FlowStage::drivingWork.
    std::function<std::span<const DrivingWork>(const Body&)> drivingWork;
    /// Stress [Pa] of the tets of an element of a body, in the frame of the rest configuration.
    std::function<std::array<Mat3, tetmesh::kMaxTets>(const Body&, std::uint32_t element)> elementStress;
    /// What an element of a body does to its corners.
    std::function<tetmesh::ElementForces(const Body&, std::uint32_t element)> elementForces;
    Ledger& ledger;
    std::map<std::string, double>& measured;  ///< columns of stats.csv, with their units at the end
};

/// Changes phi after the solve.
class GridStage {
public:
    virtual ~GridStage() = default;
    /// Changes the phi grid of one body, and returns the new values; its mesh still has the old ones.
    virtual grid::PhiChanges update(const GridContext& context, const Body& body, grid::LevelSet& phi) = 0;
};

/// What there is to know of the pieces when a step is solved. Fragments are numbered by their ids.
struct SleepContext : SolvedStep {
    std::span<const Body> bodies;
    std::span<const Vec3> v;             ///< m/s, all nodes of the system
    std::span<const double> mass;        ///< kg
    std::span<const std::uint8_t> held;  ///< of each fragment: does a grip hold it or pull at it?
    bool converged = false;              ///< was the step solved to its tolerance?
    std::span<solver::Potential* const> potentials;
};

/// Decides which fragments are asleep: they stay where they are, and nothing of them is evaluated. `asleep`: of each.
class SleepStage {
public:
    virtual ~SleepStage() = default;
    /// Wakes what may not lie still any more, where some are asleep. The step is not kept yet: it is solved again for
    /// what wakes, which would have been a wall in it.
    virtual void wake(const SleepContext& context, std::span<std::uint8_t> asleep) = 0;
    /// After the step. Those that are cut again are woken after this.
    virtual void decide(const SleepContext& context, std::span<std::uint8_t> asleep) = 0;
};

/// Tells what it did while a step was solved: work under stages of its own, which is then no longer that of the solve,
/// and columns of stats.csv with their units at the end.
class Reporter {
public:
    virtual ~Reporter() = default;
    virtual void report(Ledger& work, std::map<std::string, double>& measured) = 0;
};

/// Takes its own data along when the phi of a body has changed, and with it most often the mesh.
class RecutStage {
public:
    virtual ~RecutStage() = default;
    /// The mesh is the new one; numbers of nodes and elements are those of the body. Where the cut does not see the
    /// change of phi, all of them are the old ones, but the surface may be another.
    virtual void recut(const Body& body, const tetmesh::CutUpdate& update) = 0;
};

/// A grid of the frames, taken from a simulation that goes on.
using FrameGrid = std::variant<grid::VoxelValues, grid::LevelSet>;

/// Gives grids to the .vdb frames, under their names in `output.vdb`.
class FrameSource {
public:
    struct Field {
        std::string name, unit;
    };
    virtual ~FrameSource() = default;
    virtual std::vector<Field> fields() const = 0;
    /// In the rest configuration of a body.
    virtual FrameGrid take(const Body& body, const std::string& field) const = 0;
};

/// What a frame draws of a body.
struct DrawnSurface {
    const tetmesh::DrawnTopology& topology;
    std::span<const std::uint32_t> used;  ///< the points of faces, rising; others are nowhere
    std::span<Vec3> points, velocity;     ///< m, m/s; of all points
    std::span<std::uint8_t> isMoved;      ///< of all points
};

/// Moves what frames draw of the bodies, not the bodies.
class DrawStage {
public:
    virtual ~DrawStage() = default;
    /// `surfaces`: of all bodies, at a time [s]. Marks the points that it moves.
    virtual void place(double time, std::span<DrawnSurface> surfaces) const = 0;
};

/// What a state on a finer lattice comes from.
struct Refinement {
    const Archive& archive;        ///< of the wide lattice
    std::span<const Body> bodies;  ///< on it, as they were; voxels are twice as wide
};

/// Has something of its own that lives on from step to step: checkpoints keep it.
class Persistent {
public:
    virtual ~Persistent() = default;
    /// Under names of its own, the effect's first.
    virtual void save(std::span<const Body> bodies, Archive& archive) const = 0;
    /// What save wrote for the same bodies. Throws FileError.
    virtual void restoreFrom(const Archive& archive, std::span<const Body> bodies) = 0;
    /// The same, but the scene may be another than that which saved.
    virtual void branchFrom(const Archive& archive, std::span<const Body> bodies) { restoreFrom(archive, bodies); }
    /// That for the same bodies with voxels half as wide.
    virtual void refineFrom(const Refinement& wide, std::span<const Body> bodies) { restoreFrom(wide.archive, bodies); }
};

/// All that takes part in the steps of one simulation.
struct Stages {
    std::vector<solver::Potential*> solve;
    std::vector<StepLimit*> limits;
    std::vector<FlowStage*> flow;  ///< of a body, the first that says anything counts
    std::vector<Observer*> observers;
    std::vector<GridStage*> grid;
    std::vector<Reporter*> reporters;
    std::vector<SleepStage*> sleep;
    std::vector<RecutStage*> recut;
    std::vector<FrameSource*> frames;
    std::vector<const DrawStage*> draw;
    std::vector<Persistent*> persistent;
    std::vector<std::string> notes;  ///< what the user should know before the run, a sentence each

    struct SourceOfField {
        const FrameSource* source = nullptr;
        FrameSource::Field field;
    };
    /// What gives the grid of this name, if anything does.
    std::optional<SourceOfField> sourceOf(const std::string& name) const
    {
        for (const FrameSource* source : frames)
            for (const FrameSource::Field& field : source->fields())
                if (field.name == name) return SourceOfField{source, field};
        return std::nullopt;
    }
};

/// Something a scene can ask for. It enters the stages it needs and is never asked whether it is there.
class Effect {
public:
    virtual ~Effect() = default;
    /// As the scene's table: names the columns of what it does to the energy.
    virtual std::string name() const = 0;
    virtual void join(Stages& stages) = 0;
    /// Before the first step, and again before the first of a branch of a run that did not have it; `notes` as in
    /// Stages.
    virtual void start(const SolvedStep& /*now*/, std::span<const Body> /*bodies*/, std::vector<std::string>& /*notes*/)
    {
    }
};

}  // namespace vdbfrac::core
