#include <vdbfrac/contact/near_tets.h>

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <tuple>
#include <utility>

namespace vdbfrac::contact {

namespace {

constexpr std::size_t kSamples = 512;   // a chunk: what they lie in takes a microsecond each
constexpr std::size_t kClusters = 128;  // a chunk of those

struct Box {
    Vec3 lower, upper;

    static Box none()
    {
        return {Vec3::Constant(std::numeric_limits<double>::infinity()),
                Vec3::Constant(-std::numeric_limits<double>::infinity())};
    }
    static Box of(const Vec3& point) { return {point, point}; }
    Box with(const Vec3& point) const { return {lower.cwiseMin(point), upper.cwiseMax(point)}; }
    Box wider(double margin) const { return {lower - Vec3::Constant(margin), upper + Vec3::Constant(margin)}; }
    bool meets(const Box& other) const
    {
        return (lower.array() <= other.upper.array()).all() && (other.lower.array() <= upper.array()).all();
    }
};

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

/// Round the ways of some nodes.
Box wayOf(std::span<const std::uint32_t> nodes, std::span<const Vec3> x, std::span<const Vec3> ahead, double margin)
{
    Box box = Box::none();
    for (std::uint32_t n : nodes) box = box.with(x[n]).with(ahead[n]);
    return box.wider(margin);
}

std::vector<Box> waysOf(const Targets& targets, std::span<const Vec3> x, std::span<const Vec3> ahead, double margin)
{
    std::vector<Box> boxes(targets.groups().size());
    parallelChunks(boxes.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t g = begin; g < end; ++g) {
            const Targets::Group& group = targets.groups()[g];
            boxes[g] = wayOf(std::span(group.node).first(group.nodes), x, ahead, margin);
        }
    });
    return boxes;
}

bool sharesNode(const tetmesh::EmbeddedPoint& point, const Target& target)
{
    for (std::uint32_t n : point.node)
        if (std::find(target.node.begin(), target.node.end(), n) != target.node.end()) return true;
    return false;
}

/// Groups of each node; none where nothing has torn.
Groups groupsOfNodes(const TouchingSurface& surface, const Targets& targets, std::size_t nodes)
{
    std::size_t i = 0;
    while (i < surface.size() && !surface.isTorn(i)) ++i;
    if (i == surface.size()) return {};
    return groupItems(nodes, [&](const auto& add) {
        for (std::uint32_t g = 0; g < targets.groups().size(); ++g) {
            const Targets::Group& group = targets.groups()[g];
            for (std::size_t k = 0; k < group.nodes; ++k) add(group.node[k], g);
        }
    });
}

/// What a sample does not see: the material that it is part of. One for each thread, as it remembers all groups.
class OwnMaterial {
public:
    OwnMaterial(const TouchingSurface& surface, const Targets& targets, const Groups& ofNode)
        : surface_(surface), targets_(targets), ofNode_(ofNode)
    {
    }

    /// Is a group of the same fragment near a sample at rest and not across a gap from it, and, for a sample on a lip,
    /// joined to it there by groups that are? The back of a thin sheet faces away and lies behind: where the sheet is
    /// crushed, its two sides do not push each other.
    bool has(std::uint32_t sample, std::uint32_t g)
    {
        constexpr double kFacing = -.3;  // cosine of the angle between the directions outward, at the most
        const Targets::Group& group = targets_.groups()[g];
        if (surface_.fragment(sample) != group.fragment || !isNear(sample, group)) return false;
        const Vec3 there = group.X.cast<double>() - surface_.restPosition(sample), out = surface_.restNormal(sample);
        if (out.dot(group.outward.cast<double>()) <= kFacing && out.dot(there) >= 0) return false;
        if (!surface_.isTorn(sample)) return true;  // to ask all samples takes too long
        if (sample != sample_) findRound(sample);
        return round_[g] == sample;
    }

private:
    static constexpr std::uint32_t kNone = ~0u;

