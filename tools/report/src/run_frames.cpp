#include "run_frames.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/report/record.h>

#include <nlohmann/json.hpp>

#include <algorithm>

namespace vdbfrac::cli {

RunFrames readRunFrames(const std::filesystem::path& folder)
{
    const std::filesystem::path manifest = report::manifestIn(folder);
    RunFrames run;
    try {
        const auto json = nlohmann::json::parse(readText(manifest));
        run.scene = json.at("scene").get<std::string>();
        run.lastFrame = json.at("frame_range").at(1).get<int>();
        run.voxelSize = json.at("voxel_size").get<double>();
        for (const auto& frame : json.at("frames")) {
            RunFrame& f = run.frames.emplace_back();
            f.frame = frame.at("frame").get<int>();
            if (frame.contains("bounds"))
                for (const auto& corner : frame.at("bounds"))
                    f.bounds.emplace_back(corner.at(0).get<double>(), corner.at(1).get<double>(),
                                          corner.at(2).get<double>());
            for (const auto& file : frame.at("files")) {
                const auto path = file.at("path").get<std::string>();
                f.files.emplace_back(folder / path, file.at("bytes").get<std::uintmax_t>());
                if (path.ends_with(".obj")) f.obj = folder / path;
                if (path.ends_with(".ply")) f.ply = folder / path;
                if (path.ends_with(".vdb")) f.vdb = folder / path;
            }
        }
    } catch (const nlohmann::json::exception& e) {
        throw InputError({manifest.string(), std::string("is not the manifest of a run: ") + e.what(), "",
                          "give the folder that 'vdbfrac sim -o' wrote"});
    }
    return run;
}

int frameWithin(const std::filesystem::path& run, int frame, const char* option)
{
    const RunFrames all = readRunFrames(run);
    const int last = all.frames.empty() ? all.lastFrame : all.frames.back().frame;
    if (frame > last)
        throw InputError({option, run.string() + " ends at frame " + std::to_string(last), "a frame up to there", ""});
    return frame;
}

void requireWhole(const RunFrame& frame, const std::filesystem::path& file)
{
    const auto written = std::ranges::find(frame.files, file, &std::pair<std::filesystem::path, std::uintmax_t>::first);
    if (written == frame.files.end()) return;  // it has none
    std::error_code error;
    const std::uintmax_t there = std::filesystem::file_size(file, error);
    if (error) throw FileError(file.string(), error.message());
    if (there < written->second)  // longer ones were edited
        throw FileError(file.string(), "is cut off: it has " + std::to_string(there) + " bytes, the run wrote " +
                                           std::to_string(written->second));
}

}  // namespace vdbfrac::cli
