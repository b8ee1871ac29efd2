#include <vdbfrac/core/hole_covers.h>

#include <vdbfrac/grid/voxel_values.h>
#include <vdbfrac/skin/holes.h>

#include <algorithm>
#include <limits>
#include <variant>

namespace vdbfrac::core {

namespace {

using tetmesh::RenderMesh;
constexpr std::uint32_t kNone = RenderMesh::kNone;
constexpr float kNever = std::numeric_limits<float>::infinity();  // s: no crack is known to have come

/// Of each point, a place in RenderMesh::corners at which an outer face has it, and that face.
struct OuterCorner {
    std::uint32_t corner = kNone, face = kNone;
};

std::vector<OuterCorner> outerCorners(const tetmesh::DrawnTopology& drawn)
{
    std::vector<OuterCorner> of(drawn.mesh.points.size());
    for (std::uint32_t f = 0, c = 0; f < drawn.mesh.faces(); ++f)
        for (; c < drawn.mesh.faceEnd[f]; ++c)
            if (!drawn.torn[f]) of[drawn.mesh.corners[c].point] = {c, f};
    return of;
}

}  // namespace

HoleCovers::HoleCovers(std::shared_ptr<const tetmesh::DrawnTopology> drawn, std::span<const std::uint8_t> isJoined,
                       const Stages& stages, const Body& body)
{
    const auto arrival = stages.sourceOf("arrival");
    if (!arrival) return;
    const double dx = body.phi.voxelSize();
    const grid::VoxelValues values = std::get<grid::VoxelValues>(arrival->source->take(body, arrival->field.name));
    const std::vector<float> times = grid::sample(values, dx, drawn->mesh.points);
    const std::vector<OuterCorner> outer = outerCorners(*drawn);
    auto covered = std::make_shared<tetmesh::DrawnTopology>(*drawn);
    for (const skin::Hole& hole : skin::holesOf(*drawn, isJoined, dx)) {
        Cover cover{kNever, hole.rim, {}, hole.cover};
        for (const std::uint32_t p : hole.rim)
            if (times[p] >= 0) cover.arrival = std::min(cover.arrival, times[p]);
        if (hole.cover.empty() || cover.arrival == kNever) {
            ++uncovered_;
            continue;
        }
        for (const std::uint32_t p : hole.rim) cover.corner.push_back(drawn->mesh.corners[outer[p].corner]);
        add(cover, outer[hole.rim[0]].face, *covered);
        covers_.push_back(std::move(cover));
    }
    if (!covers_.empty()) covered_ = std::move(covered);
}

/// `like`: a face whose group, material and fragment the cover has.
void HoleCovers::add(const Cover& cover, std::uint32_t like, tetmesh::DrawnTopology& drawn) const
{
    RenderMesh& mesh = drawn.mesh;
    const auto firstPoint = std::uint32_t(mesh.points.size()), firstNormal = std::uint32_t(mesh.normals.size());
    for (std::size_t i = 0; i < cover.rim.size(); ++i) {
        mesh.points.push_back(mesh.points[cover.rim[i]]);
        if (const std::uint32_t n = cover.corner[i].normal; n != kNone) mesh.normals.push_back(mesh.normals[n]);
    }
    for (const auto& t : cover.triangle) {
        std::array<RenderMesh::Corner, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) {
            corners[k] = {firstPoint + t[k], cover.corner[t[k]].uv, cover.corner[t[k]].normal};
            if (corners[k].normal != kNone) corners[k].normal = firstNormal + t[k];
        }
        mesh.addFace(corners, mesh.group[like], mesh.material[like]);
        drawn.torn.push_back(0), drawn.fragment.push_back(drawn.fragment[like]);
    }
}

void HoleCovers::addTo(double time, DrawnBody& drawn) const
{
    if (covers_.empty()) return;
    drawn.topology = covered_;
    for (const Cover& cover : covers_)
        for (std::size_t i = 0; i < cover.rim.size(); ++i) {
            const std::uint32_t p = time < cover.arrival ? cover.rim[i] : cover.rim[0];
            drawn.points.push_back(drawn.points[p]), drawn.velocity.push_back(drawn.velocity[p]);
            if (const std::uint32_t n = cover.corner[i].normal; n != kNone) drawn.normals.push_back(drawn.normals[n]);
        }
}

}  // namespace vdbfrac::core
