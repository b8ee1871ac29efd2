#include "mesh.h"
#include "tet_report.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/ledger.h>
#include <vdbfrac/grid/relevel.h>
#include <vdbfrac/grid/body_level_set.h>
#include <vdbfrac/grid/level_set_surface.h>
#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/grid/phi_sampler.h>
#include <vdbfrac/grid/vdb_file.h>
#include <vdbfrac/lab/machine/memory.h>
#include <vdbfrac/mesher/sharp_edges.h>
#include <vdbfrac/tetmesh/material_tets.h>
#include <vdbfrac/tetmesh/surface_input.h>
#include <vdbfrac/tetmesh/tet_file.h>

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

namespace vdbfrac::cli {

namespace {

/// Tets in a volume of size^3, in a voxel's share of the surface, and the memory of each until it is written: fitted to
/// runs of 70 000 to 2 million tets, from which they differ by up to 15 %.
struct Cost {
    double perVolume, perSurface, bytes;
};
Cost costOf(const std::string& kind)
{
    if (kind == "delaunay") return {6.2, 1, 540};
    if (kind == "cut") return {6, 12.5, 215};
    return kind == "five" ? Cost{5, 3.5, 240} : Cost{6, 4, 240};
}
constexpr double kProgram = 60e6;      // bytes, of code and libraries
constexpr double kTetsPerPoint = 5.5;  // of Delaunay tets

struct Input {
    scene::Body body;
    double longestSide = 0, voxelSize = 0;  // m; voxelSize of a .vdb only
    tetmesh::PolygonSoup soup;              // of a surface
    double volume = 0;                      // m^3, that it encloses; 0 when its faces do not agree about their sides
};

Input openVdb(const MeshOptions& options)
{
    Input input;
    input.body.shape = scene::VdbFile{options.in, options.grid};
    for (const grid::GridInfo& info : grid::describeVdb(options.in, options.memoryLimit)) {
        if (info.gridClass != "level set" || (!options.grid.empty() && info.name != options.grid)) continue;
        const Vec3 sides = info.voxelSize * (info.upper - info.lower).toVec();
        input.longestSide = sides.maxCoeff(), input.voxelSize = info.voxelSize;
        break;
    }
    return input;  // a file without such a grid is refused where it is read
}

Input openSurface(const MeshOptions& options)
{
    Input input;
    input.body.shape = scene::MeshFile{options.in};
    input.soup = tetmesh::readSurface(options.in, options.memoryLimit);
    const tetmesh::SurfaceReport report = tetmesh::examine(input.soup);
    if (!report.closed)
        throw InputError(
            {options.in.string(), "is not closed: it has " + std::to_string(report.openEdges) + " open edges",
             "a closed surface",
             "make a solid of it first: vdbfrac relevel " + options.in.string() + " -o SOLID.vdb --voxel SIZE"});
    const Vec3 size = report.upper - report.lower;
    input.longestSide = size.maxCoeff();
    // Shells of which some are inside out nearly cancel each other.
    constexpr double kLeast = 1e-6;  // of its box
    const double volume = std::abs(report.volume);
    input.volume = report.oriented && volume > kLeast * size.prod() ? volume : 0;
    return input;
}

Input open(const MeshOptions& options)
{
    const bool vdb = isVdb(options.in);
    if (vdb && options.sharpDegrees > 0)
        throw InputError(
            {"--sharp", "needs the edges of a surface mesh", "an .obj, .stl, .ply or .off file as input", ""});
    Input input = vdb ? openVdb(options) : openSurface(options);
    input.body.name = options.in.filename().string();
    input.body.place = options.in.string();
    return input;
}

/// A run has surfaces and level sets, one a frame.
void requireSolid(const MeshOptions& options)
{
    if (!std::filesystem::is_directory(options.in)) return;
    throw InputError({options.in.string(),
                      "frames of a run become surfaces, not '" + options.out.extension().string() + "'",
                      ".obj, .ply, .stl", "for tets of a frame give its level set as IN, a .vdb of the run"});
}

double sizeOf(const Input& input, const MeshOptions& options)
{
    constexpr int kAcross = 64;
    if (options.size > 0) return options.size;
    if (options.across == 0 && input.voxelSize > 0) return input.voxelSize;
    return input.longestSide / (options.across > 0 ? options.across : kAcross);
}

/// m^3 of the level set as it is in the file: where its voxels were kept, that of ours.
double volumeOfVdb(const Input& input, const MeshOptions& options, const TetReport& report)
{
    constexpr double kSame = 1e-6;  // relative
    if (std::abs(report.voxelSize - input.voxelSize) <= kSame * input.voxelSize) return report.levelSetVolume;
    return grid::enclosedVolume(grid::readLevelSet(options.in, options.grid, options.memoryLimit).levelSet);
}

/// Throws LimitError when the tets will not fit.
void requireMemory(const MeshOptions& options, const grid::LevelSet& phi, double volume)
{
    const Cost cost = costOf(options.tets);
    double size = phi.voxelSize();
    const double radius = options.delaunay.cellSize > 0 ? options.delaunay.cellSize : options.delaunay.facetSize;
    if (options.tets == "delaunay" && radius > 0) size = radius / mesher::kRadiusOfEdge;
    const double band = 2 * phi.background() / phi.voxelSize(), shrink = phi.voxelSize() / size;
    const double surface = double(phi.activeVoxels()) / band * shrink * shrink;
    const double tets = cost.perVolume * volume / (size * size * size) + cost.perSurface * surface,
                 bytes = kProgram + tets * cost.bytes;
    if (bytes <= double(options.memoryLimit)) return;
    throw LimitError(fmt::format(
        "{}: about {:.3g} tets need {:.2f} GiB, the limit is {:.2f} GiB; use a larger --size or --max-memory",
        options.in.string(), tets, bytes / lab::kGiB, double(options.memoryLimit) / lab::kGiB));
}

tetmesh::TetMesh delaunay(const grid::LevelSet& phi, const Input& input, const MeshOptions& options, double size)
{
    mesher::ImplicitSolid solid{grid::phiSampler(phi), grid::materialBox(phi), {}};
    if (options.sharpDegrees > 0) solid.sharpEdges = mesher::sharpEdges(input.soup, options.sharpDegrees);
    mesher::DelaunayCriteria criteria = options.delaunay;
    if (criteria.facetSize == 0) criteria.facetSize = mesher::kRadiusOfEdge * size;
    if (criteria.edgeSize == 0) criteria.edgeSize = size;
    criteria.maxPoints = std::size_t(double(options.memoryLimit) / costOf("delaunay").bytes / kTetsPerPoint) + 1;
    return mesher::delaunayMesh(solid, criteria);
}

TetResult makeTets(const grid::LevelSet& phi, const Input& input, const MeshOptions& options, double size)
{
    TetResult result;
    if (options.tets == "delaunay") {
        result.mesh = delaunay(phi, input, options, size);
        result.materialVolume = volumeOf(result.mesh);
        return result;
    }
    const auto kind = options.tets == "five" ? tetmesh::Lattice::Kind::five : tetmesh::Lattice::Kind::six;
    const tetmesh::CutMesh cut({kind, 1, phi.voxelSize()}, grid::sampleNodes(phi, options.memoryLimit));
    result.materialVolume = cut.volume();
    if (options.tets == "cut") {
        result.mesh = tetmesh::materialTets(cut);
        return result;
    }
    tetmesh::WholeTets whole = tetmesh::wholeTets(cut);
    result.mesh = std::move(whole.mesh);
    result.fields.onTets.push_back({"fraction", std::move(whole.fraction)});
    return result;
}

}  // namespace

int meshTets(const MeshOptions& options)
{
    using Clock = StageTimer;  // times what stands behind its comma
    requireApart({options.out}, {options.in});
    requireApart({options.quality}, {options.in, options.out});
    const auto log = makeLog(options.common);
    requireSolid(options);
    tetmesh::TetFormat format = tetmesh::tetFormatOf(options.out);
    if (format == tetmesh::TetFormat::gmsh41 && options.mshVersion == "2.2") format = tetmesh::TetFormat::gmsh22;
    Ledger work;
    TetReport report;
    log->info("reading {}", options.in.string());
    Input input = (Clock(work, "read"), open(options));
    scene::Grid grid;
    grid.voxelSize = report.voxelSize = sizeOf(input, options);
    log->info("making a level set with voxels of {:.6g} m", grid.voxelSize);
    std::vector<std::string> notes;
    const grid::LevelSet phi =
        (Clock(work, "level_set"), grid::makeLevelSet(input.body, grid, options.memoryLimit, &notes));
    report.levelSetVolume = grid::enclosedVolume(phi);
    report.inputVolume = isVdb(options.in) ? volumeOfVdb(input, options, report) : input.volume;
    if (const std::string another = grid::volumeText(report.levelSetVolume, report.inputVolume, grid.voxelSize);
        !another.empty())
        notes.push_back(another);
    log->info("making tets in {:.4g} m^3", report.levelSetVolume);
    requireMemory(options, phi, report.levelSetVolume);
    const TetResult result = (Clock(work, "tets"), makeTets(phi, input, options, grid.voxelSize));
    report.quality = (Clock(work, "quality"), qualityOf(result.mesh));
    report.coincidentPoints = coincidentPoints(result.mesh);
    const auto files = (Clock(work, "write"), writeTets(options.out, format, result.mesh, result.fields));
    if (!options.common.quiet)
        for (const auto& file : files) std::printf("%s\n", file.c_str());
    log->info("{}", reportText(report, result, options.tets));
    for (const std::string& note : notes) log->warn("note: {}", note);
    if (!options.quality.empty()) writeText(options.quality, reportJson(report, result, options.tets, work));
    return kDone;
}

}  // namespace vdbfrac::cli
