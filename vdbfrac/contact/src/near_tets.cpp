#include <vdbfrac/contact/near_tets.h>

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/parallel.h>

#include <Eigen/Dense>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace vdbfrac::contact {

namespace {

constexpr std::size_t kSamples = 512;  // a chunk: finding what is near takes a microsecond each

struct Box {
    Vec3 lower, upper;

    bool meets(const Box& other) const
    {
        return (lower.array() <= other.upper.array()).all() && (other.lower.array() <= upper.array()).all();
    }
};

Box around(std::span<const Vec3> points, double margin)
{
    Box box{points[0], points[0]};
    for (const Vec3& p : points) box = {box.lower.cwiseMin(p), box.upper.cwiseMax(p)};
    return {box.lower - Vec3::Constant(margin), box.upper + Vec3::Constant(margin)};
}

/// Cells of a grid over space, in bins by a hash of their coordinates.
class Bins {
public:
    Bins(double size, std::size_t things) : size_(size), bits_(std::bit_width(2 * things)) {}
    std::size_t count() const { return std::size_t{1} << bits_; }
    /// Calls visit(bin) for each cell that a box meets.
    template <class Visit>
    void visit(const Box& box, const Visit& visit) const
    {
        const std::array<long long, 3> low = cellOf(box.lower), high = cellOf(box.upper);
        for (long long z = low[2]; z <= high[2]; ++z)
            for (long long y = low[1]; y <= high[1]; ++y)
                for (long long x = low[0]; x <= high[0]; ++x) visit(binOf(x, y, z));
    }

private:
    std::size_t binOf(long long x, long long y, long long z) const
    {
        // Teschner et al. 2003, Optimized spatial hashing, section 4.1; its upper bits are the well mixed ones.
        const std::uint64_t mixed =
            std::uint64_t(x) * 73856093u ^ std::uint64_t(y) * 19349663u ^ std::uint64_t(z) * 83492791u;
        return std::size_t(mixed * 0x9e3779b97f4a7c15u >> (64 - bits_));
    }
    std::array<long long, 3> cellOf(const Vec3& p) const
    {
        constexpr double kFarthest = 1e15;  // what flies off to infinity meets nothing
        const auto one = [&](double v) { return (long long)std::clamp(std::floor(v / size_), -kFarthest, kFarthest); };
        return {one(p.x()), one(p.y()), one(p.z())};
    }
    double size_;
    int bits_;
};

constexpr double kBin = 2;  // cells: most groups lie in eight of them or fewer

double spacingOf(const Targets& targets)
{
    double sum = 0;
    for (std::size_t t = 0; t < targets.size(); ++t) sum += std::cbrt(double(targets[t].restVolume));
    return sum / double(targets.size());
}

std::vector<Box> waysOf(const Targets& targets, std::span<const Vec3> x, std::span<const Vec3> ahead, double margin)
{
    std::vector<Box> boxes(targets.size());
    parallelChunks(targets.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) {
            std::array<Vec3, 8> points;
            for (std::size_t a = 0; a < 4; ++a)
                points[a] = x[targets[t].node[a]], points[4 + a] = ahead[targets[t].node[a]];
            boxes[t] = around(points, margin);
        }
    });
    return boxes;
}

std::vector<Box> groupBoxes(const Targets& targets, const std::vector<Box>& boxes)
{
    std::vector<Box> groups(targets.groups().size());
    for (std::size_t g = 0; g < groups.size(); ++g) {
        const Targets::Group& group = targets.groups()[g];
        groups[g] = boxes[group.first];
        for (std::uint32_t t = group.first; t < group.end; ++t)
            groups[g] = {groups[g].lower.cwiseMin(boxes[t].lower), groups[g].upper.cwiseMax(boxes[t].upper)};
    }
    return groups;
}

