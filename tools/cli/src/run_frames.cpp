#include "run_frames.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/report/record.h>

#include <nlohmann/json.hpp>

namespace vdbfrac::cli {

RunFrames readRunFrames(const std::filesystem::path& folder)
{
    const std::filesystem::path manifest = report::manifestIn(folder);
    RunFrames run;
    try {
        const auto json = nlohmann::json::parse(readText(manifest));
        run.scene = json.at("scene").get<std::string>();
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

}  // namespace vdbfrac::cli
