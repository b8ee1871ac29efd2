#include "relevel_report.h"

#include <vdbfrac/base/number_text.h>
#include <vdbfrac/lab/machine/memory.h>

#include <fmt/format.h>

namespace vdbfrac::cli {

namespace {

using Json = nlohmann::ordered_json;

std::string listed(std::size_t n, const char* noun, const char* done)
{
    return n == 0 ? "" : counted(n, noun) + " " + done + ", ";
}

/// What a repair did, gentlest first.
std::string repairText(const repair::Repaired& r)
{
    std::string did = listed(r.joinedPoints, "point", "joined") + listed(r.removedFaces, "face", "removed") +
                      listed(r.turnedFaces, "face", "turned") + listed(r.filledHoles, "hole", "filled");
    if (r.filledHoles > 0) did += fmt::format("the widest {:.3g} m, ", r.widestHole);
    if (r.wrapped) did += fmt::format("wrapped{}, ", r.intersectsItself ? " since it intersects itself" : "");
    if (did.empty()) return "repair: none was needed";
    did.resize(did.size() - 2);
    return "repair: " + did;
}

std::string slopeText(const char* when, const grid::LevelSetReport& r)
{
    return fmt::format(
        "|grad phi| {}: {:.4f} beside the surface (rms of its difference from 1: {:.4f}), {:.3f} to {:.3f} in the band",
        when, r.beside.mean, r.beside.rms, r.band.least, r.band.most);
}

Json slopeJson(const grid::GradientStatistics& g)
{
    return {{"voxels", g.voxels}, {"mean", g.mean}, {"rms_error", g.rms}, {"least", g.least}, {"most", g.most}};
}

Json levelSetJson(const grid::LevelSetReport& r)
{
    return {{"volume", r.volume},
            {"area", r.area},
            {"slope_beside_surface", slopeJson(r.beside)},
            {"slope_in_band", slopeJson(r.band)}};
}

Json surfaceJson(const tetmesh::SurfaceReport& r)
{
    return {{"closed", r.closed},
            {"open_edges", r.openEdges},
            {"non_manifold_edges", r.nonManifoldEdges},
            {"volume", r.volume},
            {"area", r.area}};
}

Json repairJson(const repair::Repaired& r)
{
    return {{"joined_points", r.joinedPoints},
            {"removed_faces", r.removedFaces},
            {"turned_faces", r.turnedFaces},
            {"filled_holes", r.filledHoles},
            {"widest_hole", r.widestHole},
            {"intersects_itself", r.searchGivenUp ? Json() : Json(r.intersectsItself)},
            {"wrapped", r.wrapped},
            {"surface", surfaceJson(r.after)}};
}

const char* nameOf(grid::Redistancing how) { return how == grid::Redistancing::sweep ? "sweep" : "track"; }

}  // namespace

std::vector<std::string> notesOf(const RelevelReport& r)
{
    std::vector<std::string> notes;
    if (r.repair && r.repair->intersectsItself && !r.repair->wrapped)
        notes.push_back("it intersects itself; what lies inside of it is filled");
    if (r.repair && r.repair->searchGivenUp)
        notes.push_back(
            "so many triangles lie close to each other, as round one point, that where they intersect was not looked "
            "for to the end");
    if (r.gaps > 0) notes.push_back(grid::gapText(r.gaps, r.levelSet.voxelSize()));
    if (const std::string lost = grid::volumeText(r.after.volume, r.inputVolume, r.levelSet.voxelSize()); !lost.empty())
        notes.push_back(lost);
    return notes;
}

std::string reportText(const RelevelReport& r)
{
    std::string text;
    if (r.repair) {
        const tetmesh::SurfaceReport& s = r.repair->before;
        text += s.closed ? fmt::format("surface: closed, {:.6g} m^3, {:.6g} m^2\n", std::abs(s.volume), s.area)
                         : fmt::format("surface: {} open edges, {:.6g} m^2\n", s.openEdges, s.area);
        text += repairText(*r.repair) + "\n";
    }
    if (r.grid) {
        text += fmt::format("grid: {:.6g} m^3, {:.6g} m^2\n{}\n", r.grid->before.volume, r.grid->before.area,
                            slopeText("before", r.grid->before));
        text += fmt::format("re-distanced by: {}{}\n", nameOf(r.grid->redistancing),
                            r.grid->resampled ? ", and resampled" : "");
    }
    text += fmt::format("level set: {:.6g} m^3, {:.6g} m^2, voxels of {:.6g} m, {} in the band\n", r.after.volume,
                        r.after.area, r.levelSet.voxelSize(), r.levelSet.activeVoxels());
    text += slopeText("after", r.after) + "\n";
    for (const StageWork& s : r.work.stages()) text += fmt::format("{} {:.2f} s, ", s.name, s.seconds);
    return text + fmt::format("peak memory {:.2f} GiB", double(lab::peakMemory()) / lab::kGiB);
}

Json reportJson(const RelevelReport& r, const std::string& input, const std::string& output)
{
    Json json = {{"input", input},
                 {"output", output},
                 {"voxel_size", r.levelSet.voxelSize()},
                 {"active_voxels", r.levelSet.activeVoxels()}};
    if (r.repair) {
        json["before"] = surfaceJson(r.repair->before);
        json["repair"] = repairJson(*r.repair);
        json["filled_gaps"] = r.gaps;
    }
    if (r.grid) {
        json["before"] = levelSetJson(r.grid->before);
        json["redistanced_by"] = nameOf(r.grid->redistancing);
        json["resampled"] = r.grid->resampled;
    }
    json["after"] = levelSetJson(r.after);
    json["input_volume"] = r.inputVolume;
    json["volume_change"] = grid::volumeChange(r.after.volume, r.inputVolume);
    json["notes"] = notesOf(r);
    for (const StageWork& s : r.work.stages()) json["seconds"][s.name] = s.seconds;
    json["peak_memory_bytes"] = lab::peakMemory();
    return json;
}

}  // namespace vdbfrac::cli
