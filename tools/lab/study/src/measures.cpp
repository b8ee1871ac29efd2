// Measures over the course of a run: loads, onset, oscillations, momentum.
#include "measures.h"

#include <vdbfrac/lab/study/oscillation.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vdbfrac::lab::study {

namespace {

using Measure = Spec::Measure;

/// Load of the grip or the collider of a measure in a step [N].
class LoadOf {
public:
    LoadOf(const Measure& measure, const scene::Scene& scene)
        : measure_(measure), grip_(measure.collider.empty() ? gripIndex(measure, scene) : 0)
    {
    }
    double operator()(const core::StepRecord& s) const
    {
        if (measure_.collider.empty()) return componentOf(s.gripLoad[grip_], measure_);
        const auto along = [&](const char* axis) {
            return s.measured.at("collider_load_" + measure_.collider + "_" + axis + "_N");
        };
        return componentOf({along("x"), along("y"), along("z")}, measure_);
    }

private:
    Measure measure_;
    std::size_t grip_;
};

class PeakLoad : public Witness {
public:
    PeakLoad(const Measure& measure, const scene::Scene& scene) : loadOf_(measure, scene) {}
    void step(const core::Simulation&, const core::StepRecord& s) override
    {
        const double load = loadOf_(s);
        if (!peak_ || std::abs(load) > std::abs(*peak_)) peak_ = load;
    }
    Value end(const core::Simulation&, const core::StepRecord&) override
    {
        return peak_ ? number(*peak_) : missing("no step");
    }

private:
    LoadOf loadOf_;
    std::optional<double> peak_;
};

class EndLoad : public Witness {
public:
    EndLoad(const Measure& measure, const scene::Scene& scene) : loadOf_(measure, scene) {}
    Value end(const core::Simulation&, const core::StepRecord& last) override
    {
        return last.step > 0 ? number(loadOf_(last)) : missing("no step");
    }

private:
    LoadOf loadOf_;
};

/// First time that the level set changes where the cut sees it.
class Onset : public Witness {
public:
    void step(const core::Simulation&, const core::StepRecord& s) override
    {
        if (!time_ && s.work.countOf("cut", "voxels") > 0) time_ = s.time;
    }
    Value end(const core::Simulation&, const core::StepRecord&) override
    {
        return time_ ? number(*time_) : missing("nothing tore");
    }

private:
    std::optional<double> time_;
};

/// Amplitude [m] of the longitudinal standing wave of the measure: the mean of displacement times its shape, by mass.
/// Lumped masses make it free of the shorter waves of a bar with the measure's point at a held end and a free end at
/// crest, as they make all of them orthogonal.
double waveAmplitude(const core::Simulation& s, const Measure& measure)
{
    const auto mass = s.elastic().mass();
    const double k = 2 * std::numbers::pi / *measure.wavelength;
    double swing = 0, size = 0;
    for (const core::Body& body : s.bodies())
        for (std::uint32_t n = 0; body.name == measure.body && n < body.mesh->nodeCount(); ++n) {
            const Vec3 X = body.mesh->restPosition(n);
            const double shape = std::sin(k * (X - *measure.point).dot(*measure.axis)), m = mass[body.firstNode + n];
            swing += m * shape * (s.x()[body.firstNode + n] - X).dot(*measure.axis);
            size += m * shape * shape;
        }
    return size > 0 ? swing / size : 0;
}

/// Displacement of a point over time or amplitude of a wave, for its period or its damping.
class Oscillation : public Witness {
public:
    explicit Oscillation(const Measure& measure) : measure_(measure) {}
    void start(const core::Simulation& s) override
    {
        point_ = locate(s, measure_);
        sample(s);
    }
    void step(const core::Simulation& s, const core::StepRecord& record) override
    {
        if (point_ && record.work.countOf("cut", "voxels") > 0) point_ = locate(s, measure_);
        sample(s);
    }
    Value end(const core::Simulation& s, const core::StepRecord&) override
    {
        if (isSplit(s, measure_.body)) return missing("after a split");
        if (!point_) return missing("no material at the point");
        const auto found =
            measure_.quantity == "period" ? periodOf({t_, u_}, measure_.rest) : dampingOf({t_, u_}, measure_.rest);
        return found ? number(*found) : missing("fewer than two swings");
    }

private:
    void sample(const core::Simulation& s)
    {
        if (!point_) return;
        t_.push_back(s.time());
        u_.push_back(measure_.wavelength ? waveAmplitude(s, measure_)
                                         : componentOf(point_->at(s.x()) - *measure_.point, measure_));
    }

    Measure measure_;
    std::vector<double> t_, u_;
    std::optional<tetmesh::EmbeddedPoint> point_;
};

/// Change of the total momentum, or of the angular momentum about where the center of mass was at the start, relative
/// to the largest sum of magnitudes. 0 for what nothing holds or pulls.
class MomentumChange : public Witness {
public:
    explicit MomentumChange(bool angular) : angular_(angular) {}
    void start(const core::Simulation& s) override
    {
        const auto mass = s.elastic().mass();
        double sum = 0;
        for (std::size_t i = 0; i < mass.size(); ++i) center_ += mass[i] * s.x()[i], sum += mass[i];
        center_ /= sum;
        first_ = total(s);
    }
    void step(const core::Simulation& s, const core::StepRecord&) override { last_ = total(s); }
    Value end(const core::Simulation&, const core::StepRecord& last) override
    {
        return number(last.step > 0 && turnover_ > 0 ? (last_ - first_).norm() / turnover_ : 0);
    }

private:
    Vec3 total(const core::Simulation& s)
    {
        const auto mass = s.elastic().mass();
        Vec3 sum = Vec3::Zero();
        double magnitude = 0;
        for (std::size_t i = 0; i < mass.size(); ++i) {
            const Vec3 p = mass[i] * s.v()[i], r = s.x()[i] - center_;
            sum += angular_ ? Vec3(r.cross(p)) : p;
            magnitude += angular_ ? r.norm() * p.norm() : p.norm();
        }
        turnover_ = std::max(turnover_, magnitude);
        return sum;
    }

    bool angular_;
    Vec3 center_ = Vec3::Zero(), first_ = Vec3::Zero(), last_ = Vec3::Zero();
    double turnover_ = 0;
};

}  // namespace

Value number(double value)
{
    if (!std::isfinite(value)) return missing("not finite");
    return {{value}};
}

Value missing(std::string why) { return {{}, std::move(why)}; }

double componentOf(const Vec3& vector, const Measure& measure)
{
    return measure.axis ? vector.dot(*measure.axis) : vector.norm();
}

std::size_t gripIndex(const Measure& measure, const scene::Scene& scene)
{
    const auto it = std::find_if(scene.grips.begin(), scene.grips.end(),
                                 [&](const scene::Grip& g) { return g.name == measure.grip; });
    return std::size_t(it - scene.grips.begin());
}

std::unique_ptr<Witness> makeWitness(const Measure& measure, const scene::Scene& scene)
{
    const std::string& q = measure.quantity;
    if (auto witness = makeEndWitness(measure)) return witness;
    if (auto witness = makeWorkWitness(measure, scene)) return witness;
    if (q == "load_peak" || q == "collider_load_peak") return std::make_unique<PeakLoad>(measure, scene);
    if (q == "load_end" || q == "collider_load_end") return std::make_unique<EndLoad>(measure, scene);
    if (q == "onset") return std::make_unique<Onset>();
    if (q == "period" || q == "damping") return std::make_unique<Oscillation>(measure);
    return std::make_unique<MomentumChange>(q == "angular_momentum");
}

}  // namespace vdbfrac::lab::study
