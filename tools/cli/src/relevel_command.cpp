// vdbfrac relevel: any surface or signed-distance grid in, a clean narrow-band level set out.
#include "options.h"
#include "number_options.h"
#include "relevel_report.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/cli/commands.h>
#include <vdbfrac/core/version.h>
#include <vdbfrac/grid/vdb_file.h>

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

namespace vdbfrac::cli {

namespace fs = std::filesystem;

namespace {

struct RelevelCommand {
    CommonOptions common;
    std::string input, output, grid, redistancing = "auto";
    double voxelSize = 0, alpha = 0, maxMemory = 0;
    int across = 0, halfWidth = 3, threads = 0;
    bool closeHoles = false, json = false;
};

/// Tells what is done next, so that nothing long goes on without a word.
using Say = std::function<void(const std::string&)>;

grid::Redistancing redistancing(const std::string& name)
{
    return name == "track"   ? grid::Redistancing::track
           : name == "sweep" ? grid::Redistancing::sweep
                             : grid::Redistancing::automatic;
}

/// A wrap follows what two voxels resolve, half a voxel outside of it; that is taken away again on the grid.
repair::RepairOptions repairOptions(const RelevelCommand& o, double voxelSize, std::uint64_t memoryLimit,
                                    const Say& say)
{
    repair::RepairOptions r;
    r.wrapAlways = o.alpha > 0;
    r.fillHoles = o.closeHoles || !r.wrapAlways;
    r.wrapWhenNeeded = !o.closeHoles;
    r.alpha = o.alpha > 0 ? o.alpha : 2 * voxelSize;
    r.offset = std::min(0.5 * voxelSize, 0.25 * r.alpha);
    r.memoryLimit = memoryLimit;
    r.say = say;
    return r;
}

void requireClosed(const repair::Repaired& repaired, const RelevelCommand& o)
{
    if (repaired.after.closed) return;
    throw InputError(
        {o.input,
         "is open after its repair: " + std::to_string(repaired.after.openEdges) + " edges without a neighbour",
         "a closed surface", "leave out --close-holes, or give --wrap"});
}

tetmesh::PolygonSoup read(const RelevelCommand& o, const grid::Band& band, RelevelReport& report, const Say& say)
{
    const StageTimer timer(report.work, "read");
    say("reading " + o.input);
    return tetmesh::readSurface(o.input, band.memoryLimit);
}

/// Sets the voxel size of the band too.
repair::Repaired repaired(const RelevelCommand& o, grid::Band& band, RelevelReport& report, const Say& say)
{
    const tetmesh::PolygonSoup soup = read(o, band, report, say);
    const StageTimer timer(report.work, "repair");
    say(fmt::format("looking at {} points, {} faces", soup.points.size(), soup.polygons.size()));
    const tetmesh::SurfaceReport before = tetmesh::examine(soup);
    band.voxelSize = grid::voxelSizeOf(band, (before.upper - before.lower).maxCoeff());
    return repair::repairSurface(soup, before, repairOptions(o, band.voxelSize, band.memoryLimit, say), o.input);
}

RelevelReport fromSurface(const RelevelCommand& o, const grid::Band& band, const Say& say)
{
    RelevelReport report;
    grid::Band exact = band;
    repair::Repaired r = repaired(o, exact, report, say);
    requireClosed(r, o);
    const double inset = r.wrapped ? repairOptions(o, exact.voxelSize, 0, {}).offset : 0;
    report.inputVolume = r.after.volume - inset * r.after.area;
    {
        const StageTimer timer(report.work, "voxelize");
        say(fmt::format("making a level set of {} triangles with voxels of {:.6g} m", r.soup.polygons.size(),
                        exact.voxelSize));
        report.levelSet = grid::surfaceLevelSet({r.soup, r.after, inset, o.input}, exact, &report.gaps);
    }
    r.soup = {};
    const StageTimer timer(report.work, "measure");
    say(fmt::format("measuring {} voxels", report.levelSet.activeVoxels()));
    report.after = grid::measure(report.levelSet);
    report.repair = std::move(r);
    return report;
}

RelevelReport fromGrid(const RelevelCommand& o, const grid::Band& band, const Say& say)
{
    if (o.alpha > 0 || o.closeHoles)
        throw InputError({o.input, "--wrap and --close-holes are for surfaces", "a mesh file", ""});
    say("re-levelling " + o.input);
    grid::Relevelled result = grid::relevelFile(o.input, o.grid, {band, redistancing(o.redistancing)});
    RelevelReport report;
    report.levelSet = std::move(result.levelSet);
    report.after = result.after;
    report.inputVolume = result.before.volume;
    report.grid = GridChange{result.before, result.resampled, result.redistancing};
    report.work = result.work;
    return report;
}

void write(const RelevelCommand& o, RelevelReport& report)
{
    const StageTimer timer(report.work, "write");
    grid::NamedGrid named;
    named.name = o.grid.empty() ? "phi" : o.grid;
    named.levelSet = &report.levelSet;
    named.unit = "m";
    grid::writeVdb(o.output, {named}, {{"creator", std::string(core::kCreator)}, {"length_unit", std::string("m")}});
}

int run(const RelevelCommand& o)
{
    const ThreadLimit threads(o.threads);
    const auto log = makeLog(o.common);
    if (!isVdb(o.output))
        throw InputError({"--output", "'" + o.output + "' is not a .vdb file", "a name that ends in .vdb", ""});
    requireApart({o.output}, {o.input});
    const bool grid = isVdb(o.input);
    if (!grid && o.voxelSize == 0 && o.across == 0)
        throw InputError(
            {"vdbfrac relevel", "a surface has no voxel size of its own", "--voxel SIZE or --across N", ""});
    grid::Band band{o.voxelSize, o.across, o.halfWidth, memoryLimitOf(o.maxMemory)};
    const Say say = [&](const std::string& what) { log->info("{}", what); };
    RelevelReport report = grid ? fromGrid(o, band, say) : fromSurface(o, band, say);
    write(o, report);
    log->info("{}", reportText(report));
    for (const std::string& note : notesOf(report)) log->warn("note: {}", note);
    if (o.json) std::fputs((reportJson(report, o.input, o.output).dump(1) + "\n").c_str(), stdout);
    return kDone;
}

}  // namespace

Action addRelevel(CLI::App& app)
{
    auto o = std::make_shared<RelevelCommand>();
    CLI::App* c = app.add_subcommand("relevel",
                                     "Make a clean level set of a surface (.obj, .ply, .stl, .off), even one with "
                                     "holes or self-intersections, or of a .vdb grid");
    c->add_option("IN", o->input, "Surface or .vdb")->required();
    c->add_option("-o,--output", o->output, "Level set to write")->required()->type_name("OUT.vdb");
    c->add_option("--grid", o->grid, "Grid of a .vdb with several (default: the first level set)")->type_name("NAME");
    auto* voxel = c->add_option("--voxel", o->voxelSize, "Voxel size [m]")->check(PositiveFinite(kLongestLength));
    c->add_option("--across", o->across, "Number of voxels along the longest side")
        ->check(CLI::Range(2, 100000))
        ->excludes(voxel);
    c->add_option("--half-width", o->halfWidth, "Voxels of the band on either side")
        ->check(CLI::Range(2, 100))
        ->capture_default_str();
    c->add_flag("--close-holes", o->closeHoles, "Repair by filling holes only");
    c->add_option("--wrap", o->alpha, "Wrap the surface: gaps and hollows narrower than 2 ALPHA [m] are closed")
        ->type_name("ALPHA")
        ->check(PositiveFinite(kLongestLength));
    c->add_option("--redistance", o->redistancing, "How a grid is redistanced (made a signed distance again)")
        ->check(CLI::IsMember({"auto", "track", "sweep"}))
        ->capture_default_str();
    addMaxMemory(*c, o->maxMemory, "it");
    addThreads(*c, o->threads);
    c->add_flag("--json", o->json, "Print the report as JSON");
    c->add_flag("-q,--quiet", o->common.quiet, "Say only what went wrong");
    c->add_option("--log-file", o->common.logFile, "Write the report to this file too")->type_name("FILE");
    return [o] { return run(*o); };
}

}  // namespace vdbfrac::cli
