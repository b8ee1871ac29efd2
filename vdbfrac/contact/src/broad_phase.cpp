#include <vdbfrac/contact/broad_phase.h>

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace vdbfrac::contact {

namespace {

constexpr std::size_t kClusters = 128;  // a chunk: their samples take a microsecond each

/// Cells of a grid over space, in bins by a hash of their coordinates.
class Bins {
public:
    Bins(double size, std::size_t things) : size_(size), bits_(std::bit_width(2 * things)) {}
    std::size_t count() const { return std::size_t{1} << bits_; }
    /// Calls visit(bin) for each cell that a box meets.
    template <class Visit>
    void visit(const Box& box, const Visit& visit) const
    {
        const std::array<long long, 3> low = cellOf(box.min()), high = cellOf(box.max());
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

constexpr double kBin = 3;  // cells: a group, with its margins, lies in eight of them

/// In which a sample may meet something. One that lives on has room for lips in whatever direction they will feel then.
Box roomOf(const ContactSurface& surface, std::uint32_t sample, const Motion& motion, double slack)
{
    Box box;
    if (slack == 0) return box.extend(surface.probe(sample, motion.from)).extend(surface.probe(sample, motion.to));
    box.extend(surface.at(sample, motion.from)).extend(surface.at(sample, motion.to));
    return wider(box, surface.stretch(sample) * slack + surface.lipGap(sample));
}

/// How far [m] nodes can go from x before a sample comes into a box, which follows them.
double wayInto(const Box& box, const ContactSurface& surface, std::uint32_t sample, std::span<const Vec3> x)
{
    const Vec3 y = surface.at(sample, x);
    const double apart = (box.min() - y).cwiseMax(y - box.max()).maxCoeff() - surface.lipGap(sample);
    return apart / (1 + surface.stretch(sample));
}

/// What samples of one fragment and groups of another come nearer to each other [m] than their nodes do.
double roomBetween(const ContactSurface& surface, double margin, double slack)
{
    double stretch = 1;
    for (std::size_t i = 0; slack > 0 && i < surface.size(); ++i) stretch = std::max(stretch, surface.stretch(i));
    return margin + (1 + stretch) * slack + surface.farthestProbe();
}

/// Groups of each node; none where nothing has torn.
Groups groupsOfNodes(const ContactSurface& surface, const Targets& targets, std::size_t nodes)
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
    OwnMaterial(const ContactSurface& surface, const Targets& targets, const Groups& ofNode)
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
            enter(group.nodesOfTargets());
        }
    }

    const ContactSurface& surface_;
    const Targets& targets_;
    const Groups& ofNode_;
    std::uint32_t sample_ = kNone;
    std::vector<std::uint32_t> round_;  // of each group: the last sample that it is round
    std::vector<std::uint32_t> left_;   // of each node: the last sample for which its groups were looked at
    std::vector<std::uint32_t> reached_;
};

}  // namespace

std::vector<Box> boxesOf(std::span<const Targets::Group> groups, const Motion& motion, double margin)
{
    std::vector<Box> boxes(groups.size());
    parallelChunks(boxes.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t g = begin; g < end; ++g) boxes[g] = boxOf(groups[g].nodesOfTargets(), motion, margin);
    });
    return boxes;
}

