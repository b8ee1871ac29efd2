// What is measured of a run: a small witness for each quantity, which is shown every step.
#pragma once

#include <vdbfrac/core/simulation.h>
#include <vdbfrac/lab/study/study.h>

#include <memory>
#include <string>

namespace vdbfrac::lab::study {

class Witness {
public:
    virtual ~Witness() = default;
    /// Before the first step.
    virtual void start(const core::Simulation&) {}
    /// After each step.
    virtual void step(const core::Simulation&, const core::StepRecord&) {}
    /// At the end; `last` is the last step.
    virtual Value end(const core::Simulation&, const core::StepRecord& last) = 0;
};

/// The witness of a measure. The scene must live as long.
std::unique_ptr<Witness> makeWitness(const Spec::Measure& measure, const scene::Scene& scene);

/// The same for what is known from the last state alone, and for what needs all the energies and works on the way; null
/// for other quantities.
std::unique_ptr<Witness> makeEndWitness(const Spec::Measure& measure);
std::unique_ptr<Witness> makeWorkWitness(const Spec::Measure& measure, const scene::Scene& scene);

Value number(double value);
Value missing(std::string why);

/// The measure's point of its body, in the nodes of the system; none where there is no material. Holds until the mesh
/// changes.
std::optional<tetmesh::EmbeddedPoint> locate(const core::Simulation& simulation, const Spec::Measure& measure);
/// Whether something has broken off the body: from then on positions say nothing, only statistics do.
bool isSplit(const core::Simulation& simulation, const std::string& body);
/// A component along the measure's axis, or the magnitude.
double componentOf(const Vec3& vector, const Spec::Measure& measure);
/// Which grip of the scene, in the order of StepRecord::gripLoad.
std::size_t gripIndex(const Spec::Measure& measure, const scene::Scene& scene);

}  // namespace vdbfrac::lab::study
