// vdbfrac mesh, in two directions: solids to tets, level sets and frames to surfaces.
#pragma once

#include "options.h"

#include <vdbfrac/cli/commands.h>
#include <vdbfrac/mesher/delaunay.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace vdbfrac::cli {

struct MeshOptions {
    std::filesystem::path in, out;
    CommonOptions common;
    int threads = 0;
    std::uint64_t memoryLimit = 0;  ///< bytes

    std::string grid;  ///< of a .vdb; empty takes the first level set
    // To tets.
    std::string tets = "lattice";       ///< lattice, five, cut, delaunay
    double size = 0;                    ///< m; 0: by `across`
    int across = 0;                     ///< voxels along the longest side; 0: 64, or the voxels of the .vdb
    mesher::DelaunayCriteria delaunay;  ///< sizes that are 0 follow from `size`
    double sharpDegrees = 0;            ///< 0: no sharp edges are kept
    std::string mshVersion = "4.1";
    std::filesystem::path quality;  ///< where the report goes as JSON; empty: nowhere
    // To surfaces.
    std::vector<int> frames;  ///< empty: all of a run
    double adaptivity = 0;
};

/// Surface (.obj, .stl, .ply, .off) or level set (.vdb) to a mesh of tets, with a report.
int meshTets(const MeshOptions& options);
/// Level sets, one or a sequence, or frames of a run to triangle surfaces. Prints the names of the files.
int meshSurfaces(const MeshOptions& options);

}  // namespace vdbfrac::cli
