// A narrow-band level set, phi < 0 in the material, in the rest configuration. OpenVDB stays behind this header.
#pragma once

#include <vdbfrac/base/vec.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace vdbfrac::grid {

struct LevelSetGrid;  // holds the openvdb::FloatGrid; src/openvdb_access.h

/// Owner of one OpenVDB level set. Voxel ijk sits at world X = dx * ijk: there is no translation,
/// so voxel coordinates are lattice coordinates.
class LevelSet {
public:
    LevelSet();  ///< empty, dx = 1 m
    explicit LevelSet(std::unique_ptr<LevelSetGrid> grid);
    LevelSet(LevelSet&&) noexcept;
    LevelSet& operator=(LevelSet&&) noexcept;
    ~LevelSet();

    double voxelSize() const;   ///< dx [m]
    double background() const;  ///< half width of the band [m]
    std::size_t activeVoxels() const;
    LevelSet copy() const;

    LevelSetGrid& grid() { return *grid_; }
    const LevelSetGrid& grid() const { return *grid_; }

private:
    std::unique_ptr<LevelSetGrid> grid_;
};

}  // namespace vdbfrac::grid
