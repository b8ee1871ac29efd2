#include <vdbfrac/core/point_cache.h>

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/tetmesh/cache_files.h>
#include <vdbfrac/tetmesh/mtl_file.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace vdbfrac::core {

namespace fs = std::filesystem;

namespace {

std::string keyOf(const char* what, std::size_t body) { return std::string(what) + "_" + std::to_string(body); }

/// Values of some nodes of a frame.
template <class T>
std::vector<T> of(const Archive& archive, const std::string& key, const std::vector<std::uint32_t>& nodes)
{
    const auto all = archive.get<T>(key);
    std::vector<T> values;
    for (std::uint32_t n : nodes) {
        if (n >= all.size()) archive.complain("has too few nodes for the run's last frame");
        values.push_back(all[n]);
    }
    return values;
}

/// What nodes were a frame ago, and what cracks took since, on the way to a frame.
void putWayTo(int frame, const Simulation& simulation, Archive& archive)
{
    for (std::size_t b = 0; b < simulation.bodies().size(); ++b) {
        archive.put(keyOf("before", b), simulation.ancestry()->before(b, frame));
        putTets(archive, keyOf("taken", b), simulation.ancestry()->taken(b, frame));
    }
}

}  // namespace

Archive motionOf(const Simulation& simulation)
{
    Archive archive;
    for (std::size_t b = 0; b < simulation.bodies().size(); ++b) {
        const Body& body = simulation.bodies()[b];
        archive.put(keyOf("x", b), simulation.x().subspan(body.firstNode, body.mesh->nodeCount()));
        archive.put(keyOf("v", b), simulation.v().subspan(body.firstNode, body.mesh->nodeCount()));
    }
    putWayTo(simulation.framesDone(), simulation, archive);
    return archive;
}

PointCache::PointCache(const scene::Scene& scene, const Simulation& simulation, const Drawing& drawing,
                       std::vector<fs::path> motion)
    : scene_(scene), stages_(simulation.stages()), drawing_(drawing), motion_(std::move(motion))
{
    const std::vector<std::vector<BeforeCracks::Tet>> tets = takenTets(simulation);
    for (std::size_t b = 0; b < simulation.bodies().size(); ++b) {
        const Body& body = simulation.bodies()[b];
        before_.emplace_back(tets[b], drawing.outside(b), simulation.stages(), body, scene.time.fps);
    }
    traceBack(simulation);
    const std::vector<PartedFaces> parted = part(simulation);
    for (std::size_t b = 0; b < simulation.bodies().size(); ++b)
        taken_.emplace_back(*drawing.topology(b), scene.output.lipsClosed, simulation.stages(), simulation.bodies()[b],
                            scene.time.fps, parted[b]);
    for (const Body& body : simulation.bodies()) lost_.push_back(1 - body.mesh->volume() / body.startVolume);
    rest_ = frame(0);
    for (const DrawnBody& body : rest_) {
        used_.push_back(tetmesh::usedPoints(body.topology->mesh));
        usedNormals_.push_back(tetmesh::usedNormals(body.topology->mesh));
    }
}

std::string PointCache::lacks() const
{
    constexpr double kMuch = 0.05;  // of the volume
    std::string text;
    std::size_t unknown = 0;
    for (std::size_t b = 0; b < rest_.size(); ++b) {
        unknown += taken_[b].unknown();
        if (lost_[b] > kMuch)
            text += "cracks take " + std::to_string(std::lround(100 * lost_[b])) + " % of body '" +
                    scene_.bodies[b].name +
                    "' by the last frame: material that is lost by then keeps its skin until it goes, but has no torn "
                    "faces, so it looks open "
                    "where it tears (the run's own frames in obj/ and ply/ are closed; a run that ends earlier loses "
                    "less); ";
        if (rest_[b].topology->mesh.faces() == 0)
            text += "body '" + scene_.bodies[b].name + "' is in no frame of a point cache, as cracks take all of it; ";
    }
    if (unknown > 0)
        text += counted(unknown, "face") + " of the surface at the start " + (unknown == 1 ? "is" : "are") +
                " missing from the first frame of a point cache on, as no crack is known to have come; ";
    return text.substr(0, text.size() - std::min<std::size_t>(text.size(), 2));
}

/// As the file of a frame has it; after the last of them, on the way to where the simulation is now.
Archive PointCache::wayTo(std::size_t frame, const Simulation& simulation) const
{
    if (frame < motion_.size()) return Archive::read(motion_[frame]);
    Archive archive;
    putWayTo(int(frame), simulation, archive);
    return archive;
}

/// The tets of each body that cracks took, the last first.
std::vector<std::vector<BeforeCracks::Tet>> PointCache::takenTets(const Simulation& simulation) const
{
    std::vector<std::vector<BeforeCracks::Tet>> tets(simulation.bodies().size());
    for (std::size_t f = motion_.size() + 1; f-- > 0;) {
        const Archive archive = wayTo(f, simulation);
        for (std::size_t b = 0; b < tets.size(); ++b)
            for (const TakenTet& tet : getTets(archive, keyOf("taken", b)))
                tets[b].push_back({tet.X, std::uint32_t(f)});
    }
    return tets;
}

