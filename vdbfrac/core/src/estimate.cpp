#include <vdbfrac/core/estimate.h>

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/grid/body_level_set.h>
#include <vdbfrac/grid/distance_field.h>
#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/grid/phi_sampler.h>
#include <vdbfrac/grid/relevel.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace vdbfrac::core {

namespace {

// Fitted to the peaks of 20 runs of 7 000 to 500 000 nodes; docs/measured.md has them beside what this says.
constexpr double kKibi = 1024, kGibi = kKibi * kKibi * kKibi, kProgram = 60 * kKibi * kKibi;
constexpr double kPerTet = 0.341 * kKibi;          // state, tables, tangent, coarse lattices
constexpr double kPerTetJacobi = 0.303 * kKibi;    // no coarse lattices
constexpr double kPerTetExplicit = 0.158 * kKibi;  // no tangent either
constexpr double kPerDelaunayTet = 9.9 * kKibi;    // CGAL's mesher has the peak
constexpr double kPerDirect = 0.88 * kKibi;        // times nodes^(4/3): what factors fill in
// Pieces of cut cells; of cells of several voxels.
constexpr double kPerSurfaceVoxel = 1.8 * kKibi, kPerFinerVoxel = 3.8 * kKibi;
constexpr double kPerWorldVoxel = 2.7 * kKibi;  // grids made of the deformed surface, and the frames that wait
constexpr double kPerBandVoxel = 30;            // phi and its frames
constexpr double kPerFilledVoxel = 41;  // distances in all of a collider, while they are swept: balls of 4 and 12 M

/// Lattice cells that hold material: half of those that the surface crosses come to the volume.
constexpr double kCrossed = 0.5;
/// The same for Delaunay tets of edges near h.
constexpr double kDelaunayInside = 5.5, kDelaunayCrossed = 6.1;

/// The outline of a body or a collider at which volume and surface no longer change, or the finest.
template <class Solid>
BodyEstimate outline(const Solid& solid, const scene::Grid& grid, std::uint64_t memoryLimit)
{
    constexpr int kFirst = 64, kFinest = 256;  // voxels along the longest side
    constexpr double kSame = 0.03;             // of volume and area
    std::optional<BodyEstimate> coarser;
    for (int across = kFirst;; across *= 2) {
        std::optional<BodyEstimate> now;
        try {
            now.emplace();
            now->outline = grid::makeOutline(solid, grid, across, memoryLimit);
        } catch (const InputError&) {
            if (across >= kFinest) throw;  // thinner than its voxels, perhaps
            continue;
        }
        const grid::LevelSetReport report = grid::measure(now->outline);
        now->volume = report.volume, now->area = report.area;
        const auto near = [](double a, double b) { return std::abs(a - b) <= kSame * a; };
        const bool same = coarser && near(now->volume, coarser->volume) && near(now->area, coarser->area);
        if (same || across >= kFinest || now->outline.voxelSize() <= grid.voxelSize * (1 + 1e-9))
            return std::move(*now);
        coarser = std::move(now);
    }
}

/// Throws InputError where no voxel of the outline is near a grip. What is nearer than a voxel of it may still miss all
/// nodes.
void requireNear(const scene::Grip& grip, const BodyEstimate& estimate)
{
    const double dx = estimate.outline.voxelSize(), reach = 1.5 * std::sqrt(3.) * dx;
    const tetmesh::NodeField<float> phi =
        grid::sampleNodes(estimate.outline, std::numeric_limits<std::uint64_t>::max());
    double nearest = std::numeric_limits<double>::infinity();
    phi.forEachBlock([&](Coord low) {
        phi.forEachNode(low, [&](Coord c) {
            if (phi(c) < dx) nearest = std::min(nearest, signedDistance(grip.region, dx * c.toVec()));
        });
    });
    if (nearest <= reach) return;
    throw InputError({grip.place,
                      "grip '" + grip.name + "' holds nothing: its region is " + shortNumber(nearest, 3) +
                          " m away from body '" + grip.body + "'",
                      "a region that reaches into the body at rest", ""});
}

void count(BodyEstimate& e, const scene::Grid& grid)
{
    const double h = grid.coarsening * grid.voxelSize, cells = e.volume / (h * h * h), crossed = e.area / (h * h);
    e.surfaceVoxels = e.area / (grid.voxelSize * grid.voxelSize);
    if (grid.lattice == scene::LatticeKind::delaunay) {
        constexpr double kTetsOfANode = 5.4;
        e.tets = kDelaunayInside * cells + kDelaunayCrossed * crossed;
        e.nodes = e.tets / kTetsOfANode;
        return;
    }
    e.tets = (grid.lattice == scene::LatticeKind::five ? 5 : 6) * (cells + kCrossed * crossed);
    e.nodes = cells + crossed;
}

double bytesOf(const BodyEstimate& e, const scene::Scene& scene)
{
    using enum scene::Integrator;
    const bool isExplicit = scene.solver.integrator == symplecticEuler || scene.solver.integrator == forwardEuler;
    const bool world = std::any_of(scene.output.vdb.begin(), scene.output.vdb.end(), [](const std::string& name) {
        return name == "surface" || name == "vel" || name == "fragment_id";
    });
    double bytes = e.surfaceVoxels * (scene.grid.coarsening > 1 ? kPerFinerVoxel : kPerSurfaceVoxel);
    bytes += e.surfaceVoxels * 2 * scene.grid.halfWidth * kPerBandVoxel;
    if (world) bytes += e.surfaceVoxels * kPerWorldVoxel;
    if (scene.grid.lattice == scene::LatticeKind::delaunay) return bytes + e.tets * kPerDelaunayTet;
    return bytes + e.tets * (isExplicit                                                 ? kPerTetExplicit
                             : scene.solver.linearSolver == scene::LinearSolver::jacobi ? kPerTetJacobi
                                                                                        : kPerTet);
}

}  // namespace

