// Looks for what may touch in a step: on the ways that nodes take by themselves, and where tries of the step take them.
#pragma once

#include <vdbfrac/contact/narrow_phase.h>

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace vdbfrac::contact {

class ContactSearch {
public:
    static constexpr double kFarthest = 8;  ///< cells that a node is followed in a step

    /// `h`: spacing of the lattice [m].
    explicit ContactSearch(double h) : h_(h) {}

    /// Looks within `dt` [s] from x, at the velocities v; what was found from there for a longer step serves too. Has
    /// it looked?
    bool look(ContactSurface& surface, const Targets& targets, std::span<const Vec3> x, std::span<const Vec3> v,
              double dt);
    /// Looks where a try has taken nodes: what was thrown or stopped is beside the way on which it was looked for. In a
    /// step it only sees more.
    void lookBeside(const ContactSurface& surface, const Targets& targets, std::span<const Vec3> x);

    const NarrowPhase& near() const { return near_; }
    std::span<const Vec3> start() const { return start_; }  ///< m: of all nodes, where the step begins
    std::span<const Vec3> ahead() const { return ahead_; }  ///< m: where they would go by themselves
    /// How often it has looked for what lies wide apart since this was asked last.
    std::int64_t takeSearches() { return std::exchange(searches_, 0); }

    void clear();
    void save(const std::string& name, core::Archive& archive) const { near_.save(name, archive); }
    void restoreFrom(const std::string& name, const core::Archive& archive, std::size_t nodes);
    std::size_t bytes() const
    {
        const std::size_t places = start_.capacity() + v_.capacity() + ahead_.capacity() + ownAhead_.capacity();
        return near_.bytes() + places * sizeof(Vec3);
    }

private:
    Motion motion() const { return beside_.low.empty() ? Motion{start_, ahead_} : beside_.motion(); }
    Motion ownMotion() const { return ownBeside_.low.empty() ? Motion{start_, ownAhead_} : ownBeside_.motion(); }

    double h_;
    double dt_ = 0;  // s: what it was last asked for, as v_
    std::vector<Vec3> start_, v_, ahead_;
    std::vector<Vec3> ownAhead_;      // m: as ahead_, seen from their fragments
    MotionBoxes beside_, ownBeside_;  // round these ways, and where tries took nodes; empty: nowhere else
    double foundFor_ = -1;            // s: how far ahead of start_ near_ looks; below 0: it looks elsewhere
    NarrowPhase near_;
    std::int64_t searches_ = 0;
};

}  // namespace vdbfrac::contact
