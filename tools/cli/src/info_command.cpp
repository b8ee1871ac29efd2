// vdbfrac info: what a file or a run holds.
#include "options.h"
#include "run_info.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/cli/commands.h>
#include <vdbfrac/grid/vdb_file.h>
#include <vdbfrac/lab/machine/memory.h>
#include <vdbfrac/tetmesh/surface_input.h>

#include <cstdio>

namespace vdbfrac::cli {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;

Json gridJson(const grid::GridInfo& g)
{
    Json json = {{"name", g.name},
                 {"type", g.type},
                 {"class", g.gridClass},
                 {"voxel_size", g.voxelSize},
                 {"active_voxels", g.activeVoxels}};
    if (g.background) json["background"] = *g.background;
    if (g.activeVoxels > 0) {
        json["lower_voxel"] = {g.lower.x, g.lower.y, g.lower.z};
        json["upper_voxel"] = {g.upper.x, g.upper.y, g.upper.z};
        json["lower"] = {g.lowerWorld.x(), g.lowerWorld.y(), g.lowerWorld.z()};
        json["upper"] = {g.upperWorld.x(), g.upperWorld.y(), g.upperWorld.z()};
    }
    json["metadata"] = Json::object();
    for (const auto& [key, value] : g.metadata) json["metadata"][key] = value;
    return json;
}

Json vdbInfo(const fs::path& file)
{
    Json grids = Json::array();
    for (const grid::GridInfo& g : grid::describeVdb(file, lab::defaultMemoryLimit())) grids.push_back(gridJson(g));
    return {{"file", file.string()}, {"kind", "vdb"}, {"grids", grids}};
}

Json meshInfo(const fs::path& file)
{
    const tetmesh::PolygonSoup soup = tetmesh::readSurface(file, lab::defaultMemoryLimit());
    const tetmesh::SurfaceReport r = tetmesh::examine(soup);
    Json json = {{"file", file.string()},
                 {"kind", "surface"},
                 {"points", soup.points.size()},
                 {"faces", soup.polygons.size()},
                 {"closed", r.closed},
                 {"open_edges", r.openEdges},
                 {"crowded_edges", r.nonManifoldEdges},
                 {"flat_faces", r.degenerateFaces},
                 {"area", r.area}};
    if (r.closed) json["volume"] = r.volume;
    json["lower"] = {r.lower.x(), r.lower.y(), r.lower.z()};
    json["upper"] = {r.upper.x(), r.upper.y(), r.upper.z()};
    return json;
}

bool isNested(const Json& value)
{
    return value.is_object() || (value.is_array() && !value.empty() && value[0].is_structured());
}

std::string dumped(const Json& json, int indent)
{
    return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

/// A line a value; what is nested is indented, and entries of lists are parted by a dash.
void print(const Json& json, const std::string& indent)
{
    if (json.is_array()) {
        for (const Json& entry : json) {
            if (isNested(entry)) {
                std::printf("%s-\n", indent.c_str());
                print(entry, indent + "  ");
            } else {
                std::printf("%s- %s\n", indent.c_str(), dumped(entry, -1).c_str());
            }
        }
        return;
    }
    for (const auto& [key, value] : json.items()) {
        if (isNested(value)) {
            std::printf("%s%s:\n", indent.c_str(), key.c_str());
            print(value, indent + "  ");
        } else {
            std::printf("%s%s: %s\n", indent.c_str(), key.c_str(),
                        value.is_string() ? value.get_ref<const std::string&>().c_str() : dumped(value, -1).c_str());
        }
    }
}

int info(const fs::path& path, bool asJson, bool verify)
{
    RunInfo run;
    const bool folder = fs::is_directory(path);
    if (folder)
        run = runInfo(path, verify);
    else
        run.json = isVdb(path) ? vdbInfo(path) : meshInfo(path);
    if (asJson)
        std::printf("%s\n", dumped(run.json, 1).c_str());
    else
        print(run.json, "");
    return run.sound ? kDone : kBadFile;
}

}  // namespace

Action addInfo(CLI::App& app)
{
    struct Options {
        std::string path;
        bool json = false, verify = false;
    };
    auto o = std::make_shared<Options>();
    CLI::App* c = app.add_subcommand("info", "Say what a .vdb, a surface or the folder of a run holds");
    c->add_option("PATH", o->path, "File, or folder that 'vdbfrac sim -o' wrote")->required();
    c->add_flag("--verify", o->verify, "Read every frame of a run, and compare checksums");
    c->add_flag("--json", o->json, "Print it as JSON");
    return [o] { return info(o->path, o->json, o->verify); };
}

}  // namespace vdbfrac::cli
