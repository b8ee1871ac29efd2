#include "accuracy.h"

#include "accuracy_data.h"

#include <algorithm>
#include <cstdio>

namespace vdbfrac::tools {

namespace {

/// Factors on keys of a scene: those of the series "accuracy" of data/scenes/studies/notched_block_resolution.toml, which a
/// test compares them with.
struct Level {
    const char* name;
    double voxelSize, substeps, newtonTolerance;
    AccuracyData measured;
};
const Level kLevels[] = {{"draft", 2, 0.5, 10, kDraft}, {"normal", 1, 1, 1, kNormal}, {"fine", 2. / 3, 2, 0.1, kFine}};

const Level& find(const std::string& name)
{
    return *std::find_if(std::begin(kLevels), std::end(kLevels), [&](const Level& l) { return l.name == name; });
}

}  // namespace

std::vector<std::string> accuracyLevels()
{
    std::vector<std::string> names;
    for (const Level& level : kLevels) names.emplace_back(level.name);
    return names;
}

void setAccuracy(scene::Scene& scene, const std::string& name)
{
    const Level& level = find(name);
    scene.grid.voxelSize *= level.voxelSize;
    if (scene.time.substeps > 0) scene.time.substeps = std::max(1, int(level.substeps * scene.time.substeps));
    scene.solver.newtonTolerance = std::min(0.5, level.newtonTolerance * scene.solver.newtonTolerance);
}

std::string accuracyText(const scene::Scene& scene, const std::string& name)
{
    const AccuracyData& m = find(name).measured;
    const std::string substeps = scene.time.substeps > 0 ? std::to_string(scene.time.substeps) + " steps a frame" : "automatic time steps";
    char text[320];
    std::snprintf(text, sizeof text,
                  "accuracy %s: voxels of %.3g m, %s, Newton tolerance %.1g. On a notched block this level was off by %.2g %% in peak load "
                  "and %.2g %% in work to tear it, in %.2g times the time of normal (docs/accuracy.md)",
                  name.c_str(), scene.grid.voxelSize, substeps.c_str(), scene.solver.newtonTolerance, 100 * m.peakLoad, 100 * m.work, m.time);
    return text;
}

}  // namespace vdbfrac::tools
