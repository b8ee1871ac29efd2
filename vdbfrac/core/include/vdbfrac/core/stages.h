// The places of a step where an effect can join. The core walks these lists; it does not know what is in them.
#pragma once

#include <vdbfrac/base/ledger.h>
#include <vdbfrac/base/primitive.h>
#include <vdbfrac/core/archive.h>
#include <vdbfrac/core/body.h>
#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/grid/vdb_file.h>
#include <vdbfrac/solver/potential.h>

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace vdbfrac::core {

/// What the stages on the grid see after the solve.
struct GridContext {
    std::span<Body> bodies;
    std::span<const Vec3> x;  ///< m, all nodes of the system
    double time = 0;          ///< s, at the end of the step
    double dt = 0;            ///< s
    /// Signed distance [m] in rest space to the nearest grip of a body; infinity without grips.
    std::function<double(const Body&, const Vec3& X)> gripDistance;
    /// Energy density [J/m^3] of all tets of the system (entry 6 e + t), computed when first asked for in a step.
    std::function<std::span<const double>()> tetEnergy;
    Ledger& ledger;
};

/// A limit on the time step ("auto" substeps).
class StepLimit {
public:
    virtual ~StepLimit() = default;
    virtual double largestStep() const = 0;  ///< s; infinity for none
};

/// Changes phi after the solve.
class GridStage {
public:
    virtual ~GridStage() = default;
    /// Before the first step; `notes` as in Stages.
    virtual void start(std::span<const Body> /*bodies*/, std::vector<std::string>& /*notes*/) {}
    /// Does it take energy out of the simulation when it acts?
    virtual bool dissipates() const { return true; }
    /// New phi values of one body; the phi grid already holds them.
    virtual grid::PhiChanges update(const GridContext& context, Body& body) = 0;
};

/// Contributes a field to the .vdb frames, under its name in `output.vdb`.
class FieldSource {
public:
    virtual ~FieldSource() = default;
    virtual std::string fieldName() const = 0;
    virtual grid::VoxelValues field(const Body& body) const = 0;
};

/// Has something of its own that lives on from step to step: checkpoints keep it.
class Lasting {
public:
    virtual ~Lasting() = default;
    /// Under names of its own, the effect's first.
    virtual void save(std::span<const Body> bodies, Archive& archive) const = 0;
    /// What save wrote for the same bodies. Throws FileError.
    virtual void load(std::span<const Body> bodies, const Archive& archive) = 0;
};

/// All that takes part in the steps of one simulation.
struct Stages {
    std::vector<solver::Potential*> solve;
    std::vector<GridStage*> grid;
    std::vector<StepLimit*> limits;
    std::vector<FieldSource*> fields;
    std::vector<Lasting*> lasting;
    std::vector<std::string> notes;  ///< what the user should know before the run, a sentence each
};

/// Something a scene can ask for. It enters the stages it needs and is never asked whether it is there.
class Effect {
public:
    virtual ~Effect() = default;
    virtual void join(Stages& stages) = 0;
};

}  // namespace vdbfrac::core
