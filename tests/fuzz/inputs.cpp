#include "inputs.h"

#include "checkpoints.h"
#include "sound_files.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/grid/body_level_set.h>
#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/grid/relevel.h>
#include <vdbfrac/grid/vdb_file.h>
#include <vdbfrac/repair/surface_repair.h>
#include <vdbfrac/scene/reader.h>
#include <vdbfrac/tetmesh/material_tets.h>

#include "text_reader.h"

#include <sys/mman.h>
#include <unistd.h>

#include <utility>

namespace vdbfrac::fuzz {

namespace {

/// Runs a command and names what it throws.
template <class Command>
Ending endingOf(const Command& command)
{
    try {
        command();
        return Ending::done;
    } catch (const InputError&) {
        return Ending::inputError;
    } catch (const FileError&) {
        return Ending::fileError;
    } catch (const LimitError&) {
        return Ending::limitError;
    }
}

std::vector<Ending> runScene(std::string_view bytes)
{
    const scene::Vocabulary known = vocabulary();
    return {endingOf([&] {
        const scene::Scene scene = scene::parseScene(bytes, "fuzz.toml", known);
        // What was read can be written and read.
        scene::parseScene(scene::writeScene(scene, known), "again.toml", known);
    })};
}

/// The lattice tets of a level set.
void makeTets(const grid::LevelSet& phi)
{
    tetmesh::wholeTets(
        tetmesh::CutMesh({tetmesh::Lattice::Kind::six, 1, phi.voxelSize()}, grid::sampleNodes(phi, kMemoryLimit)));
}

using SurfaceAndReport = std::pair<tetmesh::PolygonSoup, tetmesh::SurfaceReport>;

void relevelSurface(const SurfaceAndReport& surface, const grid::Band& band)
{
    const auto& [soup, report] = surface;
    repair::RepairOptions options;
    options.alpha = 2 * grid::voxelSizeOf(band, (report.upper - report.lower).maxCoeff());
    options.offset = 0.25 * options.alpha;
    options.memoryLimit = kMemoryLimit;
    const repair::Repaired repaired = repair::repairSurface(soup, report, options, "fuzz");
    grid::measure(
        grid::surfaceLevelSet({repaired.soup, repaired.after, repaired.wrapped ? options.offset : 0, "fuzz"}, band));
}

void meshSurface(const SurfaceAndReport& surface, const grid::Band& band)
{
    if (!surface.second.closed) throw InputError({"fuzz", "is not closed", "", ""});
    makeTets(grid::surfaceLevelSet({surface.first, surface.second, 0, "fuzz"}, band));
}

template <const char* extension>
std::vector<Ending> runSurface(std::string_view bytes)
{
    SurfaceAndReport surface;
    const Ending read = endingOf([&] {
        surface.first = tetmesh::parseSurface(bytes, extension, "fuzz");
        surface.second = tetmesh::examine(surface.first);
    });
    constexpr std::size_t kMaxPolygons = 64, kMaxPoints = 1000;  // more of them only take longer
    if (read != Ending::done || surface.first.polygons.size() > kMaxPolygons ||
        surface.first.points.size() > kMaxPoints)
        return std::vector<Ending>(3, read);
    grid::Band band;
    band.across = 12;
    band.memoryLimit = kMemoryLimit;
    return {read, endingOf([&] { relevelSurface(surface, band); }), endingOf([&] { meshSurface(surface, band); })};
}

/// Bytes as a file that has a path but no place on a disk.
class MemoryFile {
public:
    explicit MemoryFile(std::string_view bytes) : fd_(::memfd_create("fuzz", 0))
    {
        while (!bytes.empty()) {
            const ::ssize_t written = ::write(fd_, bytes.data(), bytes.size());
            if (written <= 0) throw std::runtime_error("no memory file");
            bytes.remove_prefix(std::size_t(written));
        }
    }
    ~MemoryFile() { ::close(fd_); }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;
    std::string path() const { return "/proc/self/fd/" + std::to_string(fd_); }

private:
    int fd_;
};

/// Tets on the voxels of the first level set, or on those that suit a file which says nothing of use.
void meshVdb(const std::string& path)
{
    scene::Grid spec;
    spec.voxelSize = 0.01;
    for (const grid::GridInfo& info : grid::describeVdb(path, kMemoryLimit)) {
        if (info.gridClass != "level set") continue;
        spec.voxelSize = info.voxelSize;
        break;
    }
    scene::Body body;
    body.name = body.place = "fuzz";
    body.shape = scene::VdbFile{path, ""};
    makeTets(grid::makeLevelSet(body, spec, kMemoryLimit));
}

std::vector<Ending> runVdb(std::string_view bytes)
{
    const MemoryFile file(bytes);
    grid::RelevelOptions options;
    options.band.memoryLimit = kMemoryLimit;
    return {endingOf([&] { grid::describeVdb(file.path(), kMemoryLimit); }),
            endingOf([&] { grid::relevelFile(file.path(), "", options); }), endingOf([&] { meshVdb(file.path()); })};
}

std::vector<Ending> runCheckpoint(std::string_view bytes)
{
    return {endingOf([&] { resumeFrom(bytes); })};
}

constexpr char kObj[] = ".obj", kStl[] = ".stl", kPly[] = ".ply", kOff[] = ".off";
constexpr const char* kOfScenes[] = {"check"};
constexpr const char* kOfCheckpoints[] = {"sim"};
constexpr const char* kOfShapes[] = {"info", "relevel", "mesh"};

}  // namespace

const std::vector<Kind>& kinds()
{
    static const std::vector<Kind> all = {{"scene", ".toml", kOfScenes, runScene, soundScenes},
                                          {"obj", kObj, kOfShapes, runSurface<kObj>, soundObjs},
                                          {"stl", kStl, kOfShapes, runSurface<kStl>, soundStls},
                                          {"ply", kPly, kOfShapes, runSurface<kPly>, soundPlys},
                                          {"off", kOff, kOfShapes, runSurface<kOff>, soundOffs},
                                          {"vdb", ".vdb", kOfShapes, runVdb, soundVdbs},
                                          {"checkpoint", ".ckpt", kOfCheckpoints, runCheckpoint, soundCheckpoints}};
    return all;
}

const Kind& kindOf(std::string_view name)
{
    for (const Kind& kind : kinds())
        if (name == kind.name) return kind;
    throw Error("no kind of input is called " + std::string(name));
}

}  // namespace vdbfrac::fuzz

/// What the address sanitizer asks for, in programs that are built with it. A file of some kB has no use for a large
/// allocation: an abort, not a bad_alloc that a reader would catch. OpenVDB leaks the node it is reading when it
/// throws, so leaks are not looked for.
extern "C" const char* __asan_default_options()
{
    return "max_allocation_size_mb=1024:hard_rss_limit_mb=2048:detect_leaks=0";
}
