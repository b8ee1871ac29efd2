#include "run_info.h"

#include "options.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/folder_lock.h>
#include <vdbfrac/base/hash.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/grid/vdb_file.h>
#include <vdbfrac/lab/machine/memory.h>
#include <vdbfrac/report/record.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace vdbfrac::cli {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;

struct File {
    std::string path, checksum;
    std::uint64_t bytes = 0;
};

void requireReadable(const fs::path& file)
{
    if (isVdb(file)) grid::describeVdb(file);
    if (file.extension() == ".obj") tetmesh::readObjFrame(file);
}

/// What is wrong with a file of a run; empty when nothing is.
std::string flaw(const fs::path& folder, const File& file, bool verify)
{
    const fs::path path = folder / file.path;
    std::error_code error;
    if (!liesBelow(file.path)) return "does not lie in the folder";
    if (!fs::is_regular_file(path, error)) return "missing";
    if (fs::file_size(path, error) != file.bytes || error) return "damaged: has another size than when it was written";
    if (!verify) return "";
    try {
        const std::string content = readText(path);
        if (hexadecimal(hashBytes(content.data(), content.size())) != file.checksum)
            return "damaged: has another checksum than when it was written";
        requireReadable(path);
    } catch (const Error& e) {
        return std::string("damaged: ") + e.what();
    }
    return "";
}

/// Are all files of a list? Adds what is wrong with them to `flaws`.
bool areWhole(const Json& files, const fs::path& folder, bool verify, Json& flaws)
{
    bool whole = true;
    for (const Json& entry : files) {
        const File file{entry.at("path").get<std::string>(), entry.at("xxh3").get<std::string>(),
                        entry.at("bytes").get<std::uint64_t>()};
        const std::string what = flaw(folder, file, verify);
        if (what.empty()) continue;
        whole = false;
        flaws.push_back({{"path", file.path}, {"flaw", what}});
    }
    return whole;
}

std::string orNone(const std::string& text) { return text.empty() ? "none" : text; }

/// Looks at the files of all frames; adds which are there, flawed or not written, of those that were asked for, and
/// "flaws".
void addFrames(const Json& manifest, const fs::path& folder, bool verify, RunInfo& info)
{
    std::vector<int> whole, broken;
    std::string missing;
    std::int64_t next = manifest.at("frame_range").at(0).get<int>();
    const std::int64_t last = manifest.at("frame_range").at(1).get<int>();
    const auto skipTo = [&](std::int64_t frame) {
        if (next < frame) missing += (missing.empty() ? "" : ", ") + rangeText(next, frame - 1);
        next = std::max(next, frame + 1);
    };
    Json flaws = Json::array();
    for (const Json& frame : manifest.at("frames")) {
        const int number = frame.at("frame").get<int>();
        (areWhole(frame.at("files"), folder, verify, flaws) ? whole : broken).push_back(number);
        skipTo(std::min<std::int64_t>(number, last + 1));
    }
    skipTo(last + 1);
    if (manifest.contains("point_cache")) areWhole(manifest.at("point_cache"), folder, verify, flaws);
    info.json["frames"] = orNone(rangesText(whole, ", "));
    info.json["frames_with_flaws"] = orNone(rangesText(broken, ", "));
    info.json["frames_missing"] = orNone(missing);
    info.sound = flaws.empty();
    if (!flaws.empty()) info.json["flaws"] = flaws;
}

/// The checkpoints, and their flaws.
void addCheckpoints(const fs::path& folder, bool verify, RunInfo& info)
{
    Json list = Json::array();
    for (const fs::path& file : core::checkpointsIn(folder)) {
        const std::string path = fs::relative(file, folder).string();
        list.push_back(path);
        if (!verify) continue;
        try {
            core::verifyCheckpoint(file, lab::defaultMemoryLimit());
        } catch (const Error& e) {
            if (!fs::exists(file)) continue;  // the run goes on, and has others now
            info.json["flaws"].push_back({{"path", path}, {"flaw", e.what()}});
            info.sound = false;
        }
    }
    info.json["checkpoints"] = list;
}

/// Does a program on this machine write into a folder?
bool isWritten(const fs::path& folder)
{
    try {
        const FolderLock lock(folder);
        return false;
    } catch (const FileError&) {
        return true;
    }
}

}  // namespace

RunInfo runInfo(const fs::path& folder, bool verify)
{
    RunInfo info;
    try {
        const Json manifest = Json::parse(readText(report::manifestIn(folder)));
        info.json = {{"folder", folder.string()}, {"kind", "run"}};
        for (const char* key :
             {"creator", "scene", "status", "fps", "voxel_size", "frame_range", "steps", "start_volume", "volume"})
            info.json[key] = manifest.at(key);
        if (info.json["status"] == "running" && !isWritten(folder))
            info.json["status"] = "running, but nothing on this machine writes into it: killed, if not on another";
        if (const auto error = manifest.find("error"); error != manifest.end()) info.json["error"] = *error;
        addFrames(manifest, folder, verify, info);
        addCheckpoints(folder, verify, info);
        info.json["verified"] = !info.sound ? "no, there are flaws"
                                : verify    ? "all checksums"
                                            : "sizes only; --verify compares checksums";
        info.json["fragments"] = manifest.at("fragments");
    } catch (const Json::exception& e) {
        throw report::badManifest(folder, e);
    }
    return info;
}

}  // namespace vdbfrac::cli
