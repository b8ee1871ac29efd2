#include "body_sources.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/grid/body_level_set.h>

#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <vector>

namespace vdbfrac::grid {

namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;
using Distance = std::function<double(const Vec3&)>;  // 1-Lipschitz in X [m]

constexpr int kLeafDim = int(Leaf::DIM);
constexpr std::size_t kLeafChunk = 16;

/// Box of leaf origins, half open, in voxels; multiples of 8.
struct LeafBox {
    openvdb::Coord lower, upper;
};

LeafBox leafBox(const Bounds& b, double band, double dx)
{
    LeafBox box;
    for (int a = 0; a < 3; ++a) {
        box.lower[a] = int(std::floor((b.lower[a] - band) / dx / kLeafDim)) * kLeafDim;
        box.upper[a] = (int(std::floor((b.upper[a] + band) / dx / kLeafDim)) + 1) * kLeafDim;
    }
    return box;
}

/// Finds the leafs within `band` of the zero of a distance, by descending an octree.
class LeafSearch {
public:
    LeafSearch(const Build& build, const LeafBox& box, const Distance& distance)
        : build_(build), box_(box), distance_(distance), dx_(build.grid.voxelSize), band_(build.grid.halfWidth * dx_)
    {
        mostLeafs_ = double(build.memoryLimit) / kBytesPerLeaf;
    }

    std::vector<openvdb::Coord> run()
    {
        int size = kLeafDim;
        const openvdb::Coord extent = box_.upper - box_.lower;
        while (size < std::max({extent.x(), extent.y(), extent.z()})) size *= 2;
        visit(box_.lower, size);
        return std::move(found_);
    }

private:
    void visit(const openvdb::Coord& origin, int size)
    {
        for (int a = 0; a < 3; ++a)
            if (origin[a] >= box_.upper[a]) return;
        const double toCenter = 0.5 * (size - 1);
        const Vec3 center = dx_ * (fromVdb(origin).toVec() + Vec3::Constant(toCenter));
        // Half a voxel more than needed, against rounding.
        if (std::abs(distance_(center)) > std::sqrt(3.) * dx_ * toCenter + band_ + 0.5 * dx_) return;
        if (size == kLeafDim) {
            found_.push_back(origin);
            if (double(found_.size()) > mostLeafs_) requireMemory(build_, double(found_.size()) * kBytesPerLeaf);
            return;
        }
        const int half = size / 2;
        for (int c = 0; c < 8; ++c) visit(origin.offsetBy((c & 1) * half, (c >> 1 & 1) * half, (c >> 2) * half), half);
    }

    const Build& build_;
    LeafBox box_;
    const Distance& distance_;
    double dx_, band_, mostLeafs_;
    std::vector<openvdb::Coord> found_;
};

/// Fills the leafs at `origins` with phi(ijk), leaf by leaf in parallel, and gives the rest its sign.
/// `phi` makes one sampler for each chunk, since grid accessors must not be shared between threads.
using Sampler = std::function<double(const openvdb::Coord&)>;

openvdb::FloatGrid::Ptr sample(const Build& build, const std::vector<openvdb::Coord>& origins,
                               const std::function<Sampler()>& makeSampler)
{
    auto grid = makeLevelSetGrid(build.grid.voxelSize, build.grid.halfWidth);
    const float background = grid->background();
    std::vector<Leaf*> leafs(origins.size());
    parallelChunks(origins.size(), kLeafChunk, [&](std::size_t begin, std::size_t end) {
        const Sampler phi = makeSampler();
        for (std::size_t i = begin; i < end; ++i) {
            leafs[i] = new Leaf(origins[i], background);
            for (openvdb::Index v = 0; v < Leaf::SIZE; ++v) {
                const float value = float(phi(leafs[i]->offsetToGlobalCoord(v)));
                if (std::abs(value) < background)
                    leafs[i]->setValueOn(v, value);
                else
                    leafs[i]->setValueOff(v, std::copysign(background, value));
            }
        }
    });
    for (Leaf* leaf : leafs) grid->tree().addLeaf(leaf);
    openvdb::tools::signedFloodFill(grid->tree());
    openvdb::tools::pruneLevelSet(grid->tree());
    return grid;
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
        complain(build, "the shape has no end", "a finite solid",
                 "use halfspaces and endless cylinders in 'cut' only, or give the cylinder a height");
    const double band = build.grid.halfWidth * build.grid.voxelSize;
    requireReach(build, all.lower - Vec3::Constant(band), all.upper + Vec3::Constant(band));
    return all;
}

openvdb::FloatGrid::Ptr fromPrimitives(const Primitive& shape, const scene::Body& body, const Build& build)
{
    const double dx = build.grid.voxelSize;
    const LeafBox box = leafBox(reach(bounds(shape), body, build), build.grid.halfWidth * dx, dx);
    const Distance phi = [&](const Vec3& X) { return combine(signedDistance(shape, X), body, X); };
    const std::vector<openvdb::Coord> origins = LeafSearch(build, box, phi).run();
    const Sampler atVoxel = [&](const openvdb::Coord& ijk) { return phi(dx * fromVdb(ijk).toVec()); };
    return sample(build, origins, [&] { return atVoxel; });
}

Bounds activeBounds(const openvdb::FloatGrid& grid)
{
    const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    const double dx = grid.voxelSize()[0];
    return {dx * fromVdb(box.min()).toVec(), dx * fromVdb(box.max()).toVec()};
}

/// Leafs where a grid combined with solids can have a band: those of the grid, and those near a solid's surface.
std::vector<openvdb::Coord> leafsOfBoth(const openvdb::FloatGrid& shape, const scene::Body& body, const Build& build)
{
    const Distance toSolids = [&](const Vec3& X) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const Primitive& p : body.add) nearest = std::min(nearest, std::abs(signedDistance(p, X)));
        for (const Primitive& p : body.cut) nearest = std::min(nearest, std::abs(signedDistance(p, X)));
        return nearest;
    };
    const double dx = build.grid.voxelSize;
    const LeafBox box = leafBox(reach(activeBounds(shape), body, build), build.grid.halfWidth * dx, dx);
    std::vector<openvdb::Coord> origins = LeafSearch(build, box, toSolids).run();
    for (auto leaf = shape.tree().cbeginLeaf(); leaf; ++leaf) origins.push_back(leaf->origin());
    std::sort(origins.begin(), origins.end());
    origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
    requireMemory(build, double(origins.size()) * kBytesPerLeaf);
    return origins;
}

