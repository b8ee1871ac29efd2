#include <vdbfrac/contact/narrow_phase.h>

#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

namespace vdbfrac::contact {

namespace {

constexpr std::size_t kSamples = 512;  // a chunk: what they lie in takes a microsecond each
bool sharesNode(const tetmesh::EmbeddedPoint& point, const Target& target)
{
    for (std::uint32_t n : point.node)
        if (std::find(target.node.begin(), target.node.end(), n) != target.node.end()) return true;
    return false;
}

/// The pairs of sample and target among candidates whose ways come as near as `margin` [m].
std::vector<Pair> meeting(std::span<const BroadPhase::Candidate> candidates, const ContactSurface& surface,
                          const Targets& targets, const Motion& motion, double margin)
{
    if (candidates.empty()) return {};
    const std::vector<Box> boxes = boxesOf(targets.groups(), motion, margin);
    const auto meet = [&](std::size_t begin, std::size_t end, std::vector<Pair>& found) {
        std::uint32_t last = ~0u;
        Box way;
        for (const auto& [sample, g] : candidates.subspan(begin, end - begin)) {
            if (sample != last) way = Box(surface.probe(sample, motion.from)).extend(surface.probe(sample, motion.to));
            last = sample;
            if (!boxes[g].intersects(way)) continue;
            const Targets::Group& group = targets.groups()[g];
            for (std::uint32_t t = group.first; t < group.end; ++t)
                if (boxOf(targets[t].node, motion, margin).intersects(way) &&
                    !sharesNode(surface.point(sample), targets[t]))
                    found.push_back({sample, t});
        }
    };
    return gatherChunks<Pair>(candidates.size(), kSamples, meet);
}

}  // namespace

bool NarrowPhase::find(const ContactSurface& surface, const Targets& targets, const Motion& motion, const Motion& own,
                       double margin)
{
    if (targets.size() == 0 || surface.size() == 0) return clearPairs(), false;
    const bool hasLooked = between_.find(surface, targets, motion, margin),
               hasLookedWithin = within_.find(surface, targets, own, margin);
    list(surface, targets, motion, own, margin);
    return hasLooked || hasLookedWithin;
}

void NarrowPhase::list(const ContactSurface& surface, const Targets& targets, const Motion& motion, const Motion& own,
                       double margin)
{
    clearPairs();
    const std::array pairs{meeting(between_.candidates(), surface, targets, motion, margin),
                           meeting(within_.candidates(), surface, targets, own, margin)};
    if (pairs[0].empty() && pairs[1].empty()) return;
    std::vector<std::uint32_t> end(surface.size(), 0);  // of each sample's targets
    for (const std::vector<Pair>& some : pairs)
        for (const Pair& p : some) ++end[p.sample];
    std::uint32_t count = 0;
    for (std::uint32_t i = 0; i < end.size(); ++i) {
        if (end[i] > 0) sample_.push_back(i), start_.push_back(count + end[i]);
        count += std::exchange(end[i], count);
    }
    target_.resize(count);
    for (const std::vector<Pair>& some : pairs)
        for (const Pair& p : some) target_[end[p.sample]++] = p.target;
    parallelChunks(sample_.size(), kSamples, [&](std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to; ++i)
            std::ranges::sort(target_.begin() + start_[i], target_.begin() + start_[i + 1], {},
                              [&](std::uint32_t t) { return std::pair(targets[t].fragment, t); });
    });
}

void NarrowPhase::clearPairs() { sample_.clear(), target_.clear(), start_.assign(1, 0); }

void NarrowPhase::save(const std::string& name, core::Archive& archive) const
{
    between_.save(name + ".between", archive), within_.save(name + ".within", archive);
}

void NarrowPhase::restoreFrom(const std::string& name, const core::Archive& archive, std::size_t nodes)
{
    between_.restoreFrom(name + ".between", archive, nodes), within_.restoreFrom(name + ".within", archive, nodes);
}

std::vector<Pair> NarrowPhase::seenAt(const ContactSurface& surface, const Targets& targets, std::span<const Vec3> x,
                                      double reach, std::span<const Pair> held) const
{
    constexpr double kOut = 0.2;  // in barycentric coordinates: farther outside of what holds it, it is held no more
    return gatherChunks<Pair>(samples(), kSamples, [&](std::size_t begin, std::size_t end, std::vector<Pair>& seen) {
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3 y = surface.probe(sample_[i], x);
            const auto own = std::ranges::equal_range(held, sample_[i], {}, &Pair::sample);
            std::uint32_t fragment = ~0u;
            double best = 0;
            for (std::uint32_t t : this->targets(i)) {
                const bool isHeld = std::ranges::find(own, t, &Pair::target) != own.end();
                double least = targets.leastShare(t, y, isHeld ? kOut : reach, x);
                if (isHeld && least >= -kOut) least = kInfinity;
                const bool next = targets[t].fragment != fragment;
                if (least < -reach || (!next && least <= best)) continue;
                if (next) seen.push_back({sample_[i], t});
                seen.back().target = t;
                fragment = targets[t].fragment, best = least;
            }
        }
    });
}