/// The gradient of what has the values phi at the corners of a tet, times the determinant of its edges, whose cross
/// products are n: of the second and third, of the third and first, of the first and second.
Vec3 gradientTimesVolume(const std::array<float, 4>& phi, const std::array<Vec3, 3>& n)
{
    return double(phi[1] - phi[0]) * n[0] + double(phi[2] - phi[0]) * n[1] + double(phi[3] - phi[0]) * n[2];
}

bool sharesNode(const tetmesh::EmbeddedPoint& point, const Target& target)
{
    for (std::uint32_t n : point.node)
        if (std::find(target.node.begin(), target.node.end(), n) != target.node.end()) return true;
    return false;
}

/// Is a group near a sample at rest, and does not face it?
bool isBeside(const TouchingSurface& surface, std::size_t sample, const Targets::Group& group)
{
    constexpr double kNear = 2.5;    // cells
    constexpr double kFacing = -.3;  // cosine of the angle between the directions outward, at the most
    if (surface.body(sample) != group.body) return false;
    const Vec3 away = surface.restPosition(sample) - group.X.cast<double>();
    return away.squaredNorm() < kNear * kNear * double(group.size) * double(group.size) &&
           surface.restNormal(sample).dot(group.outward.cast<double>()) > kFacing;
}

}  // namespace

void Targets::set(std::span<const core::Body> bodies, double depth)
{
    target_.clear(), inside_.clear(), group_.clear();
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const core::Body& body = bodies[b];
        const tetmesh::PhiTets tets = body.mesh->phiTets(depth);
        for (std::size_t i = 0; i < tets.tets.size(); ++i) {
            const tetmesh::PhiTet& t = tets.tets[i];
            std::array<Vec3, 4> X;
            for (std::size_t a = 0; a < 4; ++a) X[a] = body.mesh->restPosition(t.node[a]);
            const Vec3 e1 = X[1] - X[0], e2 = X[2] - X[0], e3 = X[3] - X[0];
            const std::array<Vec3, 3> n{e2.cross(e3), e3.cross(e1), e1.cross(e2)};
            Target target;
            target.node = t.node, target.phi = t.phi;
            target.restVolume = float(std::abs(n[2].dot(e3)));
            target.inside = t.part + std::uint32_t(inside_.size());
            target.fragment = body.fragments.ofNode()[t.node[0]];
            target.body = std::uint16_t(b);
            for (std::uint32_t& node : target.node) node += body.firstNode;
            if (i == 0 || t.element != tets.tets[i - 1].element)
                group_.push_back({std::uint32_t(target_.size()), 0, target.body, std::cbrt(target.restVolume),
                                  Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero()});
            target_.push_back(target);
            Group& group = group_.back();
            group.end = std::uint32_t(target_.size());
            group.X += (0.25 * (X[0] + X[1] + X[2] + X[3])).cast<float>();
            group.outward += gradientTimesVolume(t.phi, n).stableNormalized().cast<float>();
        }
        inside_.insert(inside_.end(), tets.inside.begin(), tets.inside.end());
    }
    for (Group& group : group_) group.X /= float(group.end - group.first), group.outward.stableNormalize();
}

InTarget Targets::locate(std::size_t n, const Vec3& y, std::span<const Vec3> x) const
{
    constexpr double kFlat = 0.05;  // of the volume at rest
    const Target& t = target_[n];
    const Vec3& z0 = x[t.node[0]];
    const Vec3 e1 = x[t.node[1]] - z0, e2 = x[t.node[2]] - z0, e3 = x[t.node[3]] - z0, d = y - z0;
    const std::array<Vec3, 3> normal{e2.cross(e3), e3.cross(e1), e1.cross(e2)};
    const double volume = e1.dot(normal[0]);
    InTarget in;
    if (!(volume > kFlat * double(t.restVolume))) return in;
    in.share = {0, d.dot(normal[0]) / volume, d.dot(normal[1]) / volume, d.dot(normal[2]) / volume};
    in.share[0] = 1 - in.share[1] - in.share[2] - in.share[3];
    in.least = 1;
    for (const auto& row : inside_[t.inside]) {
        double share = 0;
        for (std::size_t a = 0; a < 4; ++a) share += row[a] * in.share[a];
        in.least = std::min(in.least, share);
    }
    for (std::size_t a = 0; a < 4; ++a) in.phi += in.share[a] * double(t.phi[a]);
    in.outward = gradientTimesVolume(t.phi, normal) / volume;
    return in;
}

