#include "mesh.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/polygon.h>
#include <vdbfrac/cli/frame_list.h>
#include <vdbfrac/grid/level_set_surface.h>
#include <vdbfrac/grid/vdb_file.h>
#include <vdbfrac/lab/machine/memory.h>
#include <vdbfrac/report/run_frames.h>
#include <vdbfrac/tetmesh/obj_file.h>
#include <vdbfrac/tetmesh/surface_file.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace vdbfrac::cli {

namespace fs = std::filesystem;

namespace {

/// What becomes one surface.
struct Source {
    int frame = 0;
    fs::path obj, vdb;  // one of them
};

Source sourceOf(const report::RunFrame& frame, const MeshOptions& options)
{
    // The surface of the simulation itself knows fragments and torn faces; a level set of it does not.
    const bool isDrawn = !frame.obj.empty() && options.grid.empty();
    const fs::path& file = isDrawn ? frame.obj : frame.vdb;
    requireWhole(frame, file);
    if (isDrawn) return {frame.frame, file, {}};
    if (!file.empty()) return {frame.frame, {}, file};
    throw InputError(
        {options.in.string(), "frame " + std::to_string(frame.frame) + " has no file to make a surface of", "", ""});
}

std::vector<Source> sourcesOfRun(const MeshOptions& options)
{
    const report::RunFrames run = report::readRunFrames(options.in);
    std::vector<Source> sources;
    for (const report::RunFrame& frame : run.frames)
        if (options.frames.empty()) sources.push_back(sourceOf(frame, options));
    for (int wanted : options.frames) {
        const auto it =
            std::find_if(run.frames.begin(), run.frames.end(), [&](const auto& f) { return f.frame == wanted; });
        if (it == run.frames.end())
            throw InputError({options.in.string(), "has no frame " + std::to_string(wanted), "", ""});
        sources.push_back(sourceOf(*it, options));
    }
    if (sources.empty()) throw InputError({options.in.string(), "has no frames yet", "", ""});
    return sources;
}

std::vector<Source> sourcesOf(const MeshOptions& options)
{
    if (fs::is_directory(options.in)) return sourcesOfRun(options);
    const std::string name = options.in.string();
    if (!isVdb(options.in))
        throw InputError({name, "cannot become a surface", "a .vdb file, a sequence of them, or the folder of a run",
                          "from a surface mesh 'vdbfrac mesh' makes tets: give -o a name as OUT.vtu"});
    if (!isSequence(name)) return {{0, {}, options.in}};
    if (options.frames.empty())
        throw InputError({"--frames", "are missing: " + name + " is a sequence", "as in -f 1-96", ""});
    std::vector<Source> sources;
    for (int f : options.frames) sources.push_back({f, {}, frameName(name, f)});
    return sources;
}

/// The grid asked for; of a run's frame the deformed surface, when it has one.
std::string gridOf(const fs::path& vdb, const MeshOptions& options)
{
    if (!options.grid.empty() || !fs::is_directory(options.in)) return options.grid;
    for (const grid::GridInfo& info : grid::describeVdb(vdb, options.memoryLimit))
        if (info.name == "surface") return info.name;
    throw InputError({vdb.string(), "has no grid 'surface', the body as it is deformed", "",
                      "'--grid phi' is the body at rest; a run writes the other with output.vdb = [\"phi\", "
                      "\"surface\"], or an .obj"});
}

/// Volume over that of the level set, less 1: faces that are joined cut off what is round between them.
double changeOf(const tetmesh::Surface& surface, const grid::LevelSet& phi)
{
    double volume = 0;
    for (const auto& t : surface.triangles)
        volume += volumeBelow(3, [&](std::size_t k) { return surface.points[t[k]]; });
    return volume / grid::enclosedVolume(phi) - 1;
}

/// `change`: becomes that of the volume, where faces are joined and more is lost.
tetmesh::Surface surfaceOf(const Source& source, const MeshOptions& options, double& change)
{
    if (!source.obj.empty()) return tetmesh::readObjFrame(source.obj);
    const grid::ReadLevelSet read = grid::readLevelSet(source.vdb, gridOf(source.vdb, options), options.memoryLimit);
    constexpr double kBytesPerVoxel =
        80;  // of the band; a surface has about one point and two triangles for six of them
    if (const double bytes = kBytesPerVoxel * double(read.levelSet.activeVoxels()); bytes > double(options.memoryLimit))
        throw LimitError(source.vdb.string() + ": its surface needs about " + std::to_string(bytes / lab::kGiB) +
                         " GiB, above --max-memory");
    tetmesh::Surface surface = grid::surfaceOf(read.levelSet, options.adaptivity);
    if (surface.triangles.empty())
        throw InputError({source.vdb.string(), "has no surface: nothing in it is inside", "", ""});
    if (options.adaptivity > 0) change = std::min(change, changeOf(surface, read.levelSet));
    for (Vec3& p : surface.points) p += read.origin;
    return surface;
}

}  // namespace

int meshSurfaces(const MeshOptions& options)
{
    const std::vector<Source> sources = sourcesOf(options);
    const std::string out = options.out.string();
    if (sources.size() > 1 && !isSequence(out))
        throw InputError(
            {"--output",
             "'" + out + "' has no place for the frame, and there are " + std::to_string(sources.size()) + " frames",
             "####, $F4 or %04d in the name", ""});
    for (const Source& source : sources) requireApart({frameName(out, source.frame)}, {});
    double change = 0;
    for (const Source& source : sources) {
        const std::string file = frameName(out, source.frame);
        if (isSequence(out)) makeFolderOf(file);
        tetmesh::writeSurface(file, surfaceOf(source, options, change));
        if (!options.common.quiet) std::printf("%s\n", file.c_str());
    }
    constexpr double kMuch = .005;
    const auto log = makeLog(options.common);
    if (change < -kMuch)
        log->warn("note: --adaptivity {} changes volumes by up to {:+.2g} %", options.adaptivity, 100 * change);
    if (std::ranges::any_of(sources, [](const Source& s) { return !s.obj.empty(); }))
        log->warn(
            "note: of frames come triangles and their fragments; texture coordinates, normals and materials are in the "
            ".obj files of the run");
    return kDone;
}

}  // namespace vdbfrac::cli
