#include "run_report.h"

#include "progress.h"
#include "step_warnings.h"

#include <vdbfrac/base/number_text.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/machine/memory.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace vdbfrac::cli {

namespace {

std::string amount(std::int64_t n)
{
    if (n >= 10'000'000'000) return fmt::format("{:.1f} G", double(n) * 1e-9);
    if (n >= 10'000'000) return fmt::format("{:.1f} M", double(n) * 1e-6);
    if (n >= 10'000) return fmt::format("{:.1f} k", double(n) * 1e-3);
    return std::to_string(n);
}

std::string workTable(const Ledger& work)
{
    constexpr const char* kBeside = "output";  // goes on while the steps do: what they stood still for it is "wait"
    double total = 0;
    for (const StageWork& s : work.stages())
        if (s.name != kBeside) total += s.seconds;
    std::string text = fmt::format("{:<10}{:>10}{:>8}  {}\n", "stage", "seconds", "share", "work");
    for (const StageWork& s : work.stages()) {
        std::string counts;
        for (const auto& [what, n] : s.counts)
            counts += fmt::format("{}{} {}", counts.empty() ? "" : ", ", amount(n), what);
        std::replace(counts.begin(), counts.end(), '_', ' ');
        const std::string share =
            s.name == kBeside ? "beside" : fmt::format("{:.1f}%", total > 0 ? 100 * s.seconds / total : 0.);
        text += fmt::format("{:<10}{:>10.2f}{:>8}  {}\n", s.name, s.seconds, share, counts);
    }
    return text + fmt::format("{:<10}{:>10.2f}", "all", total);
}

/// Were cracks looked for, and none found?
bool nothingTore(const Ledger& work)
{
    return work.countOf("fracture", "calls") > 0 && work.countOf("fracture", "moved_voxels") == 0;
}

/// How near it came, where the driver measures that.
std::string nearestToTearing(const std::vector<core::StepRecord>& steps)
{
    double most = 0;
    for (const core::StepRecord& s : steps)
        if (const auto factor = s.measured.find("fracture_load_factor"); factor != s.measured.end())
            most = std::max(most, 1 / factor->second);
    return most > 0 ? fmt::format("nothing tore: loads reached {:.2g} of what it takes\n", most)
                    : std::string(
                          "nothing tore: loads did not come to half of what it takes, or the driver does not tell (see "
                          "fracture_load_factor in docs/output.md)\n");
}

/// Steps that were cut back, and what takes fewer of them where something is crushed.
std::string cutBackText(const std::vector<core::StepRecord>& steps, const Ledger& work)
{
    constexpr double kMany = .03;  // of the steps
    double shortest = INFINITY;
    std::size_t count = 0;
    for (const core::StepRecord& s : steps)
        if (s.cutbacks > 0) ++count, shortest = std::min(shortest, s.dt);
    if (count == 0) return "";
    const auto has = [&](const char* stage) { return work.countOf(stage, "calls") > 0; };
    const bool isCrushed =
        double(count) > kMany * double(steps.size()) && (has("contact") || has("collider")) && !has("volume");
    return fmt::format("cut back: {} of {}, down to {:.2e} s{}\n", count, counted(steps.size(), "step"), shortest,
                       isCrushed ? "; where something is crushed, [volume] takes fewer" : "");
}

std::string madeText(const std::vector<core::StepRecord>& steps, MadeEnergy made)
{
    for (const core::StepRecord& s : steps) made.add(s);
    if (!made.isMuch()) return "";
    return fmt::format("energy: the integrator has made {:.2g} % of the most that there was (integrator_J)\n",
                       100 * made.share());
}

/// What did not go as it should: steps that were cut back or are not solved, cracks that were held back. A line each.
std::string shortcomings(const std::vector<core::StepRecord>& steps, const MadeEnergy& none, const Ledger& work)
{
    double worst = 0, best = 0;
    for (const core::StepRecord& s : steps) {
        if (s.outcome != core::Outcome::capped) continue;
        worst = std::max(worst, s.residual), best = std::max(best, s.minResidual);
    }
    std::string text;
    if (nothingTore(work)) text += nearestToTearing(steps);
    text += cutBackText(steps, work);
    if (anyCapped(steps) && worst == 0)
        text +=
            "capped: steps flew apart, or something passed into something else in them; explicit integrators need "
            "shorter ones (time.substeps)\n";
    else if (anyCapped(steps))
        text +=
            fmt::format("capped: relative residuals up to {:.2g}, of the best iterates up to {:.2g}\n", worst, best);
    if (const double share = core::maxUnnamedShare(steps); share > core::kMaxUnnamedShare)
        text += fmt::format("energy: up to {:.2g} % of the work put in has no account, {:.2g} % at the end\n",
                            100 * share, 100 * steps.back().unnamedShare);
    text += madeText(steps, none);
    std::int64_t held = 0;
    for (const StageWork& stage : work.stages()) held += work.countOf(stage.name, "held_back");
    if (held > 0)
        text += fmt::format("held back: in {} time.front_cfl let cracks run slower than the material would\n",
                            counted(held, "step"));
    return text;
}

/// Elasticity that is linear in strain does not resist the last of a squeeze, and frames show it.
std::string squeezeText(const std::vector<core::FrameRecord>& frames)
{
    constexpr double kMuch = .8;  // of the volume
    const auto least = std::ranges::min_element(frames, {}, &core::FrameRecord::squeeze);
    if (least == frames.end() || least->squeeze > kMuch) return "";
    if (least->squeeze <= 0) return fmt::format("squeezed: in frame {} a body is inside out\n", least->frame);
    return fmt::format(
        "squeezed: in frame {} a body has {:.0f} % of its volume; [volume], stiffer materials or slower motion keep "
        "more\n",
        least->frame, 100 * least->squeeze);
}

/// Cracks take half a voxel and more; where material is crushed they take it whole.
std::string lostText(double lost)
{
    constexpr double kMuch = 5;  // %
    if (!(lost > kMuch)) return "";
    return std::string("lost: cracks take half a voxel and more, and all that is crushed; ") + kWhatKeepsMaterial +
           "\n";
}

/// How deep fragments were in each other and in themselves, where a picture may show it.
std::string overlapText(const std::vector<core::StepRecord>& steps, double voxelSize)
{
    // Voxels, share of it that was there in the first step, and voxels: less is a gap at rest that is nearly none.
    constexpr double kSeen = .2, kBegan = .5, kBeganIn = .5;
    struct Overlap {
        const char *column, *what, *table;
    };
    std::string text, tables, began;
    for (const auto& [column, what, table] : {Overlap{"contact_depth_m", "in each other", "[contact]"},
                                              Overlap{"contact_self_depth_m", "in themselves", "[contact]"},
                                              Overlap{"collider_depth_m", "in colliders", "[[collider]]"}}) {
        const auto depthIn = [column](const core::StepRecord& s) {
            const auto depth = s.measured.find(column);
            return depth != s.measured.end() ? depth->second : 0;
        };
        const auto most = std::ranges::max_element(steps, {}, depthIn);
        const double deepest = most != steps.end() ? depthIn(*most) : 0;
        if (!(deepest > kSeen * voxelSize)) continue;
        if (depthIn(steps.front()) >= std::max(kBegan * deepest, kBeganIn * voxelSize))
            began = table == std::string("[[collider]]")
                        ? "; what begins in a collider stays there without untangle_speed: is its normal turned round?"
                        : "; bodies that begin in each other stay so without untangle_speed, and are not joined";
        if (tables.find(table) == std::string::npos) tables += (tables.empty() ? "" : " and ") + std::string(table);
        text += fmt::format("{}up to {:.2g} voxels {} (at {:.4g} s)", text.empty() ? "overlap: surfaces were " : ", ",
                            deepest / voxelSize, what, most->time);
    }
    if (text.empty()) return text;
    return text + "; slower motion, or more stiffness of " + tables +
           " (which takes more and shorter steps), reduces most of it" + began + "\n";
}

/// Surfaces that renderers would show torn up.
std::string drawnText(const Ledger& work)
{
    const std::int64_t bridges = work.countOf("draw", "bridges"), gaps = work.countOf("draw", "defects");
    if (bridges + gaps == 0) return "";
    return fmt::format(
        "drawn: over all frames {} faces join two fragments, and surfaces have {} gaps; look at them, "
        "a smaller grid.voxel_size may help\n",
        bridges, gaps);
}

std::string pointText(const Vec3& p) { return fmt::format("({:.4g}, {:.4g}, {:.4g})", p.x(), p.y(), p.z()); }

Bounds boundsOf(const core::Body& body)
{
    const std::vector<Vec3> rest = tetmesh::restPositions(*body.mesh);
    Bounds bounds{Vec3::Constant(INFINITY), Vec3::Constant(-INFINITY)};
    for (const tetmesh::EmbeddedPoint& p : body.mesh->surface().points) {
        const Vec3 X = p.at(rest);
        bounds.lower = bounds.lower.cwiseMin(X), bounds.upper = bounds.upper.cwiseMax(X);
    }
    return bounds;
}

std::string bodyTexts(const core::Simulation& simulation)
{
    std::string text;
    for (const core::Body& body : simulation.bodies()) {
        const Bounds bounds = boundsOf(body);
        text += fmt::format(
            "  body '{}': {:.4g} m^3, {} elements, {} nodes, {} voxels in the band, {} {}\n    from {} to {} m\n",
            body.name, body.startVolume, body.mesh->elements().size(), body.mesh->nodeCount(), body.phi.activeVoxels(),
            body.fragments.alive(), body.fragments.alive() == 1 ? "fragment" : "fragments", pointText(bounds.lower),
            pointText(bounds.upper));
    }
    return text;
}

std::string gripTexts(const scene::Scene& scene, const core::Simulation* simulation)
{
    std::string text;
    for (std::size_t g = 0; g < scene.grips.size(); ++g) {
        text += fmt::format("  grip '{}' on '{}'", scene.grips[g].name, scene.grips[g].body);
        if (simulation) text += fmt::format(": {} nodes", simulation->gripNodes(g).size());
        text += "\n";
    }
    return text;
}

std::string bodyTexts(const core::SceneEstimate& estimate)
{
    std::string text;
    for (const core::BodyEstimate& e : estimate.bodies) {
        const Bounds bounds = e.bounds();
        text += fmt::format("  body '{}': about {:.3g} m^3, {} nodes and {} tets\n    from about {} to {} m\n",
                            e.body->name, e.volume, amount(std::int64_t(e.nodes)), amount(std::int64_t(e.tets)),
                            pointText(bounds.lower), pointText(bounds.upper));
    }
    return text;
}

/// "backward_euler" as people write it.
std::string integratorText(scene::Integrator integrator)
{
    std::string name = nameOf(integrator);
    std::replace(name.begin(), name.end(), '_', ' ');
    if (const std::size_t at = name.find("euler"); at != std::string::npos) name[at] = 'E';
    return name;
}

}  // namespace

std::string planText(const scene::Scene& scene, const core::SceneEstimate& estimate, const core::Simulation* simulation)
{
    std::string text = fmt::format("scene '{}': frames {}-{} at {} fps, {} steps a frame\n", scene.name,
                                   scene.time.firstFrame, scene.time.lastFrame, scene.time.fps,
                                   scene.time.substeps > 0 ? std::to_string(scene.time.substeps) : std::string("auto"));
    text += simulation ? bodyTexts(*simulation) : bodyTexts(estimate);
    text += gripTexts(scene, simulation);
    text += fmt::format("memory: about {:.2f} GiB\n", estimate.bytes / lab::kGiB);
    text += "stages:\n  cut           on   elements from phi\n";
    text += fmt::format("  solve         on   {}elasticity, {}\n",
                        scene.solver.integrator == scene::Integrator::statics ? "" : "inertia and ",
                        integratorText(scene.solver.integrator));
    text += scene.grips.empty() ? "  grips         off  no [[grip]] in the scene\n"
                                : fmt::format("  grips         on   {} of them\n", scene.grips.size());
    for (const effects::EffectInfo& info : effects::effectList()) {
        const std::string table =
            info.inScene ? fmt::format("[[{}]]", info.table.name) : fmt::format("[{}]", info.table.name);
        text += effects::isNamed(info, scene)
                    ? fmt::format("  {:<13} on   joins: {}\n", info.table.name, info.stages)
                    : fmt::format("  {:<13} off  no {} in the scene\n", info.table.name, table);
    }
    for (const std::string& note : effects::notesOf(scene)) text += "note: " + note + "\n";
    if (!simulation)
        return text +
               "note: estimated; what thin parts, overlaps and effects have to say is told when the run begins\n";
    for (const std::string& note : simulation->stages().notes) text += "note: " + note + "\n";
    return text;
}

std::string unsolvedPlace(const core::StepRecord& s)
{
    if (!s.measured.contains("unsolved_x_m")) return "";
    const auto at = [&](const char* axis) { return s.measured.at(std::string("unsolved_") + axis + "_m"); };
    return fmt::format(", worst at [{:.4g}, {:.4g}, {:.4g}] m at rest", at("x"), at("y"), at("z"));
}

std::string cappedText(const core::StepRecord& s)
{
    if (s.newtonIterations == 0)
        return fmt::format(
            "step {}: it flies apart, or something has passed into something else; explicit integrators need shorter "
            "steps (time.substeps)",
            s.step);
    return fmt::format(
        "step {}: the solver hit its caps (relative residual {:.2g}, of the best iterate {:.2g}){}; the last iterate "
        "was "
        "kept",
        s.step, s.residual, s.minResidual, unsolvedPlace(s));
}

std::string stepText(const core::StepRecord& s)
{
    return fmt::format("step {}  t {:.4f} s  dt {:.2e} s  newton {}  cg {}{}  {} frag.", s.step, s.time, s.dt,
                       s.newtonIterations, s.linearIterations,
                       s.cutbacks > 0 ? fmt::format("  cut back {}x", s.cutbacks) : "", s.fragments);
}

void MadeEnergy::add(const core::StepRecord& step)
{
    const auto integrator = step.energyFlow.find("integrator");
    if (integrator != step.energyFlow.end()) made_ -= integrator->second;
    most_ = std::max(most_, step.kineticEnergy + step.elasticEnergy);
}

bool MadeEnergy::isMuch() const
{
    constexpr double kMuch = .05;
    return makes_ && share() > kMuch;
}

bool anyCapped(const std::vector<core::StepRecord>& steps)
{
    return std::any_of(steps.begin(), steps.end(),
                       [](const core::StepRecord& s) { return s.outcome == core::Outcome::capped; });
}

std::string summaryText(const scene::Scene& scene, const core::Simulation& simulation, const core::RunFolder& folder,
                        const Ledger& work)
{
    const auto count = [&](core::Outcome o) {
        return std::count_if(folder.steps().begin(), folder.steps().end(),
                             [o](const core::StepRecord& s) { return s.outcome == o; });
    };
    std::int64_t gone = 0;
    for (const core::Body& body : simulation.bodies())
        gone += std::ranges::count(body.fragments.fragments(), 0., &tetmesh::Fragment::restVolume);
    const double lost = 100 * (1 - simulation.volume() / simulation.startVolume());
    std::string text =
        fmt::format("{}, {}: {} converged, {} cut back, {} capped\n", counted(folder.frames().size(), "frame"),
                    counted(folder.steps().size(), "step"), count(core::Outcome::converged),
                    count(core::Outcome::cutback), count(core::Outcome::capped));
    text += fmt::format("{}; {:.2f} % of the material lost to cracks; peak memory {:.2f} GiB; state {}\n",
                        counted(simulation.fragments(), "fragment"), lost, double(lab::peakMemory()) / lab::kGiB,
                        folder.frames().empty() ? "-" : folder.frames().back().stateHash);
    if (gone > 0) text += fmt::format("{} consumed by cracks\n", counted(gone, "more fragment"));
    text += lostText(lost);
    if (const std::string& lacks = folder.pointCacheLacks(); !lacks.empty()) text += "point cache: " + lacks + "\n";
    text += shortcomings(folder.steps(), {scene.solver.integrator, core::energyOfNoise(simulation.bodies())}, work) +
            overlapText(folder.steps(), simulation.bodies()[0].phi.voxelSize()) + squeezeText(folder.frames()) +
            drawnText(work) + workTable(work);
    return text + "\nwritten to " + folder.path().string();
}

}  // namespace vdbfrac::cli
