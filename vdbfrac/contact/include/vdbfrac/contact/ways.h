// Where nodes go in a step, and how far, seen from what is common to all, or to those of a fragment.
#pragma once

#include <vdbfrac/core/body.h>

#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::contact {

/// x + dt v.
std::vector<Vec3> moved(std::span<const Vec3> x, std::span<const Vec3> v, double dt);

/// Where nodes go by themselves in `dt` [s], but no farther than `farthest` [m]; where they are for an infinite dt.
/// Seen from their mean velocity: what falls as a whole comes no nearer to itself. `fragment`: of each node, where it
/// is seen from that of its fragment alone.
std::vector<Vec3> ahead(std::span<const Vec3> x, std::span<const Vec3> v, double dt, double farthest,
                        std::span<const std::uint32_t> fragment = {});

/// Where they have gone, seen and cut off alike.
std::vector<Vec3> wayTo(std::span<const Vec3> x, std::span<const Vec3> to, double farthest,
                        std::span<const std::uint32_t> fragment = {});

/// Of nodes, from their places `from` to `to` [m].
struct Ways {
    std::span<const Vec3> from, to;
};

/// May two fragments come as near as `margin` [m] to each other on these ways? `fragment`: of each node.
bool mayMeet(const Ways& ways, std::span<const std::uint32_t> fragment, double margin);

/// Round the ways of nodes.
struct WayBoxes {
    std::vector<Vec3> low, high;  ///< m

    void set(std::span<const Vec3> from, std::span<const Vec3> to);
    void add(std::span<const Vec3> points);
    /// At most how far [m] points are outside of their boxes.
    double farthestBeside(std::span<const Vec3> points) const;
};

/// How far a node moves along an axis, at the most [m], seen from what is common to all.
double farthestMove(std::span<const Vec3> from, std::span<const Vec3> to);

/// What part of their ways fragments that may meet on them can go, seen from what is common to all, before one of their
/// nodes is `farthest` [m] away along an axis; infinite where none may meet, or none goes as far.
double partFollowed(std::span<const core::Body> bodies, std::span<const Vec3> from, std::span<const Vec3> to,
                    double farthest);

}  // namespace vdbfrac::contact
