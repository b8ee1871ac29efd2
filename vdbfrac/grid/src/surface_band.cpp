#include "surface_band.h"

#include "triangles.h"

#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace vdbfrac::grid {

namespace {

using Block = SurfaceBand::Block;
constexpr int kEdge = SurfaceBand::kEdge;
constexpr double kWidth = SurfaceBand::kWidth;
constexpr int kInBlock = SurfaceBand::kVoxels;
constexpr double kMaxReach = 1 << 28;  // voxels from the origin: blocks are numbered by int
constexpr double kMaxEdge = 1 << 20;   // voxels along an axis: the band of a larger triangle is not worth its memory
constexpr float kOnFace = 1e-6f;       // voxels: nearer is on the surface, to the rounding of floats

std::size_t indexOf(int x, int y, int z) { return std::size_t((x * kEdge + y) * kEdge + z); }

Triangles inVoxels(const tetmesh::Surface& surface, double voxelSize)
{
    if (!(voxelSize > 0)) throw Error("the voxel size must be above 0");
    Triangles triangles;
    triangles.points.reserve(surface.points.size());
    for (const Vec3& x : surface.points) {
        if (!x.allFinite() || x.cwiseAbs().maxCoeff() > kMaxReach * voxelSize)
            throw Error("the surface has coordinates that are not finite, or too large for its voxel size");
        triangles.points.push_back(x / voxelSize);
    }
    for (const auto& triangle : surface.triangles) {
        for (const std::uint32_t corner : triangle)
            if (corner >= surface.points.size()) throw Error("the surface has indices out of range");
        const Vec3 &a = triangles.points[triangle[0]], &b = triangles.points[triangle[1]],
                   &c = triangles.points[triangle[2]];
        if ((a.cwiseMax(b).cwiseMax(c) - a.cwiseMin(b).cwiseMin(c)).maxCoeff() > kMaxEdge)
            throw Error("the surface has triangles too large for its voxel size");
    }
    triangles.corners = surface.triangles;
    return triangles;
}

/// Blocks from one to another.
struct Blocks {
    Coord first, last;
    auto operator<=>(const Blocks&) const = default;

    /// Calls visit(lowest voxel) for each.
    template <class Visit>
    void each(const Visit& visit) const
    {
        for (int x = first.x; x <= last.x; ++x)
            for (int y = first.y; y <= last.y; ++y)
                for (int z = first.z; z <= last.z; ++z) visit(kEdge * Coord{x, y, z});
    }
};

/// Calls visit(blocks) for blocks with voxels within `around` of a triangle, and some more; for some twice.
template <class Visit>
void eachBlocksNear(const std::array<Vec3, 3>& corner, double around, const Visit& visit)
{
    constexpr double kSmall = 2 * kEdge;  // a box round a large triangle would be nearly empty
    const auto& [a, b, c] = corner;
    const Vec3 lower = a.cwiseMin(b).cwiseMin(c), upper = a.cwiseMax(b).cwiseMax(c);
    if ((upper - lower).maxCoeff() > kSmall) {
        const std::array<double, 3> length{(b - a).norm(), (c - b).norm(), (a - c).norm()};
        const std::size_t k = std::size_t(std::max_element(length.begin(), length.end()) - length.begin());
        const Vec3 &from = corner[k], &to = corner[(k + 1) % 3], &beside = corner[(k + 2) % 3], half = .5 * (from + to);
        eachBlocksNear({from, half, beside}, around, visit);
        eachBlocksNear({half, to, beside}, around, visit);
        return;
    }
    const auto blockOf = [](const Vec3& X) {
        const auto along = [&](int k) { return floorDiv(int(std::floor(X[k])), kEdge); };
        return Coord{along(0), along(1), along(2)};
    };
    visit(Blocks{blockOf(lower - Vec3::Constant(around)), blockOf(upper + Vec3::Constant(around))});
}

std::vector<Coord> blocksNear(const Triangles& triangles)
{
    // Those of a triangle are mostly those of the one before.
    std::vector<Blocks> near = gatherChunks<Blocks>(
        triangles.corners.size(), kChunk, [&](std::size_t begin, std::size_t end, std::vector<Blocks>& found) {
            for (std::size_t n = begin; n < end; ++n)
                eachBlocksNear(triangles.cornersOf(n), kWidth, [&](const Blocks& blocks) { found.push_back(blocks); });
            sortUnique(found);
        });
    sortUnique(near);
    std::vector<Coord> all;
    for (const Blocks& blocks : near) blocks.each([&](const Coord& low) { all.push_back(low); });
    sortUnique(all);
    return all;
}

constexpr std::size_t kNowhere = ~std::size_t{0};

/// The number of a block; `low`: its lowest voxel.
std::size_t numberOf(const std::vector<Block>& blocks, const Coord& low)
{
    const auto at = std::lower_bound(blocks.begin(), blocks.end(), low,
                                     [](const Block& block, const Coord& l) { return block.low < l; });
    return at != blocks.end() && at->low == low ? std::size_t(at - blocks.begin()) : kNowhere;
}

/// Distances without sign. Those within a voxel are exact; from there on the triangles closest to the neighbours of a
/// voxel are looked at.
class Distances {
public:
    Distances(const Triangles& triangles, std::vector<Block>& blocks) : triangles_(triangles), blocks_(blocks) {}

