#include "accuracy.h"

#include "accuracy_data.h"

#include <vdbfrac/effects/effects.h>

#include <fmt/format.h>

#include <algorithm>

namespace vdbfrac::cli {

namespace {

/// Factors on keys of a scene: those of the series "accuracy" in cantilever.toml and notched_block_resolution.toml of
/// data/scenes/studies, which a test compares them with.
struct Level {
    const char* name;
    double voxelSize, substeps, newtonTolerance;
    AccuracyData measured;
};
const Level kLevels[] = {{"draft", 2, 0.5, 10, kDraft}, {"normal", 1, 1, 1, kNormal}, {"fine", 2. / 3, 2, 1, kFine}};

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
    const std::string substeps =
        scene.time.substeps > 0 ? std::to_string(scene.time.substeps) + " steps a frame" : "automatic time steps";
    std::string text = fmt::format("accuracy {}: voxels of {:.3g} m, {}, Newton tolerance {:.1g}. ", name,
                                   scene.grid.voxelSize, substeps, scene.solver.newtonTolerance);
    text += fmt::format("A bent beam that normal makes four voxels thick was off by {:.2g} % of the elastica",
                        100 * m.bending);
    if (effects::canTear(scene))
        text += fmt::format(
            "; a block that tears, by {:.2g} % in peak load and {:.2g} % in work of one with the finest voxels tried",
            100 * m.peakLoad, 100 * m.work);
    return text + fmt::format("; {:.2g} times the time of normal (docs/accuracy.md)", m.time);
}

}  // namespace vdbfrac::cli
