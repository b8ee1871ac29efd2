// Samples that go to and fro between two targets.
#pragma once

#include <vdbfrac/contact/narrow_phase.h>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace vdbfrac::contact {

/// At an edge of a coarse surface two targets can push a sample into each other, time and again: from step to step, and
/// within a solve from one solution to the next. Where it would go back to that which it has just come from, it is held
/// by the one that it is in; but not by one that lets it sink into the other without a push.
class Trembling {
public:
    Trembling() = default;
    /// Holds `held`, by rising sample, to begin with.
    explicit Trembling(std::span<const Pair> held) : held_(held.begin(), held.end()) {}

    /// What would be taken next, at nodes x [m]: does anything go back? Then that is held from now on, or where it goes
    /// back to, if it is deeper there by more than `hidden` [m].
    bool look(std::span<const Pair> seen, const ContactSurface& surface, const Targets& targets,
              std::span<const Vec3> x, double hidden);
    /// By rising sample: as seenAt() takes them.
    std::span<const Pair> held() const { return held_; }
    /// What was taken, by rising sample, then fragment. What a sample has left is held no more.
    void keep(std::span<const Pair> pairs);
    void clear() { *this = {}; }

    void save(const std::string& name, core::Archive& archive) const;
    void restoreFrom(const std::string& name, const core::Archive& archive, std::size_t samples, std::size_t targets);
    std::size_t bytes() const;

private:
    std::vector<Pair> last_, older_;  // what was taken last, and before that
    std::vector<Pair> held_;
};

}  // namespace vdbfrac::contact