    void measure()
    {
        const Groups near = groupItems(blocks_.size(), [&](const auto& add) {
            for (std::uint32_t n = 0; n < triangles_.corners.size(); ++n)
                eachBlocksNear(triangles_.cornersOf(n), kNear, [&](const Blocks& blocks) {
                    blocks.each([&](const Coord& low) { add(numberOf(blocks_, low), n); });
                });
        });
        new_.resize(blocks_.size());
        parallelChunks(blocks_.size(), 1, [&](std::size_t b, std::size_t) { start(blocks_[b], new_[b], near[b]); });
        findBeside();
        while (widen()) {}
    }

private:
    static constexpr double kNear = 1;  // voxels
    using Indices = std::vector<std::uint16_t>;

    /// Takes a triangle that is closer, or as close and before the other. Was it?
    bool look(const Vec3& X, std::uint32_t triangle, float& phi, std::uint32_t& closest) const
    {
        const float d = float((closestPoint(triangles_, triangle, X).at - X).norm());
        if (!(d < phi || (d == phi && triangle < closest))) return false;
        phi = d, closest = triangle;
        return true;
    }

    void start(Block& block, Indices& found, std::span<const std::uint32_t> near) const
    {
        block.phi.fill(float(kWidth));
        block.closest.fill(SurfaceBand::kFar);
        for (const std::uint32_t n : near) {
            const auto [a, b, c] = triangles_.cornersOf(n);
            const Vec3 middle = (a + b + c) / 3;
            const double size = std::sqrt(
                std::max({(a - middle).squaredNorm(), (b - middle).squaredNorm(), (c - middle).squaredNorm()}));
            const Vec3 lower = a.cwiseMin(b).cwiseMin(c) - block.low.toVec() - Vec3::Constant(kNear),
                       upper = a.cwiseMax(b).cwiseMax(c) - block.low.toVec() + Vec3::Constant(kNear);
            const auto first = [&](int k) { return std::max(0, int(std::ceil(lower[k]))); };
            const auto last = [&](int k) { return std::min(kEdge - 1, int(std::floor(upper[k]))); };
            for (int x = first(0); x <= last(0); ++x)
                for (int y = first(1); y <= last(1); ++y)
                    for (int z = first(2); z <= last(2); ++z) {
                        const std::size_t i = indexOf(x, y, z);
                        const Vec3 X = (block.low + Coord{x, y, z}).toVec();
                        const double reach = size + std::min(kNear, double(block.phi[i]));
                        if ((X - middle).squaredNorm() <= reach * reach) look(X, n, block.phi[i], block.closest[i]);
                    }
        }
        for (std::size_t i = 0; i < kInBlock; ++i)
            if (block.closest[i] != SurfaceBand::kFar) found.push_back(std::uint16_t(i));
    }

    void findBeside()
    {
        beside_.resize(blocks_.size());
        parallelChunks(blocks_.size(), 8, [&](std::size_t begin, std::size_t end) {
            for (std::size_t b = begin; b < end; ++b)
                for (std::size_t side = 0; side < 6; ++side)
                    beside_[b][side] = numberOf(blocks_, blocks_[b].low + kEdge * kSides[side]);
        });
    }