/// Points leave what cracks take where faces would span a gap. Returns when faces that cracks take would.
std::vector<PartedFaces> PointCache::part(const Simulation& simulation)
{
    std::vector<PartedFaces> parted;
    for (std::size_t b = 0; b < before_.size(); ++b) {
        const tetmesh::DrawnTopology& drawn = *drawing_.topology(b);
        parted.emplace_back(drawn, before_[b].moves(drawn.mesh.points.size()), simulation.bodies()[b]);
    }
    if (std::ranges::none_of(parted, &PartedFaces::hasAny)) return parted;
    for (std::size_t f = 0; f < motion_.size(); ++f) {
        const Archive archive = Archive::read(motion_[f]);
        for (std::size_t b = 0; b < parted.size(); ++b)
            if (parted[b].hasAny()) partIn(f, archive, b, parted[b]);
    }
    return parted;
}

void PointCache::partIn(std::size_t frame, const Archive& archive, std::size_t body, PartedFaces& parted)
{
    const auto x = of<Vec3>(archive, keyOf("x", body), *node_[frame][body]);
    const std::vector<Vec3> carried = drawing_.carried(body, std::span(x).first(nodes_[body]));
    std::vector<Vec3> at;
    do {  // what leaves may pull at a neighbour that does not
        at = carried;
        before_[body].carry(frame, x, at);
    } while (before_[body].leave(frame, parted.spanning(at, x)));
    parted.seeTaken(std::uint32_t(frame), at, x);
}

/// Fills node_: classes of nodes only split, so each was one node in every frame before.
void PointCache::traceBack(const Simulation& simulation)
{
    std::vector<Nodes> now;
    for (const Body& body : simulation.bodies()) {
        std::vector<std::uint32_t> own(body.mesh->nodeCount());
        std::iota(own.begin(), own.end(), 0u);
        nodes_.push_back(own.size());
        now.push_back(std::make_shared<const std::vector<std::uint32_t>>(std::move(own)));
    }
    std::vector<std::uint32_t> tets(now.size(), 0);  // of each body, so far
    node_.resize(motion_.size());
    for (std::size_t f = motion_.size() + 1; f-- > 0;) {
        if (f < motion_.size()) node_[f] = now;
        const Archive archive = wayTo(f, simulation);
        for (std::size_t b = 0; b < now.size(); ++b) {
            const auto before = archive.get<std::uint32_t>(keyOf("before", b));
            if (before.empty()) continue;
            std::vector<std::uint32_t> were;
            for (std::uint32_t n : *now[b]) {
                if (n >= before.size()) archive.complain("has too few nodes for the frames after it");
                were.push_back(before[n]);
            }
            for (const TakenTet& tet : getTets(archive, keyOf("taken", b)))
                if (std::ranges::binary_search(before_[b].tets(), tets[b]++))
                    were.insert(were.end(), tet.node.begin(), tet.node.end());
            now[b] = std::make_shared<const std::vector<std::uint32_t>>(std::move(were));
        }
    }
}

/// A frame without what cracks take.
DrawnFrame PointCache::surface(std::size_t number) const
{
    const Archive archive = Archive::read(motion_[number]);
    DrawnFrame all;
    for (std::size_t b = 0; b < node_[number].size(); ++b) {
        const auto atX = of<Vec3>(archive, keyOf("x", b), *node_[number][b]),
                   atV = of<Vec3>(archive, keyOf("v", b), *node_[number][b]);
        const std::size_t own = nodes_[b];
        DrawnBody& drawn = all.emplace_back(drawing_.body(b, std::span(atX).first(own), std::span(atV).first(own)));
        before_[b].carry(number, atX, drawn.points), before_[b].carry(number, atV, drawn.velocity);
    }
    drawing_.finish(stages_, double(number) / scene_.time.fps, all);
    return all;
}

const std::vector<std::vector<Vec3>>& PointCache::placesIn(std::size_t number) const
{
    if (last_.points.empty() || last_.frame != number) {
        last_ = {number, {}};
        for (DrawnBody& body : surface(number)) last_.points.push_back(std::move(body.points));
    }
    return last_.points;
}

DrawnFrame PointCache::frame(std::size_t number) const
{
    const auto looksBack = [&](std::size_t frame) {
        return frame > 0 && std::ranges::any_of(taken_, [&](const TakenFaces& taken) { return taken.goesIn(frame); });
    };
    DrawnFrame all = surface(number);
    Places own{number, {}};
    if (looksBack(number + 1))
        for (const DrawnBody& body : all) own.points.push_back(body.points);
    const bool looks = looksBack(number);
    for (std::size_t b = 0; b < all.size(); ++b)
        taken_[b].addTo(number, looks ? std::span(placesIn(number - 1)[b]) : std::span<const Vec3>(), all[b]);
    last_ = std::move(own);
    return all;
}

std::vector<tetmesh::CacheFrame> PointCache::cacheFrame(std::size_t number) const
{
    std::vector<tetmesh::CacheFrame> all;
    const bool moves = scene_.solver.integrator != scene::Integrator::statics;
    const DrawnFrame drawn = frame(number);
    for (std::size_t b = 0; b < used_.size(); ++b) {
        tetmesh::CacheFrame& one = all.emplace_back();
        for (std::uint32_t p : used_[b]) {
            one.points.push_back(drawn[b].points[p]);
            if (moves) one.velocities.push_back(drawn[b].velocity[p]);
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
    else {
        // Whenever this is killed, no points of an earlier cache stand beside faces of this one.
        const fs::path mdd = fs::path(out).replace_extension(".mdd");
        removeFile(mdd);
        writeObj(out), writeMdd(mdd);
    }
    return files;
}

}  // namespace vdbfrac::core