std::vector<Penetration> NarrowPhase::penetrationsAt(const ContactSurface& surface, const Targets& targets,
                                                     std::span<const Vec3> x, double reach) const
{
    std::vector<Penetration> all;
    for (const Pair& p : seenAt(surface, targets, x, reach)) {
        const InTarget in = targets.locate(p.target, surface.probe(p.sample, x), x);
        const double depth = surface.reach(p.sample) - in.phi;
        const bool inItself = surface.fragment(p.sample) == targets[p.target].fragment;
        if (depth > 0) all.push_back({p.sample, p.target, depth, in.share, inItself});
    }
    return all;
}

std::vector<double> deepest(std::span<const Penetration> sunk, std::size_t samples)
{
    std::vector<double> depth(samples, 0);
    for (const Penetration& s : sunk) depth[s.sample] = std::max(depth[s.sample], s.depth);
    return depth;
}

template <class Between>
double NarrowPhase::largest(const ContactSurface& surface, const Targets& targets, const Between& between) const
{
    return orderedMax(samples(), kChunk, 0, [&](std::size_t begin, std::size_t end) {
        double most = 0;
        for (std::size_t i = begin; i < end; ++i) {
            const auto toNode = between(sample_[i]);
            for (std::uint32_t t : this->targets(i))
                for (std::uint32_t n : targets[t].node)
                    most = std::max(most, toNode(n, targets[t].fragment == surface.fragment(sample_[i])));
        }
        return most;
    });
}

double NarrowPhase::fastest(const ContactSurface& surface, const Targets& targets, std::span<const Vec3> x,
                            std::span<const Vec3> v) const
{
    if (samples() == 0) return 0;
    const std::vector<Vec3> own = RelativeMotion::ahead(x, v, 1, kInfinity, surface.fragmentOfNode()).ways();
    return std::sqrt(largest(surface, targets, [&](std::uint32_t sample) {
        return [&, ofAll = surface.at(sample, v), inIt = surface.at(sample, own)](std::uint32_t n, bool isOwn) {
            return (isOwn ? Vec3(inIt - own[n]) : Vec3(ofAll - v[n])).squaredNorm();
        };
    }));
}

double NarrowPhase::farthest(const ContactSurface& surface, const Targets& targets, std::span<const Vec3> from,
                             std::span<const Vec3> to) const
{
    if (samples() == 0) return 0;
    const std::vector<Vec3> own = RelativeMotion::gone(from, to, kInfinity, surface.fragmentOfNode()).ends();
    return largest(surface, targets, [&](std::uint32_t sample) {
        return [&, before = surface.at(sample, from), after = surface.at(sample, to), inIt = surface.at(sample, own)](
                   std::uint32_t n, bool isOwn) {
            const Vec3 gap = from[n] - before;
            const Vec3 move = isOwn ? Vec3(inIt - own[n] + gap) : Vec3(after - to[n] + gap);
            return gap.isZero() ? move.norm() : move.dot(gap) / gap.norm();
        };
    });
}

std::vector<Pair> withKnown(std::span<const Pair> seen, std::span<const Pair> known, const ContactSurface& surface,
                            const Targets& targets, std::span<const Vec3> x)
{
    constexpr double kGone = 2;  // in barycentric coordinates; how far outside a plane of phi is taken for a surface
    const auto before = [&](const Pair& a, const Pair& b) {
        return std::pair(a.sample, targets[a.target].fragment) < std::pair(b.sample, targets[b.target].fragment);
    };
    std::vector<Pair> lost, all;
    std::set_difference(known.begin(), known.end(), seen.begin(), seen.end(), std::back_inserter(lost), before);
    std::erase_if(lost, [&](const Pair& p) {
        return targets.leastShare(p.target, surface.probe(p.sample, x), kGone, x) < -kGone;
    });
    std::merge(seen.begin(), seen.end(), lost.begin(), lost.end(), std::back_inserter(all), before);
    return all;
}

std::size_t NarrowPhase::bytes() const
{
    return (sample_.capacity() + start_.capacity() + target_.capacity()) * sizeof(std::uint32_t) + between_.bytes() +
           within_.bytes();
}

}  // namespace vdbfrac::contact
