// Whole scenes run in memory.
#pragma once

#include <vdbfrac/core/simulation.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/scene/reader.h>

#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace vdbfrac::test {

/// A simulation with the effects that its scene names, and one that looks on.
class SceneRun {
public:
    explicit SceneRun(const std::string& text, const std::vector<std::string>& set = {}, core::Effect* witness = nullptr)
        : scene(scene::parseScene(text, "test.toml", effects::effectTables(), set)), effects_(effects::makeEffects(scene))
    {
        std::vector<core::Effect*> pointers;
        for (const auto& e : effects_) pointers.push_back(e.get());
        if (witness) pointers.push_back(witness);
        simulation = std::make_unique<core::Simulation>(scene, pointers, std::numeric_limits<std::uint64_t>::max());
    }

    /// Steps to the end of a frame; records pile up in `steps`.
    void toFrame(int frame)
    {
        const double end = (frame - scene.time.firstFrame) / scene.time.fps;
        while (simulation->time() < end - 1e-9 / scene.time.fps) {
            steps.push_back(simulation->step(end));
            work.add(steps.back().work);
        }
    }
    void toEnd() { toFrame(scene.time.lastFrame); }

    /// Largest load [N] of a grip along an axis.
    double peakLoad(std::size_t grip, int axis) const
    {
        double peak = 0;
        for (const core::StepRecord& s : steps) peak = std::max(peak, s.gripLoad[grip][axis]);
        return peak;
    }

    scene::Scene scene;
    std::unique_ptr<core::Simulation> simulation;
    std::vector<core::StepRecord> steps;
    Ledger work;

private:
    std::vector<std::unique_ptr<core::Effect>> effects_;
};

}  // namespace vdbfrac::test
