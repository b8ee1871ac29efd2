// Which samples of the surface may come to lie in which tets in a step.
#pragma once

#include <vdbfrac/contact/broad_phase.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace vdbfrac::contact {

/// A sample and the target that it is seen in.
struct Pair {
    std::uint32_t sample = 0, target = 0;
};

/// A sample in other material; what its allowance is does not count.
struct Penetration {
    std::uint32_t sample = 0, target = 0;
    double depth = 0;  ///< m, above 0
    std::array<double, 4> share{};
    bool inItself = false;  ///< in its own fragment
};

/// Of each sample [m], 0 where it is in nothing.
std::vector<double> deepest(std::span<const Penetration> sunk, std::size_t samples);

/// Targets that each sample may reach: its way and theirs over the step come near each other. A sample does not see its
/// own neighbourhood: the targets with which it shares a node, and those of its fragment that are near it at rest but
/// not across a gap. A sample on a lip sees those too that are not joined to it there. So both lips of a crack see each
/// other once they have parted.
class NarrowPhase {
public:
    /// Between fragments on ways seen from what is common to all, `own`: within each on those seen from that of the
    /// fragment, whatever the others do. Motion is widened by `margin` [m]. True where the broad phase has looked
    /// again.
    bool find(const ContactSurface& surface, const Targets& targets, const Motion& motion, const Motion& own,
              double margin);
    /// Lists less of what was found on longer ways.
    void list(const ContactSurface& surface, const Targets& targets, const Motion& motion, const Motion& own,
              double margin);
    /// Samples and targets are others.
    void clear() { *this = {}; }
    void save(const std::string& name, core::Archive& archive) const;
    void restoreFrom(const std::string& name, const core::Archive& archive, std::size_t nodes);

    /// In each fragment the target that a sample lies in, or nearest to which it is: no farther outside than `reach`,
    /// in barycentric coordinates. By rising sample. What is `held`, by rising sample, is so until a sample is well
    /// outside.
    std::vector<Pair> seenAt(const ContactSurface& surface, const Targets& targets, std::span<const Vec3> x,
                             double reach, std::span<const Pair> held = {}) const;

    /// Samples that are in what they see, by rising sample.
    std::vector<Penetration> penetrationsAt(const ContactSurface& surface, const Targets& targets,
                                            std::span<const Vec3> x, double reach) const;
    /// At most that a sample and a node of a target move against each other at x, at the velocities v [m/s]; of one
    /// fragment, as seen from it.
    double fastest(const ContactSurface& surface, const Targets& targets, std::span<const Vec3> x,
                   std::span<const Vec3> v) const;
    /// At most how much nearer one comes to the other [m]; of one fragment, as seen from it.
    double farthest(const ContactSurface& surface, const Targets& targets, std::span<const Vec3> from,
                    std::span<const Vec3> to) const;

    std::size_t pairs() const { return target_.size(); }
    std::size_t samples() const { return sample_.size(); }
    std::uint32_t sample(std::size_t i) const { return sample_[i]; }  ///< rising
    /// By rising fragment, then target.
    std::span<const std::uint32_t> targets(std::size_t i) const
    {
        return std::span(target_).subspan(start_[i], start_[i + 1] - start_[i]);
    }
    std::size_t bytes() const;

private:
    void clearPairs();
    /// Of between(sample)(node, is it of the sample's fragment?) for all samples and the nodes of what they may reach,
    /// and 0.
    template <class Between>
    double largest(const ContactSurface& surface, const Targets& targets, const Between& between) const;

    std::vector<std::uint32_t> sample_, start_, target_;
    BroadPhase between_{BroadPhase::Among::fragments}, within_{BroadPhase::Among::withinFragments};
};

/// The pairs seen at x, and for each sample that is in no target of a fragment there the last pair `known` with it.
/// Without these, a sample that was just pushed out could go back in, deep, unseen. A pair is dropped where it would
/// push a sample that has long left. All by rising sample, then fragment.
std::vector<Pair> withKnown(std::span<const Pair> seen, std::span<const Pair> known, const ContactSurface& surface,
                            const Targets& targets, std::span<const Vec3> x);

}  // namespace vdbfrac::contact
