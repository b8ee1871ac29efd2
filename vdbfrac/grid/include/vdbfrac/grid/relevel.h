// Whatever describes a surface -> a clean narrow-band level set: a signed distance of one voxel size and half width.
#pragma once

#include <vdbfrac/base/ledger.h>
#include <vdbfrac/grid/level_set.h>
#include <vdbfrac/tetmesh/surface_input.h>

#include <cstdint>
#include <filesystem>
#include <string>

namespace vdbfrac::grid {

/// |grad phi| by central differences, over voxels whose six neighbours are in the band. 1 everywhere on a distance, but
/// less at its creases.
struct GradientStatistics {
    std::int64_t voxels = 0;
    double mean = 0, least = 0, most = 0;
    double rms = 0;  ///< of |grad phi| - 1
};

struct LevelSetReport {
    double volume = 0;          ///< [m^3], enclosedVolume
    double area = 0;            ///< [m^2], of the triangles of surfaceOf
    GradientStatistics beside;  ///< within one voxel of the surface
    GradientStatistics band;    ///< all of the band
};
/// The same bits for any number of threads.
LevelSetReport measure(const LevelSet& phi);

/// The band to make. Voxel ijk of a level set of another voxel size than its source lies at voxelSize * ijk.
struct Band {
    double voxelSize = 0;  ///< [m]; 0: that of the source, or by `across`
    int across = 0;        ///< voxels along the longest side of the material; used when voxelSize is 0
    int halfWidth = 3;     ///< voxels on either side, 2 or more
    std::uint64_t memoryLimit = ~std::uint64_t{0};  ///< bytes
};
/// voxelSize [m] of a band round a thing whose longest side is `longest` [m]; `given` when the band names none.
double voxelSizeOf(const Band& band, double longest, double given = 0);

/// Level set of a closed surface, by the closest triangle of each voxel. `report` is what tetmesh::examine says of the
/// surface; `inset` [m] >= 0 moves the result inward, as for a wrap that lies outside of what it wraps.
/// `name` is for complaints. `gaps` becomes the number of pairs of neighbouring voxels inside with a gap of the surface
/// between them, too narrow for the voxels: it is filled. Throws InputError (nothing inside, too far away), LimitError.
struct SurfaceSource {
    const tetmesh::PolygonSoup& soup;
    const tetmesh::SurfaceReport& report;
    double inset = 0;
    std::string name;
};
LevelSet surfaceLevelSet(const SurfaceSource& surface, const Band& band, std::int64_t* gaps = nullptr);
/// What there is to say of them.
std::string gapText(std::int64_t gaps, double voxelSize);

/// How far the volume of a level set is from that of what it was made of, relative; 0 where that has none.
double volumeChange(double made, double input);
/// What there is to say of it; empty where it is no more than voxels that are fit for a shape round off.
std::string volumeText(double made, double input, double voxelSize);

/// How phi is made a distance again. `track`: voxels beside the surface keep their values, but where phi is clearly
/// steeper than a distance; the others follow by LevelSetTracker's sweeps. So repeating it moves no surface.
/// `sweep`: voxels beside the surface get their distance to the zero of a cubic through phi, the others theirs by
/// fast sweeping (Zhao 2004), then by the same sweeps. `automatic`: by |grad phi| beside the surface.
enum class Redistancing { automatic, track, sweep };

struct RelevelOptions {
    Band band;
    Redistancing redistancing = Redistancing::automatic;
};

struct Relevelled {
    LevelSet levelSet;
    LevelSetReport before, after;
    bool resampled = false;
    Redistancing redistancing = Redistancing::track;  ///< the one that was used
    Ledger work;                                      ///< stages "read", "measure", "redistance", "resample"
};

/// Re-levels a level set, or whatever float grid has a surface at its zero. Throws InputError, LimitError.
Relevelled relevel(const LevelSet& source, const RelevelOptions& options);
/// The same for a grid of a file (the first of floats when `grid` is empty), of class level set or none, with any
/// linear transform. Throws FileError too.
Relevelled relevelFile(const std::filesystem::path& file, const std::string& grid, const RelevelOptions& options);

}  // namespace vdbfrac::grid
