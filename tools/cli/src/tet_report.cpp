#include "tet_report.h"

#include <vdbfrac/grid/relevel.h>
#include <vdbfrac/lab/machine/memory.h>

#include <nlohmann/json.hpp>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace vdbfrac::cli {

namespace {

std::string volumeText(const TetReport& report, const TetResult& result)
{
    const auto against = [&](const char* what, double volume) {
        return fmt::format(", {} {:.6g} m^3 ({:+.3f} %)", what, volume,
                           100 * grid::volumeChange(result.materialVolume, volume));
    };
    return fmt::format("volume {:.6g} m^3", result.materialVolume) +
           (report.inputVolume > 0 ? against("the input has", report.inputVolume) : "") +
           against("its level set", report.levelSetVolume) +
           fmt::format(", {} inverted tets\n", report.quality.inverted);
}

/// Lattice nodes are there once for each part that a cell is cut into.
std::string copiesText(const TetReport& report)
{
    return report.coincidentPoints == 0
               ? ""
               : fmt::format(
                     "{} points lie on another one: copies of a node, for parts that do not hang together in the cells "
                     "round it: at cracks, slits, gaps and thin places. Joining them would join the parts\n",
                     report.coincidentPoints);
}

}  // namespace

std::size_t coincidentPoints(const tetmesh::TetMesh& mesh)
{
    const auto before = [](const Vec3& a, const Vec3& b) {
        return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
    };
    std::vector<Vec3> sorted(mesh.points.begin(), mesh.points.end());
    std::sort(sorted.begin(), sorted.end(), before);
    return std::size_t(sorted.end() - std::unique(sorted.begin(), sorted.end()));
}

std::string reportText(const TetReport& report, const TetResult& result, const std::string& kind)
{
    const tetmesh::TetQuality& q = report.quality;
    std::string text = fmt::format("{} tets ({}), {} points, {} triangles of boundary\n", result.mesh.tets.size(), kind,
                                   result.mesh.points.size(), result.mesh.boundary.size());
    text += copiesText(report) + volumeText(report, result);
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
        {"input_volume", report.inputVolume > 0 ? nlohmann::json(report.inputVolume) : nlohmann::json()},
        {"volume_error", grid::volumeChange(result.materialVolume,
                                            report.inputVolume > 0 ? report.inputVolume : report.levelSetVolume)},
        {"level_set_volume_error", grid::volumeChange(result.materialVolume, report.levelSetVolume)},
        {"coincident_points", report.coincidentPoints},
        {"tet_volume", {{"sum", q.volume}, {"smallest", q.smallestVolume}}},
        {"inverted", q.inverted},
        {"dihedral_degrees",
         {{"smallest", q.smallestDihedral}, {"largest", q.largestDihedral}, {"histogram", q.dihedrals}}},
        {"radius_ratio", {{"smallest", q.smallestRadiusRatio}, {"mean", q.meanRadiusRatio}}},
        {"seconds", seconds},
        {"peak_memory", lab::peakMemory()},
    };
    return json.dump(1) + "\n";
}

}  // namespace vdbfrac::cli
