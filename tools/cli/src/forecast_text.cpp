#include "forecast_text.h"

#include "progress.h"

#include <vdbfrac/base/number_text.h>
#include <vdbfrac/base/parallel.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::cli {

namespace {

std::string bytesText(double bytes)
{
    constexpr double kKilo = 1000;
    const char* const units[] = {"kB", "MB", "GB", "TB"};
    int unit = 0;
    for (bytes /= kKilo; bytes >= kKilo && unit < 3; ++unit) bytes /= kKilo;
    return fmt::format("{:.3g} {}", bytes, units[unit]);
}

bool tearsOrTouches(const scene::Scene& scene) { return scene.table("fracture") || scene.table("contact"); }

/// What a forecast was made from.
std::string sourceText(const scene::Scene& scene, const lab::Forecast& f)
{
    const std::string own = f.measuredSteps > 0 ? fmt::format("{} steps of this scene", f.measuredSteps) : "";
    constexpr double kAll = 0.995;  // what is told as 100 %
    const char* caveat = "";
    if (f.simulatedShare < kAll)
        caveat = "; what touches or tears after them costs more";
    else if (f.wider > 1 && tearsOrTouches(scene))
        caveat = "; where thin parts tear or touch on the finer voxels only, it takes several times as long";
    if (f.wider == 1) return own + fmt::format(", {:.0f} % of its frames{}", 100 * f.simulatedShare, caveat);
    return fmt::format("{}{}{:.0f} % of the frames on voxels {:.3g} times as wide{}", own, own.empty() ? "" : ", and ",
                       100 * f.simulatedShare, f.wider, caveat);
}

}  // namespace

std::string durationText(double seconds) { return seconds < 60 ? fmt::format("{:.2g} s", seconds) : duration(seconds); }

std::string forecastText(const scene::Scene& scene, const lab::Forecast& f)
{
    const int frames = scene.time.lastFrame - scene.time.firstFrame + 1, threads = threadCount();
    constexpr double kHalf = .5, kOff = 4;  // from few frames a forecast may be off by as much (docs/measured.md)
    const std::string time = f.simulatedShare < kHalf ? fmt::format("between {} and {}", durationText(f.seconds / kOff),
                                                                    durationText(kOff * f.seconds))
                                                      : "about " + durationText(f.seconds);
    return fmt::format("time: {} on {}, {:.0f} steps that take {:.2g} s each; from {}\n", time,
                       counted(threads, "thread"), f.steps, f.seconds / std::max(1., f.steps), sourceText(scene, f)) +
           fmt::format("disk: about {}: {} frames of {}, checkpoints of {}\n", bytesText(f.bytes), frames,
                       bytesText(f.frameBytes), bytesText(f.checkpointBytes));
}

std::string filesText(const scene::Scene& scene)
{
    const scene::Output& o = scene.output;
    const std::string numbers = fmt::format("{:04}-{:04}", scene.time.firstFrame, scene.time.lastFrame);
    std::string text = "files: run.json, stats.csv, scene.toml, run.log, ckpt/";
    if (!o.vdb.empty()) text += fmt::format(", vdb/{}.{}.vdb ({})", scene.name, numbers, fmt::join(o.vdb, ", "));
    if (o.obj) text += fmt::format(", obj/{}.{}.obj", scene.name, numbers);
    if (o.ply) text += fmt::format(", ply/{}.{}.ply", scene.name, numbers);
    if (o.followsNodes()) text += fmt::format(", motion/{}.{}.motion", scene.name, numbers);
    for (const std::string& kind : o.pointCache)
        text += ", cache/" + scene.name + (kind == "mdd" ? ".obj, .mtl, .mdd" : ".usda");
    return text + "\n";
}

}  // namespace vdbfrac::cli
