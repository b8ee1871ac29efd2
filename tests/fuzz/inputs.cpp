#include "inputs.h"

#include "sound_files.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/grid/relevel.h>
#include <vdbfrac/grid/vdb_file.h>
#include <vdbfrac/repair/surface_repair.h>
#include <vdbfrac/scene/reader.h>

#include "text_reader.h"

#include <sys/mman.h>
#include <unistd.h>

namespace vdbfrac::fuzz {

namespace {

/// Runs a reader and names what it throws.
template <class Read>
Outcome outcomeOf(const Read& read)
{
    try {
        read();
        return Outcome::read;
    } catch (const InputError&) {
        return Outcome::inputError;
    } catch (const FileError&) {
        return Outcome::fileError;
    } catch (const LimitError&) {
        return Outcome::limitError;
    }
}

Outcome readScene(std::string_view bytes)
{
    const std::span<const scene::TableSpec> tables = effectTables();
    return outcomeOf([&] {
        const scene::Scene scene = scene::parseScene(bytes, "fuzz.toml", tables);
        scene::parseScene(scene::writeScene(scene, tables), "again.toml", tables);  // what was read can be written and read
    });
}

template <const char* extension>
Outcome readMesh(std::string_view bytes)
{
    return outcomeOf([&] {
        const tetmesh::PolygonSoup soup = tetmesh::parseSurface(bytes, extension, "fuzz");
        const tetmesh::SurfaceReport report = tetmesh::examine(soup);
        repair::RepairOptions options;
        options.alpha = 0.1 * (report.upper - report.lower).maxCoeff();
        options.offset = 0.2 * options.alpha;
        options.memoryLimit = 100000000;
        if (soup.polygons.size() < 64 && soup.points.size() < 1000) outcomeOf([&] { repair::repairSurface(soup, report, options, "fuzz"); });
    });
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

Outcome readVdb(std::string_view bytes)
{
    const MemoryFile file(bytes);
    const Outcome described = outcomeOf([&] { grid::describeVdb(file.path()); });
    const Outcome read = outcomeOf([&] { grid::readLevelSet(file.path(), ""); });
    grid::RelevelOptions options;
    options.band.memoryLimit = 1000000;  // up to the sweeps, which take long
    outcomeOf([&] { grid::relevelFile(file.path(), "", options); });
    return described == Outcome::read ? read : described;
}

constexpr char kObj[] = ".obj", kStl[] = ".stl", kPly[] = ".ply", kOff[] = ".off";

}  // namespace

const std::vector<Kind>& kinds()
{
    static const std::vector<Kind> all = {{"scene", readScene, soundScenes},    {"obj", readMesh<kObj>, soundObjs}, {"stl", readMesh<kStl>, soundStls},
                                          {"ply", readMesh<kPly>, soundPlys},   {"off", readMesh<kOff>, soundOffs}, {"vdb", readVdb, soundVdbs}};
    return all;
}

const Kind& kindOf(std::string_view name)
{
    for (const Kind& kind : kinds())
        if (name == kind.name) return kind;
    throw Error("no kind of input is called " + std::string(name));
}

}  // namespace vdbfrac::fuzz
