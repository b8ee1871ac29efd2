#include <vdbfrac/core/point_cache.h>

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/tetmesh/cache_files.h>
#include <vdbfrac/tetmesh/mtl_file.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <numeric>
#include <string>

namespace vdbfrac::core {

namespace fs = std::filesystem;

namespace {

std::string keyOf(const char* what, std::size_t body) { return std::string(what) + "_" + std::to_string(body); }

}  // namespace

Archive motionOf(const Simulation& simulation)
{
    Archive archive;
    for (std::size_t b = 0; b < simulation.bodies().size(); ++b) {
        const Body& body = simulation.bodies()[b];
        archive.put(keyOf("x", b), simulation.x().subspan(body.firstNode, body.mesh->nodeCount()));
        archive.put(keyOf("v", b), simulation.v().subspan(body.firstNode, body.mesh->nodeCount()));
        archive.put(keyOf("before", b), simulation.ancestry()->before(b, simulation.framesDone()));
    }
    return archive;
}

PointCache::PointCache(const scene::Scene& scene, const Simulation& simulation, const Drawing& drawing,
                       std::vector<fs::path> motion)
    : scene_(scene), drawing_(drawing), motion_(std::move(motion)), node_(ancestors(simulation))
{
    rest_ = frame(0);
    lacks_ = 1 - volumeOf(rest_) / simulation.startVolume();
    for (std::size_t b = 0; b < rest_.size() && scene.output.lipsClosed; ++b) {
        const Body& body = simulation.bodies()[b];
        joined_.emplace_back(*rest_[b].topology, simulation.stages(), body);
        covers_.emplace_back(rest_[b].topology, joined_[b].isJoined(), simulation.stages(), body);
        covers_[b].addTo(0, rest_[b]);
    }
    for (const DrawnBody& body : rest_) {
        used_.push_back(tetmesh::usedPoints(body.topology->mesh));
        usedNormals_.push_back(tetmesh::usedNormals(body.topology->mesh));
    }
}

std::string PointCache::lacks() const
{
    constexpr double kMuch = 0.02;  // of the volume: the surface of a mesh holds up to 1 % less than its level set
    std::size_t open = 0;
    for (const HoleCovers& covers : covers_) open += covers.uncovered();
    std::string text;
    if (lacks_ > kMuch)
        text = "all frames of a point cache have the surface of the last one: " + shortNumber(100 * lacks_, 2) +
               " % of the volume, which cracks take later, is missing from the first on, and holes in the surface are "
               "covered by flat faces until then";
    if (open > 0)
        text += (text.empty() ? "" : "; ") + counted(open, "hole") + " in the surface, which cracks tear later, " +
                (open == 1 ? "is" : "are") + " open from the first frame on";
    return text;
}

/// Classes of nodes only split: each node of the last frame was one node in every frame before.
std::vector<std::vector<PointCache::Nodes>> PointCache::ancestors(const Simulation& simulation) const
{
    std::vector<Nodes> now;
    for (const Body& body : simulation.bodies()) {
        std::vector<std::uint32_t> own(body.mesh->nodeCount());
        std::iota(own.begin(), own.end(), 0u);
        now.push_back(std::make_shared<const std::vector<std::uint32_t>>(std::move(own)));
    }
    std::vector<std::vector<Nodes>> all(motion_.size());
    for (std::size_t f = motion_.size(); f-- > 0;) {
        all[f] = now;
        const Archive archive = Archive::read(motion_[f]);
        for (std::size_t b = 0; b < now.size(); ++b) {
            const auto before = archive.get<std::uint32_t>(keyOf("before", b));
            if (before.empty()) continue;
            std::vector<std::uint32_t> were;
            for (std::uint32_t n : *now[b]) {
                if (n >= before.size()) archive.complain("has too few nodes for the frames after it");
                were.push_back(before[n]);
            }
            now[b] = std::make_shared<const std::vector<std::uint32_t>>(std::move(were));
        }
    }
    return all;
}

DrawnFrame PointCache::frame(std::size_t number) const
{
    const Archive archive = Archive::read(motion_[number]);
    DrawnFrame all;
    for (std::size_t b = 0; b < node_[number].size(); ++b) {
        const auto x = archive.get<Vec3>(keyOf("x", b)), v = archive.get<Vec3>(keyOf("v", b));
        std::vector<Vec3> atX, atV;
        for (std::uint32_t n : *node_[number][b]) {
            if (n >= x.size() || n >= v.size()) archive.complain("has too few nodes for the run's last frame");
            atX.push_back(x[n]), atV.push_back(v[n]);
        }
        all.push_back(drawing_.body(b, atX, atV));
        const double time = double(number) / scene_.time.fps;
        if (!joined_.empty()) joined_[b].join(time, all.back());
        if (!covers_.empty()) covers_[b].addTo(time, all.back());
    }
    return all;
}

std::vector<tetmesh::CacheFrame> PointCache::cacheFrame(std::size_t number) const
{
    std::vector<tetmesh::CacheFrame> all;
    const DrawnFrame drawn = frame(number);
    for (std::size_t b = 0; b < used_.size(); ++b) {
        tetmesh::CacheFrame& one = all.emplace_back();
        for (std::uint32_t p : used_[b]) {
            one.points.push_back(drawn[b].points[p]);
            one.velocities.push_back(drawn[b].velocity[p]);
        }
        for (std::uint32_t n : usedNormals_[b]) one.normals.push_back(drawn[b].normals[n]);
    }
    return all;
}

void PointCache::writeObj(const fs::path& out) const
{
    std::vector<tetmesh::DrawnPart> parts;
    for (const DrawnBody& body : rest_) parts.push_back({*body.topology, body.points, body.normals});
    const fs::path mtl = fs::path(out).replace_extension(".mtl");
    tetmesh::writeMtl(mtl, drawing_.materials());
    tetmesh::writeObjWhole(out, parts, mtl.filename().string());
}

void PointCache::writeMdd(const fs::path& out) const
{
    std::vector<double> times;
    for (std::size_t f = 0; f < frames(); ++f) times.push_back(double(f) / scene_.time.fps);
    std::size_t points = 0;
    for (const auto& used : used_) points += used.size();
    tetmesh::writeMdd(out, times, points, [&](std::size_t f) { return cacheFrame(f); });
}

void PointCache::writeUsd(const fs::path& out) const
{
    tetmesh::UsdScene scene{scene_.name, {}, scene_.time.fps, scene_.time.firstFrame, drawing_.materials()};
    for (const scene::Body& body : scene_.bodies) scene.names.push_back(body.name);
    std::vector<const tetmesh::DrawnTopology*> topology;
    for (const DrawnBody& body : rest_) topology.push_back(body.topology.get());
    tetmesh::writeUsda(out, scene, topology, frames(), [&](std::size_t f) { return cacheFrame(f); });
}

std::vector<fs::path> PointCache::filesOf(const fs::path& out)
{
    if (out.extension() == ".usda") return {out};
    if (out.extension() != ".obj")
        throw InputError({out.string(), "'" + out.extension().string() + "' is not what is written here",
                          ".obj (with .mdd), .usda, .ply", ""});
    return {out, fs::path(out).replace_extension(".mtl"), fs::path(out).replace_extension(".mdd")};
}

std::vector<fs::path> PointCache::write(const fs::path& out) const
{
    const std::vector<fs::path> files = filesOf(out);
    if (out.extension() == ".usda")
        writeUsd(out);
    else
        writeObj(out), writeMdd(fs::path(out).replace_extension(".mdd"));
    return files;
}

}  // namespace vdbfrac::core