    bool isNear(std::uint32_t sample, const Targets::Group& group) const
    {
        constexpr double kNear = 2.5;  // cells
        const double reach = kNear * double(group.size);
        return (group.X.cast<double>() - surface_.restPosition(sample)).squaredNorm() < reach * reach;
    }
    /// Goes from the nodes of the sample from group to group.
    void findRound(std::uint32_t sample)
    {
        sample_ = sample;
        reached_.clear();
        round_.resize(targets_.groups().size(), kNone), left_.resize(ofNode_.start.size() - 1, kNone);
        const auto enter = [&](std::span<const std::uint32_t> nodes) {
            for (const std::uint32_t node : nodes) {
                if (left_[node] == sample) continue;
                left_[node] = sample;
                for (const std::uint32_t g : ofNode_[node])
                    if (round_[g] != sample && isNear(sample, targets_.groups()[g]))
                        round_[g] = sample, reached_.push_back(g);
            }
        };
        enter(surface_.point(sample).node);
        for (std::size_t i = 0; i < reached_.size(); ++i) {
            const Targets::Group& group = targets_.groups()[reached_[i]];
            enter(std::span(group.node).first(group.nodes));
        }
    }

    const TouchingSurface& surface_;
    const Targets& targets_;
    const Groups& ofNode_;
    std::uint32_t sample_ = kNone;
    std::vector<std::uint32_t> round_;  // of each group: the last sample that it is round
    std::vector<std::uint32_t> left_;   // of each node: the last sample for which its groups were looked at
    std::vector<std::uint32_t> reached_;
};

}  // namespace

void NearTets::findWide(const TouchingSurface& surface, const Targets& targets, const Ways& ways, Among among,
                        double margin)
{
    const auto [x, ahead] = ways;
    const auto isAmong = [&](std::uint32_t sample, std::uint32_t g) {
        return among == Among::all ||
               (surface.fragment(sample) == targets.groups()[g].fragment) == (among == Among::own);
    };
    const std::vector<Box> groups = waysOf(targets, x, ahead, margin + wide_.slack);
    const Bins bins(kBin * targets.spacing(), groups.size());
    const Groups inBin = groupItems(bins.count(), [&](const auto& add) {
        for (std::uint32_t g = 0; g < groups.size(); ++g) bins.visit(groups[g], [&](std::size_t bin) { add(bin, g); });
    });
    const Groups ofNode = groupsOfNodes(surface, targets, x.size());
    std::vector<OwnMaterial> ownOfThread(std::size_t(threadSlots()), OwnMaterial(surface, targets, ofNode));
    using Found = std::array<std::uint32_t, 2>;
    const auto meet = [&](std::size_t begin, std::size_t end, std::vector<Found>& found) {
        std::vector<std::uint32_t> near;
        std::vector<Box> rooms;
        OwnMaterial& own = ownOfThread[std::size_t(threadSlot())];
        for (std::size_t c = begin; c < end; ++c) {
            const auto cluster = surface.cluster(c);
            Box all = Box::none();
            rooms.clear();
            for (std::uint32_t i : cluster) {
                // A list that lives on has room for lips in whatever direction they will feel then.
                if (wide_.slack > 0) {
                    const Box way = Box::of(surface.at(i, x)).with(surface.at(i, ahead));
                    rooms.push_back(way.wider(surface.stretch(i) * wide_.slack + surface.toLip(i)));
                } else {
                    rooms.push_back(Box::of(surface.feels(i, x)).with(surface.feels(i, ahead)));
                }
                all = all.with(rooms.back().lower).with(rooms.back().upper);
            }
            near.clear();
            bins.visit(all, [&](std::size_t bin) {
                for (std::uint32_t g : inBin[bin])
                    if (groups[g].meets(all)) near.push_back(g);
            });
            sortUnique(near);
            for (std::size_t s = 0; s < cluster.size(); ++s)
                for (std::uint32_t g : near)
                    if (isAmong(cluster[s], g) && groups[g].meets(rooms[s]) && !own.has(cluster[s], g))
                        found.push_back({cluster[s], g});
        }
    };
    const std::vector<Found> found = gatherChunks<Found>(surface.clusters(), kClusters, meet);
    wide_.pair.insert(wide_.pair.end(), found.begin(), found.end());
}