openvdb::FloatGrid::Ptr withSolids(const openvdb::FloatGrid::Ptr& shape, const scene::Body& body, const Build& build)
{
    if ((body.add.empty() && body.cut.empty()) || shape->activeVoxelCount() == 0) return shape;
    const double dx = build.grid.voxelSize;
    return sample(build, leafsOfBoth(*shape, body, build), [&]() -> Sampler {
        return [&, accessor = shape->getConstAccessor()](const openvdb::Coord& ijk) {
            return combine(accessor.getValue(ijk), body, dx * fromVdb(ijk).toVec());
        };
    });
}

bool hasMaterial(const openvdb::FloatGrid& grid)
{
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
        const float* values = leaf->buffer().data();
        if (std::any_of(values, values + Leaf::SIZE, [](float v) { return v < 0; })) return true;
    }
    return false;
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

std::string shortNumber(double value)
{
    char digits[32];
    return {digits, std::to_chars(digits, digits + sizeof(digits), value, std::chars_format::general, 6).ptr};
}

void complain(const Build& build, const std::string& what, const std::string& allowed, const std::string& hint)
{
    throw InputError({build.place, "body '" + build.body + "': " + what, allowed, hint});
}

void requireMemory(const Build& build, double bytes)
{
    if (!(bytes > double(build.memoryLimit))) return;
    const auto gigabytes = [](double b) { return shortNumber(b / 1e9) + " GB"; };
    throw LimitError(build.place + ": body '" + build.body + "': its level set at voxel size " +
                     shortNumber(build.grid.voxelSize) + " m needs at least " + gigabytes(bytes) +
                     ", the memory limit is " + gigabytes(double(build.memoryLimit)));
}

void requireReach(const Build& build, const Vec3& lower, const Vec3& upper)
{
    const double farthest = std::max(lower.cwiseAbs().maxCoeff(), upper.cwiseAbs().maxCoeff()) / build.grid.voxelSize;
    if (lower.allFinite() && upper.allFinite() && farthest <= kFarthestVoxel) return;
    complain(build, "reaches " + shortNumber(farthest) + " voxels from the origin",
             "up to " + std::to_string(int(kFarthestVoxel)), "check the units of the shape against voxel_size");
}

LevelSet makeLevelSet(const scene::Body& body, const scene::Grid& grid, std::uint64_t memoryLimit)
{
    const Build build{grid, memoryLimit, body.place.empty() ? "body " + body.name : body.place, body.name};
    if (!(grid.voxelSize > 0) || !std::isfinite(grid.voxelSize) || grid.halfWidth < 1)
        complain(build, "voxel size " + shortNumber(grid.voxelSize) + " m, band of " +
                            std::to_string(grid.halfWidth) + " voxels", "voxel size > 0, band >= 1", "");
    openvdb::FloatGrid::Ptr phi = std::visit(ShapeVisitor{body, build}, body.shape);
    if (!hasMaterial(*phi))
        complain(build, "is empty: no voxel lies inside", "at least one voxel",
                 "make voxel_size smaller than the thinnest part, or check that 'cut' leaves something");
    phi->setName("phi");
    return wrap(std::move(phi));
}

}  // namespace vdbfrac::grid
