// Which voxels near a surface are outside: those that a way leads to which crosses no triangle. Not installed.
#pragma once

#include "triangles.h"

#include <openvdb/openvdb.h>

#include <cstdint>

namespace vdbfrac::grid {

/// Takes the signs of tools::meshToVolume, which come from filling outside space by voxels more than 0.75 voxels off
/// the surface and so do not enter slits, and settles those of voxels near the surface by the surface itself. A voxel
/// is outside when one of its 26 neighbours is and the way between them crosses no triangle. What no such way leads to
/// stays inside: closed hollows, and what several shells cover together. Surface in there is forgotten. `phi` and
/// `closest`, the triangle closest to each voxel, are from meshToVolume without removal of intersections and without
/// renormalization, with the same band on both sides. The same bits for any number of threads.
/// Returns the number of pairs of neighbouring voxels inside that have a gap between them: it is filled.
std::int64_t settleSigns(openvdb::FloatGrid& phi, const openvdb::Int32Grid& closest, const Triangles& triangles);

}  // namespace vdbfrac::grid