bool BroadPhase::search(const ContactSurface& surface, const Targets& targets, const Motion& motion, double margin)
{
    candidates_.clear(), apart_ = 0;
    if (among_ == Among::fragments && !mayMeet(motion, surface.fragmentOfNode(), roomBetween(surface, margin, slack_)))
        return false;
    const std::vector<Box> groups = boxesOf(targets.groups(), motion, margin + slack_);
    const Bins bins(kBin * targets.spacing(), groups.size());
    const Groups inBin = groupItems(bins.count(), [&](const auto& add) {
        for (std::uint32_t g = 0; g < groups.size(); ++g) bins.visit(groups[g], [&](std::size_t bin) { add(bin, g); });
    });
    const Groups ofNode = groupsOfNodes(surface, targets, motion.from.size());
    std::vector<OwnMaterial> ownOfThread(std::size_t(threadSlots()), OwnMaterial(surface, targets, ofNode));
    std::vector<std::vector<std::uint8_t>> nearOfThread(ownOfThread.size());  // as a group lies in several bins
    const bool isWithin = among_ == Among::withinFragments;
    const auto meet = [&](std::size_t begin, std::size_t end, std::vector<Candidate>& found) {
        std::vector<std::uint32_t> near;
        std::vector<Box> rooms;
        OwnMaterial& own = ownOfThread[std::size_t(threadSlot())];
        std::vector<std::uint8_t>& isNear = nearOfThread[std::size_t(threadSlot())];
        isNear.resize(groups.size(), 0);
        for (std::size_t c = begin; c < end; ++c) {
            const auto cluster = surface.cluster(c);
            Box all;
            rooms.clear();
            for (std::uint32_t i : cluster) all.extend(rooms.emplace_back(roomOf(surface, i, motion, slack_)));
            near.clear();
            bins.visit(all, [&](std::size_t bin) {
                for (std::uint32_t g : inBin[bin])
                    if (!isNear[g] && groups[g].intersects(all)) isNear[g] = 1, near.push_back(g);
            });
            for (std::uint32_t g : near) isNear[g] = 0;
            for (std::size_t s = 0; s < cluster.size(); ++s)
                for (std::uint32_t g : near)
                    if ((surface.fragment(cluster[s]) == targets.groups()[g].fragment) == isWithin &&
                        groups[g].intersects(rooms[s]) && !own.has(cluster[s], g))
                        found.push_back({cluster[s], g});
        }
    };
    candidates_ = gatherChunks<Candidate>(surface.clusters(), kClusters, meet);
    if (slack_ == 0) return true;
    apart_ = -orderedMax(candidates_.size(), kChunk, -slack_, [&](std::size_t begin, std::size_t end) {
        double least = slack_;
        for (const auto& [sample, g] : std::span(candidates_).subspan(begin, end - begin))
            least = std::min(least, wayInto(wider(groups[g], -slack_), surface, sample, motion.from));
        return -least;
    });
    return true;
}

bool BroadPhase::find(const ContactSurface& surface, const Targets& targets, const Motion& motion, double margin)
{
    constexpr double kSlack = 0.5;  // cells: longer lists, and longer lives of them where little moves
    if (among_ == Among::fragments && surface.isOneFragment()) return candidates_.clear(), false;
    if (isRestored_ && slack_ > 0) search(surface, targets, {x_, x_}, margin);
    isRestored_ = false;
    const auto frame = among_ == Among::withinFragments ? surface.fragmentOfNode() : std::span<const std::uint32_t>();
    const auto move = [&](std::span<const Vec3> from, std::span<const Vec3> to) {
        return farthestMove(from, to, frame);
    };
    if (slack_ > 0) moved_ = std::max(move(x_, motion.from), move(x_, motion.to));
    if (slack_ > 0 && moved_ <= slack_) return false;
    // Lists live long where steps are short, unless each step tears the surface that they are of.
    const double slack = kSlack * targets.spacing();
    moved_ = move(motion.from, motion.to);
    const bool lives = mayLive_ && 2 * moved_ <= slack;
    mayLive_ = true;
    slack_ = lives ? slack : 0;
    x_.assign(motion.from.begin(), lives ? motion.from.end() : motion.from.begin());
    return search(surface, targets, lives ? Motion{x_, x_} : motion, margin);
}

void BroadPhase::save(const std::string& name, core::Archive& archive) const
{
    archive.putOne(name + ".may_live", std::int64_t{mayLive_});
    archive.put(name + ".looked_at", x_);
    archive.putOne(name + ".slack", slack_);
}

void BroadPhase::restoreFrom(const std::string& name, const core::Archive& archive, std::size_t nodes)
{
    clear();
    mayLive_ = archive.getOne<std::int64_t>(name + ".may_live") != 0;
    x_ = archive.get<Vec3>(name + ".looked_at");
    slack_ = archive.getOne<double>(name + ".slack");
    isRestored_ = true;
    if (!(slack_ >= 0) || x_.size() != (slack_ > 0 ? nodes : 0) ||
        !std::all_of(x_.begin(), x_.end(), [](const Vec3& x) { return x.allFinite(); }))
        archive.complain("where " + name + " looked for what is near is out of range");
}

}  // namespace vdbfrac::contact
