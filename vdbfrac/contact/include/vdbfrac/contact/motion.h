// Where nodes go in a step, and how far, seen from what is common to all, or to those of a fragment.
#pragma once

#include <vdbfrac/base/vec.h>

#include <Eigen/Geometry>

#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace vdbfrac::contact {

/// x + dt v.
std::vector<Vec3> moved(std::span<const Vec3> x, std::span<const Vec3> v, double dt);

/// Of all nodes, or of those of each fragment, where `fragment` has that of each node. Motion is seen from what is
/// common to them, whatever that is: every eighth has a say, and the first of a fragment.
class Means {
public:
    explicit Means(std::span<const Vec3> values, std::span<const std::uint32_t> fragment = {});
    const Vec3& operator()(std::size_t node) const { return mean_[fragment_.empty() ? 0 : fragment_[node]]; }

private:
    std::span<const std::uint32_t> fragment_;
    std::vector<Vec3> mean_;
};

/// Of nodes, from their places `from` to `to` [m].
struct Motion {
    std::span<const Vec3> from, to;
};

/// Round the ways of nodes.
struct MotionBoxes {
    std::vector<Vec3> low, high;  ///< m
    Motion motion() const { return {low, high}; }
};

/// Where nodes go, seen from the mean of all, or of those of their fragment: what falls as a whole comes no nearer to
/// itself. Their ways are cut off where they are longer than `farthest` [m].
class RelativeMotion {
public:
    /// By themselves in `dt` [s] from x, at the velocities v; nowhere for an infinite dt.
    static RelativeMotion ahead(std::span<const Vec3> x, std::span<const Vec3> v, double dt, double farthest,
                                std::span<const std::uint32_t> fragment = {});
    /// As they have gone from x.
    static RelativeMotion gone(std::span<const Vec3> x, std::span<const Vec3> to, double farthest,
                               std::span<const std::uint32_t> fragment = {});
    Vec3 operator()(std::size_t node) const
    {
        const Vec3 way = scale_ * (move_[node] - common_(node)) - startScale_ * (x_[node] - commonStart_(node));
        const double far = way.squaredNorm() / (farthest_ * farthest_);
        return x_[node] + (far > 1 ? Vec3(way / std::sqrt(far)) : way);
    }
    std::vector<Vec3> ends() const;
    /// At most how far [m] along an axis a node ends outside of the box round its way in `motion`.
    double farthestBeside(const Motion& motion) const;
    /// Round the ways in `motion` and its own ends.
    MotionBoxes boxesWith(const Motion& motion) const;

private:
    RelativeMotion(std::span<const Vec3> x, std::span<const Vec3> move, double scale, double startScale,
                   double farthest, Means common, Means commonStart)
        : x_(x),
          move_(move),
          scale_(scale),
          startScale_(startScale),
          farthest_(farthest),
          common_(std::move(common)),
          commonStart_(std::move(commonStart))
    {
    }
    std::span<const Vec3> x_, move_;  // velocities, or places
    double scale_, startScale_;
    double farthest_;
    Means common_, commonStart_;
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