void NearTets::save(const std::string& name, core::Archive& archive) const
{
    archive.put(name + ".looked_at", wide_.x);
    archive.putOne(name + ".slack", wide_.slack);
}

void NearTets::restoreFrom(const std::string& name, const core::Archive& archive, std::size_t nodes)
{
    wide_ = {archive.getOne<double>(name + ".slack"), archive.get<Vec3>(name + ".looked_at"), true, {}};
    wide_.isRestored = !wide_.x.empty();
    if (!(wide_.slack >= 0) || (wide_.isRestored && wide_.x.size() != nodes) ||
        !std::all_of(wide_.x.begin(), wide_.x.end(), [](const Vec3& x) { return x.allFinite(); }))
        archive.complain("where " + name + " looked for what is near is out of range");
}

bool NearTets::find(const TouchingSurface& surface, const Targets& targets, const Ways& ways, const Ways& own,
                    double margin)
{
    constexpr double kSlack = 0.5;  // cells: longer lists, and longer lives of them where little moves
    sample_.clear(), target_.clear(), start_.assign(1, 0);
    if (targets.size() == 0 || surface.size() == 0) return false;
    const auto [x, ahead] = ways;
    if (wide_.isRestored) findWide(surface, targets, {wide_.x, wide_.x}, Among::all, margin), wide_.isRestored = false;
    const bool isNew = wide_.x.empty();
    const bool wide = isNew || std::max(farthestMove(wide_.x, x), farthestMove(wide_.x, ahead)) > wide_.slack;
    if (wide) {
        wide_.pair.clear();
        wide_.x.assign(x.begin(), x.end());
        // Lists live long where steps are short, unless each step tears the surface that they are of.
        const double slack = kSlack * targets.spacing();
        const bool lives = !isNew && 2 * farthestMove(x, ahead) <= slack;
        wide_.slack = lives ? slack : 0;
        if (lives) {
            findWide(surface, targets, {x, x}, Among::all, margin);
        } else {
            if (mayMeet(ways, surface.fragmentOfNode(), margin + surface.farthestFelt()))
                findWide(surface, targets, ways, Among::others, margin);
            findWide(surface, targets, own, Among::own, margin);
        }
    }
    const auto meet = [&](std::size_t begin, std::size_t end, std::vector<Pair>& found) {
        std::uint32_t last = ~0u;
        Box way = Box::none();
        bool wasOwn = false;
        for (const auto& [sample, g] : std::span(wide_.pair).subspan(begin, end - begin)) {
            const Targets::Group& group = targets.groups()[g];
            const bool isOwn = surface.fragment(sample) == group.fragment;
            const auto [from, to] = isOwn ? own : ways;
            if (sample != last || isOwn != wasOwn)
                way = Box::of(surface.feels(sample, from)).with(surface.feels(sample, to));
            last = sample, wasOwn = isOwn;
            if (!wayOf(std::span(group.node).first(group.nodes), from, to, margin).meets(way)) continue;
            for (std::uint32_t t = group.first; t < group.end; ++t)
                if (wayOf(targets[t].node, from, to, margin).meets(way) &&
                    !sharesNode(surface.point(sample), targets[t]))
                    found.push_back({sample, t});
        }
    };
    std::vector<Pair> pairs = gatherChunks<Pair>(wide_.pair.size(), kSamples, meet);
    std::sort(pairs.begin(), pairs.end(), [&](const Pair& a, const Pair& b) {
        return std::tuple(a.sample, targets[a.target].fragment, a.target) <
               std::tuple(b.sample, targets[b.target].fragment, b.target);
    });
    for (const Pair& p : pairs) {
        if (sample_.empty() || sample_.back() != p.sample) sample_.push_back(p.sample), start_.push_back(start_.back());
        target_.push_back(p.target);
        ++start_.back();
    }
    return wide;
}

