#include "body_sources.h"
#include "sample_leaves.h"

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/grid/body_level_set.h>
#include <vdbfrac/grid/phi_sampler.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <vector>

namespace vdbfrac::grid {

namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;

LeafBox leafBoxWithBand(const Bounds& b, const Build& build)
{
    const Vec3 band = Vec3::Constant(build.grid.halfWidth * build.grid.voxelSize);
    return leafBox({b.lower - band, b.upper + band}, build.grid.voxelSize);
}

/// Union with `add`, then without `cut`.
double combine(double shape, const scene::Body& body, const Vec3& X)
{
    double d = shape;
    for (const Primitive& p : body.add) d = std::min(d, signedDistance(p, X));
    for (const Primitive& p : body.cut) d = std::max(d, -signedDistance(p, X));
    return d;
}

/// Bounds of what the body can fill: of its shape and what is united with it.
Bounds reach(const Bounds& shape, const scene::Body& body, const Build& build)
{
    Bounds all = shape;
    for (const Primitive& p : body.add) {
        const Bounds b = bounds(p);
        all = {all.lower.cwiseMin(b.lower), all.upper.cwiseMax(b.upper)};
    }
    if (!all.lower.allFinite() || !all.upper.allFinite())
        complain(build, "the shape is unbounded", "a finite solid",
                 "use halfspaces and endless cylinders in 'cut' only, or give the cylinder a height");
    const double band = build.grid.halfWidth * build.grid.voxelSize;
    requireReach(build, all.lower - Vec3::Constant(band), all.upper + Vec3::Constant(band));
    return all;
}

/// With fewer voxels there is no telling what is left of it.
void requireResolved(const Build& build, const Bounds& all)
{
    constexpr double kFewest = 2;
    const double longest = (all.upper - all.lower).maxCoeff(), most = longest / kFewest;
    if (build.grid.voxelSize <= most) return;
    complain(build,
             "is " + shortNumber(longest / build.grid.voxelSize) + " voxels long at a voxel size of " +
                 shortNumber(build.grid.voxelSize) + " m",
             "voxels of up to " + shortNumber(most) + " m",
             "take ten voxels or more along its shortest side; check the units of the shape");
}

openvdb::FloatGrid::Ptr fromPrimitives(const Primitive& shape, const scene::Body& body, const Build& given)
{
    const Bounds all = reach(bounds(shape), body, given);
    requireResolved(given, all);
    const Build build = outlined(given, all.lower, all.upper);
    const double dx = build.grid.voxelSize;
    const LeafBox box = leafBoxWithBand(all, build);
    const Distance phi = [&](const Vec3& X) { return combine(signedDistance(shape, X), body, X); };
    const std::vector<openvdb::Coord> origins = leavesNear(phi, box, build);
    const Sampler atVoxel = [&](const openvdb::Coord& ijk) { return phi(dx * fromVdb(ijk).toVec()); };
    return sampleLeaves(build.grid, origins, [&] { return atVoxel; });
}

Bounds activeBounds(const openvdb::FloatGrid& grid)
{
    const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    const double dx = grid.voxelSize()[0];
    return {dx * fromVdb(box.min()).toVec(), dx * fromVdb(box.max()).toVec()};
}

/// Leaves where a grid combined with solids can have a band: those of the grid, and those near a solid's surface.
std::vector<openvdb::Coord> leavesOfBoth(const openvdb::FloatGrid& shape, const scene::Body& body, const Build& build)
{
    const Distance toSolids = [&](const Vec3& X) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const Primitive& p : body.add) nearest = std::min(nearest, std::abs(signedDistance(p, X)));
        for (const Primitive& p : body.cut) nearest = std::min(nearest, std::abs(signedDistance(p, X)));
        return nearest;
    };
    const LeafBox box = leafBoxWithBand(reach(activeBounds(shape), body, build), build);
    std::vector<openvdb::Coord> origins = leavesNear(toSolids, box, build);
    for (auto leaf = shape.tree().cbeginLeaf(); leaf; ++leaf) origins.push_back(leaf->origin());
    sortUnique(origins);
    requireMemory(build, double(origins.size()) * kBytesPerLeaf);
    return origins;
}

openvdb::FloatGrid::Ptr withSolids(const openvdb::FloatGrid::Ptr& shape, const scene::Body& body, Build build)
{
    if ((body.add.empty() && body.cut.empty()) || shape->activeVoxelCount() == 0) return shape;
    const double dx = build.grid.voxelSize = shape->voxelSize()[0];
    return sampleLeaves(build.grid, leavesOfBoth(*shape, body, build), [&]() -> Sampler {
        return [&, accessor = shape->getConstAccessor()](const openvdb::Coord& ijk) {
            return combine(accessor.getValue(ijk), body, dx * fromVdb(ijk).toVec());
        };
    });
}

/// Makes phi from whatever shape a body has.
struct ShapeVisitor {
    const scene::Body& body;
    const Build& build;

    openvdb::FloatGrid::Ptr operator()(const Primitive& p) const { return fromPrimitives(p, body, build); }
    openvdb::FloatGrid::Ptr operator()(const scene::MeshFile& m) const
    {
        return withSolids(fromMesh(m, build), body, build);
    }
    openvdb::FloatGrid::Ptr operator()(const scene::VdbFile& f) const
    {
        return withSolids(fromVdb(f, build), body, build);
    }
};

}  // namespace