std::size_t Targets::bytes() const
{
    return target_.capacity() * sizeof(Target) + group_.capacity() * sizeof(Group) +
           inside_.capacity() * sizeof(tetmesh::TetMatrix);
}

void NearTets::find(const TouchingSurface& surface, const Targets& targets, std::span<const Vec3> x,
                    std::span<const Vec3> ahead, double margin)
{
    sample_.clear(), target_.clear(), start_.assign(1, 0);
    if (targets.size() == 0 || surface.size() == 0) return;
    const std::vector<Box> boxes = waysOf(targets, x, ahead, margin);
    const std::vector<Box> groups = groupBoxes(targets, boxes);
    const Bins bins(kBin * spacingOf(targets), groups.size());
    const Groups inBin = groupItems(bins.count(), [&](const auto& add) {
        for (std::uint32_t g = 0; g < groups.size(); ++g) bins.visit(groups[g], [&](std::size_t bin) { add(bin, g); });
    });
    const auto meet = [&](std::size_t begin, std::size_t end, std::vector<Pair>& found) {
        std::vector<std::uint32_t> near;
        for (std::size_t i = begin; i < end; ++i) {
            const std::array<Vec3, 2> way{surface.at(i, x), surface.at(i, ahead)};
            const Box box = around(way, 0);
            near.clear();
            bins.visit(box, [&](std::size_t bin) {
                for (std::uint32_t g : inBin[bin]) {
                    const Targets::Group& group = targets.groups()[g];
                    if (!groups[g].meets(box) || isBeside(surface, i, group)) continue;
                    for (std::uint32_t t = group.first; t < group.end; ++t)
                        if (boxes[t].meets(box) && !sharesNode(surface.point(i), targets[t])) near.push_back(t);
                }
            });
            std::sort(near.begin(), near.end(), [&](std::uint32_t a, std::uint32_t b) {
                return std::pair(targets[a].fragment, a) < std::pair(targets[b].fragment, b);
            });
            near.erase(std::unique(near.begin(), near.end()), near.end());
            for (std::uint32_t t : near) found.push_back({std::uint32_t(i), t});
        }
    };
    for (const Pair& p : gatherChunks<Pair>(surface.size(), kSamples, meet)) {
        if (sample_.empty() || sample_.back() != p.sample) sample_.push_back(p.sample), start_.push_back(start_.back());
        target_.push_back(p.target);
        ++start_.back();
    }
}

std::vector<Pair> NearTets::seenAt(const TouchingSurface& surface, const Targets& targets, std::span<const Vec3> x,
                                   double reach) const
{
    return gatherChunks<Pair>(samples(), kSamples, [&](std::size_t begin, std::size_t end, std::vector<Pair>& seen) {
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3 y = surface.at(sample_[i], x);
            std::uint32_t fragment = ~0u;
            double best = 0;
            for (std::uint32_t t : this->targets(i)) {
                const double least = targets.locate(t, y, x).least;
                const bool next = targets[t].fragment != fragment;
                if (least < -reach || (!next && least <= best)) continue;
                if (next) seen.push_back({sample_[i], t});
                seen.back().target = t;
                fragment = targets[t].fragment, best = least;
            }
        }
    });
}

std::size_t NearTets::bytes() const
{
    return (sample_.capacity() + start_.capacity() + target_.capacity()) * sizeof(std::uint32_t);
}

}  // namespace vdbfrac::contact
