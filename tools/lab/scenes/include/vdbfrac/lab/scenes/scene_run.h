// Whole scenes run in memory, from their text.
#pragma once

#include <vdbfrac/base/ledger.h>
#include <vdbfrac/lab/scenes/prepared_scene.h>

#include <string>
#include <vector>

namespace vdbfrac::lab {

/// A simulation with the effects that its scene names, and one that looks on.
class SceneRun : public PreparedScene {
public:
    explicit SceneRun(const std::string& text, const std::vector<std::string>& set = {},
                      core::Effect* witness = nullptr);

    /// One step that ends with the next frame at the latest, as 'vdbfrac sim' steps; its record stays at the end of
    /// `steps`.
    const core::StepRecord& step();
    /// Steps to the end of a frame.
    void toFrame(int frame);
    void toEnd() { toFrame(scene.time.lastFrame); }

    /// Largest load [N] of a grip along an axis.
    double peakLoad(std::size_t grip, int axis) const;

    std::vector<core::StepRecord> steps;
    Ledger work;
};

}  // namespace vdbfrac::lab