    /// Looks at the triangles of neighbours that are new; has that found any that are closer?
    bool widen()
    {
        std::vector<Block> wider(blocks_);
        std::vector<Indices> newer(blocks_.size());
        parallelChunks(blocks_.size(), 1, [&](std::size_t b, std::size_t) { widenBlock(b, wider[b], newer[b]); });
        blocks_.swap(wider);
        new_.swap(newer);
        return std::any_of(new_.begin(), new_.end(), [](const Indices& found) { return !found.empty(); });
    }

    void widenBlock(std::size_t b, Block& wider, Indices& newer) const
    {
        std::array<std::uint8_t, kInBlock> isNewer{};
        const auto offer = [&](const Coord& at, std::uint32_t triangle) {
            if (((at.x | at.y | at.z) & ~(kEdge - 1)) != 0) return;
            const std::size_t i = indexOf(at.x, at.y, at.z);
            if (double(wider.phi[i]) <= kNear || wider.closest[i] == triangle) return;
            if (!look((wider.low + at).toVec(), triangle, wider.phi[i], wider.closest[i]) || isNewer[i]) return;
            isNewer[i] = 1;
            newer.push_back(std::uint16_t(i));
        };
        for (const std::uint16_t i : new_[b])
            for (const Coord& side : kSides) offer(SurfaceBand::placeOf(i) + side, blocks_[b].closest[i]);
        for (std::size_t side = 0; side < 6; ++side)
            if (const std::size_t other = beside_[b][side]; other != kNowhere)
                for (const std::uint16_t i : new_[other])
                    offer(SurfaceBand::placeOf(i) + (kEdge - 1) * kSides[side], blocks_[other].closest[i]);
    }

    static constexpr Coord kSides[6] = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};

    const Triangles& triangles_;
    std::vector<Block>& blocks_;
    std::vector<std::array<std::size_t, 6>> beside_;
    std::vector<Indices> new_;  // voxels of each block whose triangle is
};

/// Where lines along z through voxels go through the surface.
class Lines {
public:
    explicit Lines(const Triangles& triangles)
    {
        crossings_ = gatherChunks<Crossing>(triangles.corners.size(), kChunk,
                                            [&](std::size_t begin, std::size_t end, std::vector<Crossing>& found) {
                                                for (std::size_t n = begin; n < end; ++n)
                                                    cross(triangles.cornersOf(n), found);
                                            });
        std::sort(crossings_.begin(), crossings_.end());
    }

    /// How often the surface winds round each of a row of voxels.
    std::array<int, kEdge> winding(int x, int y, int firstZ) const
    {
        std::array<int, kEdge> row{};
        auto at = std::lower_bound(crossings_.begin(), crossings_.end(), Crossing{x, y, -kInfinity, 0});
        int winding = 0;
        for (int i = 0; i < kEdge; ++i) {
            for (; at != crossings_.end() && at->x == x && at->y == y && at->z < firstZ + i; ++at)
                winding += at->enters;
            row[std::size_t(i)] = winding;
        }
        return row;
    }

private:
    struct Crossing {
        int x, y;
        double z;
        int enters;  // 1; -1 where the line leaves the material
        auto operator<=>(const Crossing&) const = default;
    };

    /// Where an edge goes through the plane of an x. Both triangles of an edge see the same numbers, so a line passes
    /// one of them exactly, however near the edge it is.
    static Vec3 onEdge(Vec3 a, Vec3 b, int x)
    {
        if (b.x() < a.x()) std::swap(a, b);
        return a + (x - a.x()) / (b.x() - a.x()) * (b - a);
    }

    static void cross(const std::array<Vec3, 3>& corner, std::vector<Crossing>& found)
    {
        const auto [lowest, highest] = std::minmax({corner[0].x(), corner[1].x(), corner[2].x()});
        for (int x = int(std::ceil(lowest)); x <= int(std::floor(highest)); ++x) {
            Vec3 rising = Vec3::Zero(), falling = Vec3::Zero();
            int edges = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const Vec3 &a = corner[k], &b = corner[(k + 1) % 3];
                if ((a.x() < x) == (b.x() < x)) continue;
                (a.x() < x ? rising : falling) = onEdge(a, b, x);
                ++edges;
            }
            if (edges != 2) continue;
            const double from = std::min(rising.y(), falling.y()), to = std::max(rising.y(), falling.y());
            // Seen against z, corners that run counter-clockwise have their rising edge at the lower y.
            const int enters = rising.y() < falling.y() ? -1 : 1;
            for (int y = int(std::ceil(from)); y < to; ++y) {
                const double part = (y - rising.y()) / (falling.y() - rising.y());
                found.push_back({x, y, rising.z() + part * (falling.z() - rising.z()), enters});
            }
        }
    }

    std::vector<Crossing> crossings_;
};

