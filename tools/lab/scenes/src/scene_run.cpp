#include <vdbfrac/lab/scenes/scene_run.h>

#include <vdbfrac/effects/effects.h>
#include <vdbfrac/scene/reader.h>

#include <algorithm>
#include <limits>

namespace vdbfrac::lab {

SceneRun::SceneRun(const std::string& text, const std::vector<std::string>& set, core::Effect* witness)
    : PreparedScene(scene::parseScene(text, "test.toml", effects::vocabulary(), set),
                    std::numeric_limits<std::uint64_t>::max(), witness)
{
}

const core::StepRecord& SceneRun::step()
{
    steps.push_back(simulation.stepInFrame());
    work.add(steps.back().work);
    return steps.back();
}

void SceneRun::toFrame(int frame)
{
    while (simulation.framesDone() < frame - scene.time.firstFrame) step();
}

double SceneRun::peakLoad(std::size_t grip, int axis) const
{
    double peak = 0;
    for (const core::StepRecord& s : steps) peak = std::max(peak, s.gripLoad[grip][axis]);
    return peak;
}

}  // namespace vdbfrac::lab
