// Whole scenes run in memory, for the tests and for the hard cases of 'vdbfrac verify'.
#pragma once

#include <vdbfrac/core/simulation.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/scene/reader.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace vdbfrac::test {

/// A simulation with the effects that its scene names, and one that looks on.
class SceneRun {
public:
    explicit SceneRun(const std::string& text, const std::vector<std::string>& set = {},
                      core::Effect* witness = nullptr)
        : scene(scene::parseScene(text, "test.toml", effects::vocabulary(), set)), effects_(effects::makeEffects(scene))
    {
        std::vector<core::Effect*> pointers;
        for (const auto& e : effects_) pointers.push_back(e.get());
        if (witness) pointers.push_back(witness);
        simulation = std::make_unique<core::Simulation>(scene, pointers, std::numeric_limits<std::uint64_t>::max());
    }

    /// One step that ends with the next frame at the latest, as 'vdbfrac sim' steps; its record stays at the end of
    /// `steps`.
    const core::StepRecord& step()
    {
        steps.push_back(simulation->stepInFrame());
        work.add(steps.back().work);
        return steps.back();
    }
    int framesDone() const { return simulation->framesDone(); }
    bool atEnd() const { return framesDone() >= scene.time.lastFrame - scene.time.firstFrame; }

    /// Steps to the end of a frame.
    void toFrame(int frame)
    {
        while (framesDone() < frame - scene.time.firstFrame) step();
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
