#include <vdbfrac/report/player.h>
#include <vdbfrac/report/run_frames.h>

#include "compressed.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/tetmesh/cache_files.h>
#include <vdbfrac/tetmesh/mtl_file.h>
#include <vdbfrac/tetmesh/obj_file.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace vdbfrac::report {

namespace fs = std::filesystem;

namespace {

constexpr double kSteps = 65535;  // of a 16-bit number

using PointValues = std::map<std::string, std::vector<float>>;

struct Frame {
    int number = 0;
    double time = 0;
    std::vector<Vec3> points;
    PointValues values;  // of points, where the run has .ply frames
    std::size_t topology = 0;
};

/// A value of points that the player can show. Below 0 there is none.
struct Shown {
    const char *name, *label, *unit;
    bool byRoot;     // colours go with its root, as stress does with energy; it peaks at single points
    bool fromFirst;  // colours begin at the lowest, not at 0
};
constexpr Shown kShown[] = {{"energy", "Elastic energy", "J/m\u00b3", true, false},
                            {"margin", "How near it is to tearing", "", false, false},
                            {"arrival", "When it tore", "s", false, true}};

/// The values that colours begin and end with.
struct Ends {
    double low = 0, high = 0;
};

/// What does not change while nothing tears.
struct Topology {
    std::size_t points = 0, triangles = 0;
    Bytes bytes;
};

/// Numbers for the materials of all frames.
class Materials {
public:
    explicit Materials(std::map<std::string, Vec3> colours) : colours_(std::move(colours)) {}

    std::uint8_t number(const std::string& name)
    {
        constexpr std::size_t kMost = 256;
        const auto place = std::size_t(std::find(names_.begin(), names_.end(), name) - names_.begin());
        if (place == names_.size() && place < kMost) names_.push_back(name);
        return std::uint8_t(std::min(place, kMost - 1));
    }
    Json hues() const
    {
        Json all = Json::array();
        for (const std::string& name : names_) {
            const auto it = colours_.find(name);
            const Vec3 c = it == colours_.end() ? Vec3(.53, .50, .45) : it->second;
            const auto part = [&](int k) { return int(std::lround(255 * std::clamp(c[k], 0., 1.))); };
            all.push_back(fmt::format("#{:02x}{:02x}{:02x}", part(0), part(1), part(2)));
        }
        return all;
    }

private:
    std::map<std::string, Vec3> colours_;
    std::vector<std::string> names_;
};

/// Triangles as differences of indices, then fragment, torn and material of each.
Topology topologyOf(const tetmesh::DrawnTopology& drawn, Materials& materials)
{
    const tetmesh::RenderMesh& mesh = drawn.mesh;
    const tetmesh::Fans fans = tetmesh::fansOf(mesh);
    std::vector<std::uint32_t> steps;
    std::vector<std::uint16_t> fragments;
    Bytes torn, material;
    std::uint32_t last = 0;
    for (std::size_t t = 0; t < fans.face.size(); ++t) {
        for (const std::uint32_t corner : fans.corners[t]) {
            const std::uint32_t index = mesh.corners[corner].point;
            const std::int32_t step = std::int32_t(index - last);
            steps.push_back((std::uint32_t(step) << 1) ^ std::uint32_t(step >> 31));
            last = index;
        }
        const std::uint32_t face = fans.face[t], m = mesh.material[face];
        fragments.push_back(std::uint16_t(drawn.fragment[face]));
        torn.push_back(drawn.torn[face]);
        material.push_back(materials.number(m == tetmesh::RenderMesh::kNone ? "outside" : mesh.materials[m]));
    }
    Topology topology{mesh.points.size(), fans.face.size(), {}};
    addPlanes<std::uint32_t>(steps, topology.bytes);
    addPlanes<std::uint16_t>(fragments, topology.bytes);
    topology.bytes.insert(topology.bytes.end(), torn.begin(), torn.end());
    topology.bytes.insert(topology.bytes.end(), material.begin(), material.end());
    return topology;
}

class Player {
public:
    explicit Player(const Record& record)
        : materials_(coloursOf(record)), files_(framesOf(record.manifest, record.folder).frames)
    {
        std::erase_if(files_, [](const RunFrame& f) { return f.obj.empty(); });
        for (const RunFrame& f : files_)
            for (const fs::path& file : {f.obj, f.ply}) requireWhole(f, file);
    }

    Json make(std::uint64_t maxBytes)
    {
        if (files_.empty()) return nullptr;
        std::size_t every = thinned(maxBytes);
        for (;;) {
            Json page = packed(every);
            const double over = double(size(page)) / double(maxBytes);
            if (over <= 1 || every >= files_.size()) return page;
            every = std::max(every + 1, std::size_t(double(every) * over));
        }
    }

private:
    static std::map<std::string, Vec3> coloursOf(const Record& record)
    {
        const fs::path mtl = record.folder / "obj" / (record.manifest["scene"].get<std::string>() + ".mtl");
        return fs::exists(mtl) ? tetmesh::diffuseColours(readText(mtl)) : std::map<std::string, Vec3>{};
    }

    /// The least n of which only every n-th frame may fit, by the sizes of the files.
    std::size_t thinned(std::uint64_t maxBytes) const
    {
        constexpr double kPacking = 100;  // of text to packed numbers, at best: 81 were measured
        double bytes = 0;
        for (const RunFrame& f : files_) bytes += double(fs::file_size(f.obj));
        return std::size_t(std::clamp(std::ceil(bytes / (kPacking * double(maxBytes))), 1., double(files_.size())));
    }

