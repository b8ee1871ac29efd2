// Surfaces of one topology over many frames, for programs that play them.
#pragma once

#include <vdbfrac/tetmesh/render_mesh.h>

#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace vdbfrac::tetmesh {

/// A frame of a body: positions [m] and velocities [m/s], if it has any, of the points that its faces use, and what
/// usedNormals() says.
struct CacheFrame {
    std::vector<Vec3> points, velocities, normals;
};
/// Gives the bodies of a frame, asked for in order.
using CacheFrames = std::function<std::vector<CacheFrame>(std::size_t frame)>;

/// Writes positions as .mdd atomically: big-endian, frames and points (int32), times (float, s), then x y z (float) of
/// all points of each frame. Throws FileError.
void writeMdd(const std::filesystem::path& file, std::span<const double> times, std::size_t points,
              const CacheFrames& frames);

/// Writes bodies as a USD text file atomically: a mesh each, with points, velocities and normals as time samples,
/// texture coordinates, places at rest, and for each face its fragment and whether it is torn; and the materials of
/// faces, with colours and textures of the library `materials` (as mtlText takes it). `names`: of the bodies. Frames
/// are numbered from `firstFrame`. Throws FileError.
struct UsdScene {
    std::string name;
    std::vector<std::string> names;
    double fps = 24;
    int firstFrame = 1;
    std::string materials;
};
void writeUsda(const std::filesystem::path& file, const UsdScene& scene, std::span<const DrawnTopology* const> bodies,
               std::size_t frames, const CacheFrames& give);

/// A body of a .ply frame: positions [m] and velocities [m/s] of the points of its topology, and values of them.
struct PlyBody {
    const DrawnTopology& topology;
    std::span<const Vec3> points, velocities;
    std::vector<std::vector<float>> values;  ///< in the order of their names
};
/// The order of points and faces in a file: that of the topology, or fragment by fragment as in an .obj frame, in which
/// point k is vertex k then.
enum class PlyOrder { asGiven, byFragment };

/// Writes a frame as binary .ply atomically: x y z, vx vy vz, rest_x rest_y rest_z of points as floats and what `names`
/// call their values, and of faces `fragment` (int) and `torn` (0 or 1). Throws FileError.
void writePlyFrame(const std::filesystem::path& file, std::span<const PlyBody> bodies, PlyOrder order,
                   std::span<const std::string> names = {});
/// The values of the points of such a file, by their names: all but places and velocities. Throws FileError,
/// InputError.
std::map<std::string, std::vector<float>> readPlyValues(const std::filesystem::path& file);
/// No more than one value in 200 is above it: where colours for values end that peak at single points, as energy does
/// at the tip of a crack. 0 without values.
float highEndOf(std::vector<float> values);
/// The least of those that are one, from 0 on: where colours begin for values that count from their first, as times of
/// tearing do. Infinity without any.
float lowEndOf(std::span<const float> values);

}  // namespace vdbfrac::tetmesh
