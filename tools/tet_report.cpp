#include "tet_report.h"

#include "memory.h"

#include <nlohmann/json.hpp>
#include <spdlog/fmt/fmt.h>

#include <cmath>

namespace vdbfrac::tools {

namespace {

double volumeError(const TetReport& report, const TetResult& result)
{
    return report.levelSetVolume > 0 ? result.materialVolume / report.levelSetVolume - 1 : 0;
}

}  // namespace

std::string reportText(const TetReport& report, const TetResult& result, const std::string& kind)
{
    const tetmesh::TetQuality& q = report.quality;
    std::string text = fmt::format("{} tets ({}), {} points, {} triangles of boundary\n", result.mesh.tets.size(), kind,
                                   result.mesh.points.size(), result.mesh.boundary.size());
    text += fmt::format("volume {:.6g} m^3, the level set has {:.6g} m^3 ({:+.3f} %), {} inverted tets\n",
                        result.materialVolume, report.levelSetVolume, 100 * volumeError(report, result), q.inverted);
    text += fmt::format("dihedral angles {:.2f} to {:.2f} degrees; radius ratio {:.3f} at least, {:.3f} on average\n",
                        q.smallestDihedral, q.largestDihedral, q.smallestRadiusRatio, q.meanRadiusRatio);
    std::int64_t most = 1;
    for (std::int64_t n : q.dihedrals) most = std::max(most, n);
    for (std::size_t b = 0; b < tetmesh::kDihedralBins; ++b)
        text += fmt::format("{:4d}-{:3d}  {:9d}  {}\n", 10 * b, 10 * b + 10, q.dihedrals[b],
                            std::string(std::size_t(std::lround(40. * double(q.dihedrals[b]) / double(most))), '#'));
    text.pop_back();
    return text;
}

std::string reportJson(const TetReport& report, const TetResult& result, const std::string& kind, const Ledger& work)
{
    const tetmesh::TetQuality& q = report.quality;
    nlohmann::json seconds = nlohmann::json::object();
    for (const StageWork& stage : work.stages()) seconds[stage.name] = stage.seconds;
    const nlohmann::json json = {
        {"kind", kind},
        {"points", result.mesh.points.size()},
        {"tets", result.mesh.tets.size()},
        {"boundary_triangles", result.mesh.boundary.size()},
        {"voxel_size", report.voxelSize},
        {"level_set_volume", report.levelSetVolume},
        {"material_volume", result.materialVolume},
        {"volume_error", volumeError(report, result)},
        {"tet_volume", {{"sum", q.volume}, {"smallest", q.smallestVolume}}},
        {"inverted", q.inverted},
        {"dihedral_degrees",
         {{"smallest", q.smallestDihedral}, {"largest", q.largestDihedral}, {"histogram", q.dihedrals}}},
        {"radius_ratio", {{"smallest", q.smallestRadiusRatio}, {"mean", q.meanRadiusRatio}}},
        {"seconds", seconds},
        {"peak_memory", peakMemory()},
    };
    return json.dump(1) + "\n";
}

}  // namespace vdbfrac::tools