bool hasMaterial(const openvdb::FloatGrid& grid)
{
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
        const float* values = leaf->buffer().data();
        if (std::any_of(values, values + Leaf::SIZE, [](float v) { return v < 0; })) return true;
    }
    return false;
}

void complain(const Build& build, const std::string& what, const std::string& allowed, const std::string& hint)
{
    throw InputError({build.place, build.subject + ": " + what, allowed, hint});
}

void requireVoxelSize(const Build& build)
{
    const double dx = build.grid.voxelSize;
    if (!(dx >= kSmallestVoxel) || !std::isfinite(dx))
        complain(build, "voxel size " + shortNumber(dx) + " m", shortNumber(kSmallestVoxel) + " m or more",
                 "scale what is smaller than that");
}

void requireMemory(const Build& build, double bytes)
{
    if (!(bytes > double(build.memoryLimit))) return;
    const auto gigabytes = [](double b) { return shortNumber(b / 1e9) + " GB"; };
    throw LimitError(build.place + ": " + build.subject + ": its level set at voxel size " +
                     shortNumber(build.grid.voxelSize) + " m needs at least " + gigabytes(bytes) +
                     ", the memory limit is " + gigabytes(double(build.memoryLimit)) + "; use a larger voxel size");
}

void requireReach(const Build& build, const Vec3& lower, const Vec3& upper)
{
    const double farthest = std::max(lower.cwiseAbs().maxCoeff(), upper.cwiseAbs().maxCoeff()) / build.grid.voxelSize;
    if (lower.allFinite() && upper.allFinite() && farthest <= kFarthestVoxel) return;
    complain(build, "reaches " + shortNumber(farthest) + " voxels from the origin",
             "up to " + std::to_string(int(kFarthestVoxel)), "check the units of the shape against voxel_size");
}

Build outlined(Build build, const Vec3& lower, const Vec3& upper)
{
    if (build.across > 0)
        build.grid.voxelSize = std::max(build.grid.voxelSize, (upper - lower).maxCoeff() / build.across);
    return build;
}

namespace {

/// An error inside a file, with who asks for the file.
InputError asked(const InputError& error, const Build& build)
{
    std::vector<InputError::Detail> details = error.details();
    for (InputError::Detail& d : details)
        if (d.place != build.place) d.place = build.place + ": " + build.subject + ": " + d.place;
    return InputError(details);
}

LevelSet build(const scene::Body& body, const Build& build)
{
    const scene::Grid& grid = build.grid;
    requireVoxelSize(build);
    if (grid.halfWidth < 1) complain(build, "band of " + std::to_string(grid.halfWidth) + " voxels", "1 or more", "");
    openvdb::FloatGrid::Ptr phi;
    try {
        phi = std::visit(ShapeVisitor{body, build}, body.shape);
    } catch (const FileError& e) {  // it names the file, but not who asks for it
        throw FileError(build.place + ": " + build.subject, e.what());
    } catch (const InputError& e) {
        throw asked(e, build);
    }
    if (!hasMaterial(*phi))
        complain(build, "is empty: no voxel lies inside", "at least one voxel",
                 "make voxel_size smaller than the thinnest part, or check that 'cut' leaves something");
    phi->setName("phi");
    return wrap(std::move(phi));
}

scene::Body bodyOf(const scene::Collider& collider)
{
    scene::Body body;
    body.shape = collider.shape;
    return body;
}

Build buildOf(const scene::Collider& collider, const scene::Grid& grid, std::uint64_t memoryLimit)
{
    return {grid, memoryLimit, collider.place, "collider '" + collider.name + "'"};
}

Build buildOf(const scene::Body& body, const scene::Grid& grid, std::uint64_t memoryLimit)
{
    return {grid, memoryLimit, body.place.empty() ? "body " + body.name : body.place, "body '" + body.name + "'"};
}

}  // namespace

LevelSet makeLevelSet(const scene::Body& body, const scene::Grid& grid, std::uint64_t memoryLimit,
                      std::vector<std::string>* notes)
{
    Build all = buildOf(body, grid, memoryLimit);
    all.notes = notes;
    return build(body, all);
}

tetmesh::RestShape restShape(const scene::Body& body, const LevelSet& phi)
{
    if (const Primitive* solid = std::get_if<Primitive>(&body.shape))
        return [body, solid = *solid](std::span<const Vec3> X, std::span<double> values) {
            for (std::size_t i = 0; i < X.size(); ++i) values[i] = combine(signedDistance(solid, X[i]), body, X[i]);
        };
    return [body, sample = cubicPhiSampler(phi)](std::span<const Vec3> X, std::span<double> values) {
        sample(X, values);
        for (std::size_t i = 0; i < X.size(); ++i) values[i] = combine(values[i], body, X[i]);
    };
}

LevelSet makeLevelSet(const scene::Collider& collider, const scene::Grid& grid, std::uint64_t memoryLimit)
{
    return build(bodyOf(collider), buildOf(collider, grid, memoryLimit));
}

LevelSet makeOutline(const scene::Collider& collider, const scene::Grid& grid, int across, std::uint64_t memoryLimit)
{
    Build coarse = buildOf(collider, grid, memoryLimit);
    coarse.across = across;
    return build(bodyOf(collider), coarse);
}

LevelSet makeOutline(const scene::Body& body, const scene::Grid& grid, int across, std::uint64_t memoryLimit)
{
    Build coarse = buildOf(body, grid, memoryLimit);
    coarse.across = across;
    return build(body, coarse);
}

}  // namespace vdbfrac::grid