    static std::size_t size(const Json& page)
    {
        std::size_t bytes = 0;
        for (const char* part : {"topologies", "frames"})
            for (const Json& entry : page[part]) bytes += entry["data"].get_ref<const std::string&>().size();
        for (const Json& frame : page["frames"])
            for (const Json& values : frame["values"]) bytes += values.get_ref<const std::string&>().size();
        return bytes;
    }

    Json packed(std::size_t every)
    {
        read(every);
        Json page = {{"low", {low_[0], low_[1], low_[2]}},
                     {"high", {high_[0], high_[1], high_[2]}},
                     {"materials", materials_.hues()},
                     {"topologies", Json::array()},
                     {"frames", Json::array()},
                     {"values", Json::array()}};
        for (const Shown& shown : kShown)
            if (const Ends ends = endsOf(shown); ends.high > ends.low)
                page["values"].push_back({{"name", shown.name},
                                          {"label", shown.label},
                                          {"unit", shown.unit},
                                          {"byRoot", shown.byRoot},
                                          {"low", ends.low},
                                          {"high", ends.high}});
        for (const Topology& t : topologies_)
            page["topologies"].push_back(
                {{"points", t.points}, {"triangles", t.triangles}, {"data", base64(compressed(t.bytes))}});
        for (const Frame& f : frames_) {
            Json values = Json::array();  // in the order of page["values"]
            for (const Json& shown : page["values"])
                values.push_back(
                    base64(compressed(codesOf(f, shown["name"], Ends{shown["low"], shown["high"]}, shown["byRoot"]))));
            page["frames"].push_back({{"frame", f.number},
                                      {"time", f.time},
                                      {"topology", f.topology},
                                      {"data", base64(compressed(bytesOf(f.points)))},
                                      {"values", values}});
        }
        return page;
    }

    /// Over all frames; none where a frame has no such values, or other points than its .obj.
    Ends endsOf(const Shown& shown) const
    {
        float low = std::numeric_limits<float>::infinity(), high = 0;
        for (const Frame& f : frames_) {
            const auto it = f.values.find(shown.name);
            if (it == f.values.end() || it->second.size() != f.points.size()) return {};
            if (it->second.empty()) continue;
            high = std::max(high, shown.byRoot ? tetmesh::highEndOf(it->second)
                                               : *std::max_element(it->second.begin(), it->second.end()));
            low = std::min(low, tetmesh::lowEndOf(it->second));
        }
        if (!std::isfinite(high)) return {};
        return {shown.fromFirst && low < high ? low : 0, high};
    }

    /// 0: none; 1 to 255: from the low end to the high one.
    static Bytes codesOf(const Frame& frame, const std::string& name, const Ends& ends, bool byRoot)
    {
        constexpr double kCodes = 254;
        Bytes codes;
        for (const float v : frame.values.at(name)) {
            const double share = std::clamp((double(v) - ends.low) / (ends.high - ends.low), 0., 1.);
            codes.push_back(v < 0 ? 0 : std::uint8_t(1 + std::lround(kCodes * (byRoot ? std::sqrt(share) : share))));
        }
        return codes;
    }

    void read(std::size_t every)
    {
        frames_.clear(), topologies_.clear();
        low_ = Vec3::Constant(std::numeric_limits<double>::infinity()), high_ = -low_;
        for (std::size_t i = 0; i < files_.size(); ++i) {
            if (i % every != 0 && i + 1 != files_.size()) continue;
            tetmesh::DrawnTopology drawn = tetmesh::readDrawnObj(files_[i].obj);
            Topology topology = topologyOf(drawn, materials_);
            if (topologies_.empty() || topology.bytes != topologies_.back().bytes ||
                topology.points != topologies_.back().points)
                topologies_.push_back(std::move(topology));
            for (const Vec3& p : drawn.mesh.points) low_ = low_.cwiseMin(p), high_ = high_.cwiseMax(p);
            PointValues values = files_[i].ply.empty() ? PointValues() : tetmesh::readPlyValues(files_[i].ply);
            frames_.push_back({files_[i].frame, files_[i].time, std::move(drawn.mesh.points), std::move(values),
                               topologies_.size() - 1});
        }
        if (!(low_[0] <= high_[0])) low_ = high_ = Vec3::Zero();
    }

    /// Differences of the numbers of points, one coordinate behind the other.
    Bytes bytesOf(const std::vector<Vec3>& points) const
    {
        Bytes bytes;
        std::vector<std::uint16_t> steps(points.size());
        for (int k = 0; k < 3; ++k) {
            const double scale = high_[k] > low_[k] ? kSteps / (high_[k] - low_[k]) : 0;
            std::uint16_t last = 0;
            for (std::size_t i = 0; i < points.size(); ++i) {
                const auto number = std::uint16_t(std::lround((points[i][k] - low_[k]) * scale));
                steps[i] = std::uint16_t(number - last);
                last = number;
            }
            addPlanes<std::uint16_t>(steps, bytes);
        }
        return bytes;
    }

    Materials materials_;
    std::vector<RunFrame> files_;  // with .obj
    std::vector<Frame> frames_;
    std::vector<Topology> topologies_;
    Vec3 low_ = Vec3::Zero(), high_ = Vec3::Zero();  // m
};

}  // namespace

Json playerOf(const Record& record, std::uint64_t maxBytes) { return Player(record).make(maxBytes); }

}  // namespace vdbfrac::report
