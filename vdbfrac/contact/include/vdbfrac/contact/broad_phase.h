// The broad phase of the search for contact: which samples of the surface may meet which groups of targets.
#pragma once

#include <vdbfrac/contact/targets.h>
#include <vdbfrac/contact/contact_surface.h>
#include <vdbfrac/contact/motion.h>
#include <vdbfrac/core/archive.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace vdbfrac::contact {

/// Round the ways of the nodes of each group, and `margin` [m] wider.
std::vector<Box> boxesOf(std::span<const Targets::Group> groups, const Motion& motion, double margin);

/// Where steps are short its pairs hold as long as no node has moved farther than their slack, and are looked for again
/// only then; else they are those of one step.
class BroadPhase {
public:
    enum class Among {
        fragments,       ///< of two; motion is seen from what is common to all
        withinFragments  ///< of one; motion is seen from that of the fragment, whatever the others do
    };
    struct Candidate {
        std::uint32_t sample, group;
    };

    explicit BroadPhase(Among among) : among_(among) {}

    /// Motion is widened by `margin` [m]. True where it has looked again.
    bool find(const ContactSurface& surface, const Targets& targets, const Motion& motion, double margin);
    /// By rising cluster of samples. None where those of a list that lives on are still farther apart than nodes go.
    std::span<const Candidate> candidates() const
    {
        return moved_ < apart_ ? std::span<const Candidate>() : candidates_;
    }
    /// Samples and targets are others.
    void clear()
    {
        *this = BroadPhase(among_);
        mayLive_ = false;
    }
    /// Where nodes were when it last looked: a run that goes on looks again when this one would.
    void save(const std::string& name, core::Archive& archive) const;
    void restoreFrom(const std::string& name, const core::Archive& archive, std::size_t nodes);
    std::size_t bytes() const { return candidates_.capacity() * sizeof(Candidate) + x_.capacity() * sizeof(Vec3); }

private:
    /// False where no two fragments come near each other: then there is no candidate, for as long as there may be.
    bool search(const ContactSurface& surface, const Targets& targets, const Motion& motion, double margin);

    Among among_;
    /// May what it finds next serve several steps? Not right after clear(): a body that tears is cut again in each.
    bool mayLive_ = true;
    double slack_ = 0;         // m; 0: its pairs are of one step only
    std::vector<Vec3> x_;      // m: where nodes were; empty without slack
    double moved_ = 0;         // m: that a node has gone from there, and goes on its way
    double apart_ = 0;         // m: that nodes can go before any two of its pairs meet; 0 without slack
    bool isRestored_ = false;  // the candidates are still to be found again
    std::vector<Candidate> candidates_;
};

}  // namespace vdbfrac::contact
