// What vdbfrac mesh says of the tets it made.
#pragma once

#include <vdbfrac/base/ledger.h>
#include <vdbfrac/tetmesh/tet_file.h>
#include <vdbfrac/tetmesh/tet_quality.h>

#include <string>

namespace vdbfrac::tools {

struct TetResult {
    tetmesh::TetMesh mesh;
    tetmesh::TetFields fields;
    double materialVolume = 0;  ///< m^3; of the whole tets of a lattice, the part within the surface
};

struct TetReport {
    double voxelSize = 0;       ///< of the level set [m]
    double levelSetVolume = 0;  ///< m^3
    tetmesh::TetQuality quality;
};

std::string reportText(const TetReport& report, const TetResult& result, const std::string& kind);
std::string reportJson(const TetReport& report, const TetResult& result, const std::string& kind, const Ledger& work);

}  // namespace vdbfrac::tools