Bounds BodyEstimate::bounds() const
{
    const Bounds box = grid::materialBox(outline);
    const Vec3 wider = Vec3::Constant(1.5 * outline.voxelSize());  // from the last voxels inside to the surface
    return {box.lower + wider, box.upper - wider};
}

SceneEstimate estimateScene(const scene::Scene& scene, std::uint64_t memoryLimit, double bytesPerTet)
{
    SceneEstimate all;
    all.bytes = kProgram;
    const auto add = [&](const std::string& what, const BodyEstimate& e, double bytes) {
        const Bounds bounds = e.bounds();
        if (bytes > all.largest.bytes) all.largest = {what, (bounds.upper - bounds.lower).maxCoeff(), bytes};
        all.bytes += bytes;
    };
    for (const scene::Body& body : scene.bodies) {
        BodyEstimate e = outline(body, scene.grid, memoryLimit);
        e.body = &body;
        for (const scene::Grip& grip : scene.grips)
            if (grip.body == body.name) requireNear(grip, e);
        count(e, scene.grid);
        all.tets += e.tets, all.nodes += e.nodes;
        add("body '" + body.name + "'", e, bytesOf(e, scene) + bytesPerTet * e.tets);
        all.bodies.push_back(std::move(e));
    }
    for (const scene::Collider& collider : scene.colliders) {
        if (!scene::fileOf(collider.shape)) continue;
        const BodyEstimate e = outline(collider, scene.grid, memoryLimit);
        const double dx = scene.grid.voxelSize;
        const double filled = std::min(e.volume, e.area * grid::DistanceField::kDeepest * dx) / (dx * dx * dx);
        const double bytes = kPerFilledVoxel * filled;
        add("collider '" + collider.name + "'", e, bytes);
        all.colliderBytes += bytes;
    }
    if (scene.solver.linearSolver == scene::LinearSolver::direct) all.bytes += kPerDirect * std::pow(all.nodes, 4. / 3);
    return all;
}

void requireMemory(const SceneEstimate& estimate, std::uint64_t limit)
{
    if (estimate.bytes <= double(limit)) return;
    const auto gibi = [](double bytes) { return shortNumber(bytes / kGibi, 3) + " GiB"; };
    const std::string ofColliders =
        estimate.colliderBytes > 0 ? ", " + gibi(estimate.colliderBytes) + " of it for the files of colliders" : "";
    throw LimitError("the run needs about " + gibi(estimate.bytes) + ofColliders + ", the limit is " +
                     gibi(double(limit)) + "; use a coarser grid.voxel_size or --max-memory" +
                     (estimate.largest.what.empty()
                          ? ""
                          : "; " + estimate.largest.what + " is " + shortNumber(estimate.largest.length, 3) +
                                " m long: is that meant, or are its lengths in other units?"));
}

}  // namespace vdbfrac::core
