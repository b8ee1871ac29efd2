// vdbfrac mesh: its options.
#include "mesh.h"
#include "number_options.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/cli/frame_list.h>
#include <vdbfrac/tetmesh/surface_file.h>

namespace vdbfrac::cli {

namespace {

constexpr const char *kTets = "To tets", *kDelaunayTets = "To Delaunay tets", *kSurfaces = "To surfaces";

void addTetOptions(CLI::App& c, MeshOptions& o)
{
    const char* const group = kTets;
    c.add_option(
         "--tets", o.tets,
         "lattice: whole tets, six to a voxel, that reach beyond the surface; five: five to a voxel; cut: their parts "
         "inside, up to the surface; delaunay: well shaped tets that follow the surface")
        ->check(CLI::IsMember({"lattice", "five", "cut", "delaunay"}))
        ->capture_default_str()
        ->group(group);
    auto* size = c.add_option("--size", o.size, "Voxel of the level set and edge of the tets [m]")
                     ->check(PositiveFinite(kLongestLength))
                     ->group(group);
    c.add_option("--across", o.across,
                 "Number of voxels along the longest side, instead of --size (default: 64, or the voxels of the .vdb)")
        ->check(CLI::Range(2, 100000))
        ->excludes(size)
        ->group(group);
    c.add_option("--msh-version", o.mshVersion, "Version of a .msh")
        ->check(CLI::IsMember({"4.1", "2.2"}))
        ->capture_default_str()
        ->group(group);
    c.add_option("--quality", o.quality, "Write the report on quality, volume and time as JSON")
        ->type_name("FILE")
        ->group(group);
}

void addDelaunayOptions(CLI::App& c, MeshOptions& o)
{
    mesher::DelaunayCriteria& d = o.delaunay;
    const char* const group = kDelaunayTets;
    const auto length = [&](const char* name, double& value, const char* help) {
        c.add_option(name, value, help)->check(PositiveFinite(kLongestLength))->type_name("M")->group(group);
    };
    length("--facet-size", d.facetSize, "Largest circumradius of a surface triangle (default: 0.9 of the size)");
    length("--facet-distance", d.facetDistance,
           "Farthest a triangle's middle may be from the surface (default: a tenth of the facet size)");
    length("--cell-size", d.cellSize, "Largest circumradius of a tet (default: the facet size)");
    length("--edge-size", d.edgeSize, "Longest piece of a sharp edge (default: the size)");
    c.add_option("--facet-angle", d.facetAngle, "Smallest angle of a surface triangle [degrees]")
        ->check(CLI::Range(0., 30.))
        ->capture_default_str()
        ->group(group);
    c.add_option("--radius-edge", d.radiusEdge, "Largest circumradius over shortest edge of a tet")
        ->check(CLI::Range(1., 1e6))
        ->capture_default_str()
        ->group(group);
    c.add_option("--sharp", o.sharpDegrees, "Keep edges of the input where its faces turn by more than this [degrees]")
        ->check(CLI::Range(1., 179.))
        ->group(group);
    c.add_option("--sliver-angle", d.sliverAngle, "Smallest dihedral angle to aim for [degrees]")
        ->check(CLI::Range(0., 40.))
        ->capture_default_str()
        ->group(group);
    c.add_flag("!--no-perturb", d.perturb, "Do not move points to get rid of slivers")->group(group);
    c.add_flag("!--no-exude", d.exude, "Do not weight points to get rid of slivers")->group(group);
}

void addSurfaceOptions(CLI::App& c, MeshOptions& o, std::string& frames)
{
    const char* const group = kSurfaces;
    c.add_option("-f,--frames", frames, "Frames of a run or sequence: 1-96, 1-96x2, 5,9,12 (default: all of a run)")
        ->group(group);
    c.add_option("--adaptivity", o.adaptivity, "0 keeps all polygons of a level set, 1 joins most in flat parts")
        ->check(CLI::Range(0., 1.))
        ->capture_default_str()
        ->group(group);
}

/// An option of this group would do nothing.
void refuse(const CLI::App& c, const char* group, const char* reason)
{
    for (const CLI::Option* option : c.get_options())
        if (option->count() > 0 && option->get_group() == group)
            throw InputError({option->get_name(), reason, "", "leave it out"});
}

void requireApplied(const CLI::App& c, const MeshOptions& o)
{
    if (tetmesh::isSurfaceFile(o.out)) {
        for (const char* group : {kTets, kDelaunayTets}) refuse(c, group, "is for tets, and the output is a surface");
        return;
    }
    refuse(c, kSurfaces, "is for surfaces, and the output is tets");
    if (o.tets != "delaunay") refuse(c, kDelaunayTets, "is for --tets delaunay");
}

}  // namespace

Action addMesh(CLI::App& app)
{
    struct Options : MeshOptions {
        std::string frameText;
        double maxMemory = 0;
    };
    auto o = std::make_shared<Options>();
    CLI::App* c = app.add_subcommand("mesh", "Surface or level set to tets; level sets or frames of a run to surfaces");
    c->add_option("IN", o->in,
                  "A closed surface (.obj, .stl, .ply, .off), a level set (.vdb), a sequence of them (NAME.####.vdb), "
                  "or the folder of a run")
        ->required();
    c->add_option("-o,--output", o->out,
                  "Tets: .vtu, .vtk, .msh, .mesh, .node or .ele. Surface: .obj, .ply, .stl. #### or $F4 or %04d in the "
                  "name stands for the frame")
        ->required()
        ->type_name("FILE");
    c->add_option("--grid", o->grid, "Level set of a .vdb (default: its first; of a run: the deformed surface)")
        ->type_name("NAME");
    addTetOptions(*c, *o);
    addDelaunayOptions(*c, *o);
    addSurfaceOptions(*c, *o, o->frameText);
    addThreads(*c, o->threads);
    addMaxMemory(*c, o->maxMemory, "it");
    c->add_flag("-q,--quiet", o->common.quiet, "Say only what went wrong");
    c->add_option("--log-file", o->common.logFile, "Write what is said to this file too")->type_name("FILE");
    return [o, c] {
        requireApplied(*c, *o);
        o->memoryLimit = memoryLimitOf(o->maxMemory);
        if (!o->frameText.empty()) o->frames = parseFrames(o->frameText);
        const ThreadLimit threads(o->threads);
        return tetmesh::isSurfaceFile(o->out) ? meshSurfaces(*o) : meshTets(*o);
    };
}

}  // namespace vdbfrac::cli
