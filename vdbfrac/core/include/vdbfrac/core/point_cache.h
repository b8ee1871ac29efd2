// One topology over all frames of a run: the surface is cut once, by the cracks of the run's end, and its points are
// where their material was in each frame before, also what cracks took later. Programs that play frames call this a
// point cache.
#pragma once

#include <vdbfrac/core/archive.h>
#include <vdbfrac/core/before_cracks.h>
#include <vdbfrac/core/drawing.h>
#include <vdbfrac/core/simulation.h>
#include <vdbfrac/core/taken_faces.h>
#include <vdbfrac/scene/scene.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace vdbfrac::core {

/// Where all nodes are, and which they were a frame ago: what a frame keeps for a point cache.
Archive motionOf(const Simulation& simulation);

class PointCache {
public:
    /// `drawing` follows `simulation` whole, which is at the last of the frames or on the way to the next; both have to
    /// live as long. `motion`: the file of each frame. Throws FileError.
    PointCache(const scene::Scene& scene, const Simulation& simulation, const Drawing& drawing,
               std::vector<std::filesystem::path> motion);

    std::size_t frames() const { return motion_.size(); }
    /// What frames lack of the surface, a sentence, or nothing.
    std::string lacks() const;
    /// All bodies of a frame, counted from 0. Throws FileError.
    DrawnFrame frame(std::size_t number) const;
    /// NAME.obj, NAME.mtl and NAME.mdd; or NAME.usda. Throws InputError for another extension.
    static std::vector<std::filesystem::path> filesOf(const std::filesystem::path& out);
    /// Writes NAME.obj, the first frame, NAME.mtl, and NAME.mdd, the positions of its points in all frames; or
    /// NAME.usda. Returns the files. Throws FileError; InputError for another extension.
    std::vector<std::filesystem::path> write(const std::filesystem::path& out) const;

private:
    using Nodes = std::shared_ptr<const std::vector<std::uint32_t>>;

    Archive wayTo(std::size_t frame, const Simulation& simulation) const;
    std::vector<std::vector<BeforeCracks::Tet>> takenTets(const Simulation& simulation) const;
    void traceBack(const Simulation& simulation);
    std::vector<PartedFaces> part(const Simulation& simulation);
    void partIn(std::size_t frame, const Archive& archive, std::size_t body, PartedFaces& parted);
    std::vector<tetmesh::CacheFrame> cacheFrame(std::size_t number) const;
    DrawnFrame surface(std::size_t number) const;
    const std::vector<std::vector<Vec3>>& placesIn(std::size_t number) const;
    void writeObj(const std::filesystem::path& out) const;
    void writeMdd(const std::filesystem::path& out) const;
    void writeUsd(const std::filesystem::path& out) const;

    const scene::Scene& scene_;
    const Stages& stages_;
    const Drawing& drawing_;
    std::vector<std::filesystem::path> motion_;
    std::vector<std::size_t> nodes_;  // of each body now
    // Of each frame and body: what these nodes were, then those of tets that cracks take later and
    // that carry points.
    std::vector<std::vector<Nodes>> node_;
    std::vector<double> lost_;                                    // of each body, of its volume by the last frame
    DrawnFrame rest_;                                             // the first frame
    std::vector<std::vector<std::uint32_t>> used_, usedNormals_;  // points and normals that faces use, of each body
    std::vector<BeforeCracks> before_;                            // of each body
    std::vector<TakenFaces> taken_;                               // of each body
    /// Points of all bodies in one frame, without those of taken_, where the next looks back at them: frames are asked
    /// for one after the other.
    struct Places {
        std::size_t frame = 0;
        std::vector<std::vector<Vec3>> points;  // m; none before the first
    };
    mutable Places last_;
};

}  // namespace vdbfrac::core