std::vector<Pair> NearTets::seenAt(const TouchingSurface& surface, const Targets& targets, std::span<const Vec3> x,
                                   double reach) const
{
    return gatherChunks<Pair>(samples(), kSamples, [&](std::size_t begin, std::size_t end, std::vector<Pair>& seen) {
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3 y = surface.feels(sample_[i], x);
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

std::vector<Sunk> NearTets::sunkAt(const TouchingSurface& surface, const Targets& targets, std::span<const Vec3> x,
                                   double reach) const
{
    std::vector<Sunk> all;
    for (const Pair& p : seenAt(surface, targets, x, reach)) {
        const InTarget in = targets.locate(p.target, surface.feels(p.sample, x), x);
        const double depth = surface.reach(p.sample) - in.phi;
        const bool inItself = surface.fragment(p.sample) == targets[p.target].fragment;
        if (depth > 0) all.push_back({p.sample, p.target, depth, in.share, inItself});
    }
    return all;
}

std::vector<double> deepest(std::span<const Sunk> sunk, std::size_t samples)
{
    std::vector<double> depth(samples, 0);
    for (const Sunk& s : sunk) depth[s.sample] = std::max(depth[s.sample], s.depth);
    return depth;
}

template <class Between>
double NearTets::largest(const Targets& targets, const Between& between) const
{
    return orderedMax(samples(), kChunk, 0, [&](std::size_t begin, std::size_t end) {
        double most = 0;
        for (std::size_t i = begin; i < end; ++i) {
            const auto toNode = between(sample_[i]);
            for (std::uint32_t t : this->targets(i))
                for (std::uint32_t n : targets[t].node) most = std::max(most, toNode(n));
        }
        return most;
    });
}

double NearTets::fastest(const TouchingSurface& surface, const Targets& targets, std::span<const Vec3> v) const
{
    return std::sqrt(largest(targets, [&](std::uint32_t sample) {
        return [&, own = surface.at(sample, v)](std::uint32_t n) { return (own - v[n]).squaredNorm(); };
    }));
}

double NearTets::farthest(const TouchingSurface& surface, const Targets& targets, std::span<const Vec3> from,
                          std::span<const Vec3> to) const
{
    return largest(targets, [&](std::uint32_t sample) {
        return [&, before = surface.at(sample, from), after = surface.at(sample, to)](std::uint32_t n) {
            const Vec3 gap = from[n] - before, move = after - before - (to[n] - from[n]);
            return gap.isZero() ? move.norm() : move.dot(gap) / gap.norm();
        };
    });
}

std::vector<Pair> withKnown(std::span<const Pair> seen, std::span<const Pair> known, const TouchingSurface& surface,
                            const Targets& targets, std::span<const Vec3> x)
{
    constexpr double kGone = 2;  // in barycentric coordinates; how far outside a plane of phi is taken for a surface
    const auto before = [&](const Pair& a, const Pair& b) {
        return std::pair(a.sample, targets[a.target].fragment) < std::pair(b.sample, targets[b.target].fragment);
    };
    std::vector<Pair> lost, all;
    std::set_difference(known.begin(), known.end(), seen.begin(), seen.end(), std::back_inserter(lost), before);
    std::erase_if(
        lost, [&](const Pair& p) { return targets.locate(p.target, surface.feels(p.sample, x), x).least < -kGone; });
    std::merge(seen.begin(), seen.end(), lost.begin(), lost.end(), std::back_inserter(all), before);
    return all;
}

std::size_t NearTets::bytes() const
{
    return (sample_.capacity() + start_.capacity() + target_.capacity() + 2 * wide_.pair.capacity()) *
               sizeof(std::uint32_t) +
           wide_.x.capacity() * sizeof(Vec3);
}

}  // namespace vdbfrac::contact
