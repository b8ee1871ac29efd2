// Where nodes go in a step, and how far, seen from what is common to all, or to those of a fragment.
#pragma once

#include <vdbfrac/base/vec.h>

#include <Eigen/Geometry>

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace vdbfrac::contact {

/// x + dt v.
std::vector<Vec3> moved(std::span<const Vec3> x, std::span<const Vec3> v, double dt);

/// Of nodes, from their places `from` to `to` [m].
struct Motion {
    std::span<const Vec3> from, to;
};

/// Round the ways of nodes.
struct MotionBoxes {
    std::vector<Vec3> low, high;  ///< m
    Motion motion() const { return {low, high}; }
};

/// Where nodes go, seen from what is common to all: their mean motion; or to those of their fragment: its rigid motion.
/// What falls and spins as a whole comes no nearer to itself. Ways are cut off where they are longer than `farthest`
/// [m].
class RelativeMotion {
public:
    /// By themselves in `dt` [s] from x, at the velocities v; nowhere for an infinite dt. `fragment`: of each node, or
    /// none for all.
    static RelativeMotion ahead(std::span<const Vec3> x, std::span<const Vec3> v, double dt, double farthest,
                                std::span<const std::uint32_t> fragment = {});
    /// As they have gone from x.
    static RelativeMotion gone(std::span<const Vec3> x, std::span<const Vec3> to, double farthest,
                               std::span<const std::uint32_t> fragment = {});
    std::vector<Vec3> ways() const;
    std::vector<Vec3> ends() const;
    double farthestAlongAxis() const;  ///< m: that a node goes
    /// At most how far [m] along an axis a node ends outside of the box round its way in `motion`.
    double farthestBeside(const Motion& motion) const;
    /// Round the ways in `motion` and its own ends.
    MotionBoxes boxesWith(const Motion& motion) const;

private:
    /// From where motion is seen: by these means, and by what turns velocities or places back.
    struct Frame {
        Vec3 move, place;
        Mat3 turn;  // of velocities: the angular velocity, as an operator on places; of places: a rotation
    };
    RelativeMotion(std::span<const Vec3> x, std::span<const Vec3> move, double scale, bool isGone, double farthest,
                   std::span<const std::uint32_t> fragment);
    std::uint32_t frameOf(std::size_t node) const { return fragment_.empty() ? 0 : fragment_[node]; }
    /// visit(node, its way).
    template <class Visit>
    void eachWay(std::size_t begin, std::size_t end, const Visit& visit) const;

    std::span<const Vec3> x_, move_;  // velocities, or places
    double scale_, farthest_;
    bool isGone_;
    std::span<const std::uint32_t> fragment_;
    std::vector<Frame> frames_;  // of each fragment, or one for all
};

using Box = Eigen::AlignedBox3d;

inline Box wider(const Box& box, double margin)
{
    const Vec3 room = Vec3::Constant(margin);
    return {box.min() - room, box.max() + room};
}

/// Round the ways of some nodes, and `margin` [m] wider.
inline Box boxOf(std::span<const std::uint32_t> nodes, const Motion& motion, double margin)
{
    Box box;
    for (const std::uint32_t n : nodes) box.extend(motion.from[n]).extend(motion.to[n]);
    return wider(box, margin);
}

/// May two fragments come as near as `margin` [m] to each other on these ways? `fragment`: of each node.
bool mayMeet(const Motion& motion, std::span<const std::uint32_t> fragment, double margin);

/// How far a node moves along an axis, at the most [m], seen from what is common to all, or to its `fragment`.
double farthestMove(std::span<const Vec3> from, std::span<const Vec3> to, std::span<const std::uint32_t> fragment = {});

/// What part of their ways fragments that may meet on them can go, seen from what is common to all, before one of their
/// nodes is `farthest` [m] away along an axis; infinite where none may meet, or none goes as far.
double partFollowed(const Motion& motion, std::span<const std::uint32_t> fragment, double farthest);

}  // namespace vdbfrac::contact
