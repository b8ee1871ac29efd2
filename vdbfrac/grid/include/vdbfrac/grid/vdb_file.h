// .vdb files: written atomically and verified, read with the known holes of OpenVDB 10 closed.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/grid/level_set.h>
#include <vdbfrac/grid/voxel_values.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace vdbfrac::grid {

/// One grid of a file: a level set in rest space, or values on voxels.
struct NamedGrid {
    std::string name;
    const LevelSet* levelSet = nullptr;
    VoxelValues values;    ///< used when levelSet is null
    double voxelSize = 1;  ///< of `values` [m]
    std::string unit;      ///< metadata "units"; may be empty
};

using Metadata = std::map<std::string, std::variant<std::string, double, std::int64_t>>;

/// Writes all grids to one file (Blosc or zip, whatever the library has), atomically; the temporary is read back and
/// compared. `metadata` goes to the file and to every grid. Throws FileError.
void writeVdb(const std::filesystem::path& file, const std::vector<NamedGrid>& grids, const Metadata& metadata);

/// What a file holds.
struct GridInfo {
    std::string name, type, gridClass;
    std::int64_t activeVoxels = 0;
    double voxelSize = 0;
    Coord lower, upper;                                         ///< of the active voxels
    Vec3 lowerWorld = Vec3::Zero(), upperWorld = Vec3::Zero();  ///< of their centers [m]
    std::map<std::string, std::string> metadata;
    std::optional<double> background;  ///< of a grid of floats: the value where nothing is stored
};
/// Reads all of it. Throws FileError for what is damaged, LimitError for what is larger than `memoryLimit` bytes.
std::vector<GridInfo> describeVdb(const std::filesystem::path& file, std::uint64_t memoryLimit = ~std::uint64_t{0});

/// Reads one level set (the first when `name` is empty), checked: magic, version, class, uniform voxel size, finite
/// values, extents, a band between inside and outside. Throws FileError for what is damaged, InputError for what is not
/// a level set, LimitError. The transform's translation is kept in `origin` [m]: the world position of voxel (0,0,0).
struct ReadLevelSet {
    LevelSet levelSet;
    Vec3 origin = Vec3::Zero();
};
ReadLevelSet readLevelSet(const std::filesystem::path& file, const std::string& name,
                          std::uint64_t memoryLimit = ~std::uint64_t{0});

}  // namespace vdbfrac::grid
