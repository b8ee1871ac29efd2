// Frames of a run as a page plays them: points as 16-bit numbers within the bounds of the run, triangles once for all
// frames that share them, all packed.
#pragma once

#include <vdbfrac/report/record.h>
#include <vdbfrac/tetmesh/render_mesh.h>

#include <cstdint>
#include <map>

namespace vdbfrac::report {

/// The .obj frames of a run in no more than about `maxBytes` of the page: where all are too much, every second, third,
/// ... of them and the last. null where the run has none. Throws InputError, FileError.
Json playerOf(const Record& record, std::uint64_t maxBytes);

}  // namespace vdbfrac::report
