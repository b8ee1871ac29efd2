#include <vdbfrac/report/run_frames.h>

#include <vdbfrac/base/error.h>

#include <algorithm>

namespace vdbfrac::report {

namespace {

RunFrame frameOf(const Json& json, const std::filesystem::path& folder)
{
    RunFrame f;
    f.frame = json.at("frame").get<int>();
    f.time = json.at("time").get<double>();
    if (json.contains("bounds"))
        for (const Json& corner : json.at("bounds"))
            f.bounds.emplace_back(corner.at(0).get<double>(), corner.at(1).get<double>(), corner.at(2).get<double>());
    for (const Json& file : json.at("files")) {
        const auto path = file.at("path").get<std::string>();
        f.files.emplace_back(folder / path, file.at("bytes").get<std::uintmax_t>());
        if (path.ends_with(".obj")) f.obj = folder / path;
        if (path.ends_with(".ply")) f.ply = folder / path;
        if (path.ends_with(".vdb")) f.vdb = folder / path;
    }
    return f;
}

}  // namespace

RunFrames framesOf(const Json& manifest, const std::filesystem::path& folder)
{
    try {
        RunFrames run{.scene = manifest.at("scene").get<std::string>(),
                      .lastFrame = manifest.at("frame_range").at(1).get<int>(),
                      .voxelSize = manifest.at("voxel_size").get<double>(),
                      .frames = {}};
        for (const Json& frame : manifest.at("frames")) run.frames.push_back(frameOf(frame, folder));
        return run;
    } catch (const Json::exception& e) {
        throw badManifest(folder, e);
    }
}

RunFrames readRunFrames(const std::filesystem::path& folder) { return framesOf(readManifest(folder), folder); }

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

}  // namespace vdbfrac::report