void sign(const Lines& lines, Block& block)
{
    for (int x = 0; x < kEdge; ++x)
        for (int y = 0; y < kEdge; ++y) {
            const auto winding = lines.winding(block.low.x + x, block.low.y + y, block.low.z);
            for (int z = 0; z < kEdge; ++z)
                if (float& phi = block.phi[indexOf(x, y, z)]; winding[std::size_t(z)] != 0 || phi < kOnFace)
                    phi = -std::max(phi, kOnFace);
        }
}

/// Voxels outside that are near the surface become inside where none that is not near can be reached from them.
class Specks {
public:
    explicit Specks(std::vector<Block>& blocks) : blocks_(blocks) {}

    void fill()
    {
        findDoubtful();
        std::vector<std::size_t> open;  // of those that were reached, whose neighbours may be
        std::vector<std::uint8_t> isReached(doubtful_.size(), 0);
        const auto reach = [&](std::size_t i) {
            if (!isReached[i]) isReached[i] = 1, open.push_back(i);
        };
        for (std::size_t i = 0; i < doubtful_.size(); ++i)
            eachNeighbour(doubtful_[i], [&](const Coord& n) {
                if (const float* phi = phiAt(n); phi && *phi >= kNear) reach(i);
            });
        while (!open.empty()) {
            const Coord c = doubtful_[open.back()];
            open.pop_back();
            eachNeighbour(c, [&](const Coord& n) {
                const auto at = std::lower_bound(doubtful_.begin(), doubtful_.end(), n);
                if (at != doubtful_.end() && *at == n) reach(std::size_t(at - doubtful_.begin()));
            });
        }
        for (std::size_t i = 0; i < doubtful_.size(); ++i)
            if (!isReached[i]) *phiAt(doubtful_[i]) = -std::max(*phiAt(doubtful_[i]), kOnFace);
    }

private:
    static constexpr float kNear = .5f;  // voxels

    void findDoubtful()
    {
        for (const Block& block : blocks_)
            for (int i = 0; i < kInBlock; ++i)
                if (const float phi = block.phi[std::size_t(i)]; phi >= 0 && phi < kNear)
                    doubtful_.push_back(block.low + SurfaceBand::placeOf(i));
        std::sort(doubtful_.begin(), doubtful_.end());
    }

    float* phiAt(const Coord& c)
    {
        const Coord low = kEdge * Coord{floorDiv(c.x, kEdge), floorDiv(c.y, kEdge), floorDiv(c.z, kEdge)};
        const std::size_t block = numberOf(blocks_, low);
        if (block == kNowhere) return nullptr;
        return &blocks_[block].phi[indexOf(c.x - low.x, c.y - low.y, c.z - low.z)];
    }

    template <class Visit>
    static void eachNeighbour(const Coord& c, const Visit& visit)
    {
        for (int n = 0; n < 27; ++n)
            if (n != 13) visit(c + Coord{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1});
    }

    std::vector<Block>& blocks_;
    std::vector<Coord> doubtful_;  // sorted
};

}  // namespace

SurfaceBand surfaceBand(const tetmesh::Surface& surface, double voxelSize)
{
    const Triangles triangles = inVoxels(surface, voxelSize);
    SurfaceBand band;
    for (const Coord& low : blocksNear(triangles)) band.blocks.emplace_back().low = low;
    Distances(triangles, band.blocks).measure();
    parallelChunks(band.blocks.size(), 1,
                   [&, lines = Lines(triangles)](std::size_t b, std::size_t) { sign(lines, band.blocks[b]); });
    std::erase_if(band.blocks, [](const Block& block) {
        return std::all_of(block.closest.begin(), block.closest.end(), [](auto n) { return n == SurfaceBand::kFar; });
    });
    Specks(band.blocks).fill();
    return band;
}

}  // namespace vdbfrac::grid
