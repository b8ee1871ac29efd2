// What vdbfrac mesh says of the tets it made.
#pragma once

#include <vdbfrac/base/ledger.h>
#include <vdbfrac/tetmesh/tet_file.h>
#include <vdbfrac/tetmesh/tet_quality.h>

#include <string>

namespace vdbfrac::cli {

struct TetResult {
    tetmesh::TetMesh mesh;
    tetmesh::TetFields fields;
    double materialVolume = 0;  ///< m^3; of the whole tets of a lattice, the part within the surface
};

struct TetReport {
    double voxelSize = 0;       ///< of the level set [m]
    double levelSetVolume = 0;  ///< m^3
    double inputVolume = 0;     ///< m^3; 0: not known
    std::size_t coincidentPoints = 0;
    tetmesh::TetQuality quality;
};

/// Points that lie where another does.
std::size_t coincidentPoints(const tetmesh::TetMesh& mesh);

std::string reportText(const TetReport& report, const TetResult& result, const std::string& kind);
std::string reportJson(const TetReport& report, const TetResult& result, const std::string& kind, const Ledger& work);

}  // namespace vdbfrac::cli
