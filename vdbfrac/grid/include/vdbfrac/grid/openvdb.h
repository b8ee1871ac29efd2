// Level sets of a program that has them in memory. Who includes this links OpenVDB too (OpenVDB::openvdb, which
// find_package(vdbfrac) finds); all other headers do without it.
#pragma once

#include <vdbfrac/grid/vdb_file.h>

#include <openvdb/openvdb.h>

namespace vdbfrac::grid {

/// A copy, checked as readLevelSet checks one from a file, and throwing as that does; `what` names it in messages.
/// Distances in m, below 0 inside.
ReadLevelSet fromOpenVdb(const openvdb::FloatGrid& grid, const std::string& what = "the grid");

/// The grid itself: it changes with its level set, and lives on without it.
openvdb::FloatGrid::ConstPtr toOpenVdb(const LevelSet& phi);

}  // namespace vdbfrac::grid
