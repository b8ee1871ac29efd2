// Where the points of a surface are against colliders. Points are looked at in groups of neighbours: what is far from a
// ball round a group touches none of it, so that colliders cost what is near them.
#pragma once

#include "collider_contacts.h"
#include "collider_obstacles.h"

#include <vdbfrac/contact/edged_surface.h>
#include <vdbfrac/solver/backward_euler.h>
#include <vdbfrac/solver/potential.h>

#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::effects {

/// A surface among colliders. Both have to live as long.
class ColliderSearch {
public:
    ColliderSearch(const contact::EdgedSurface& surface, const Obstacles& obstacles)
        : surface_(surface), obstacles_(obstacles)
    {
    }
    /// Where nodes of a mesh are going, for a while. What lies on its surface is at most `outside` [m] farther than
    /// them, where it is not stretched.
    struct Outlook {
        std::span<const Vec3> x, v;  // m, m/s
        double time = 0;             // s
        double duration = 0;         // s
        double outside = 0;          // m
    };
    /// Could anything touch, at twice the speeds of now? Goes by the nodes: needs no samples.
    bool mayTouch(const Outlook& outlook, const Places& places) const;
    /// Could anything have touched on this way?
    bool mayHaveTouched(const solver::WholeStep& way, double outside) const;
    /// Points that are deeper than they may be, by rising point and collider. Adds to `pairs` how many points were
    /// compared with how many colliders.
    std::vector<ColliderContact> contacts(std::span<const Vec3> x, const Places& places, std::int64_t& pairs) const;
    struct Depth {
        double depth = 0;  // m; 0: it touches nothing
        std::size_t collider = 0;
    };
    /// How deep each point is in the collider in which it is deepest.
    std::vector<Depth> depths(std::span<const Vec3> x, const Places& places) const;
    /// How far each sample is from touching anything [m].
    std::vector<double> room(std::span<const Vec3> x, const Places& places) const;
    /// Has a step taken a sample to the other side of a collider?
    bool isAnyPassed(const solver::WholeStep& way) const;
    /// The highest rate at which a sample crosses half of a collider's thickness [1/s].
    double fastest(const solver::State& state, const Places& places, double time) const;

private:
    class Group;
    template <class Way>
    bool isAnyNear(std::span<const Vec3> x, const Places& places, double outside, const Way& way) const;
    template <class Visit>
    void eachGroup(std::size_t begin, std::size_t end, std::span<const Vec3> x, const Visit& visit) const;
    void addContacts(const Group& group, const Places& places, std::int64_t& pairs,
                     std::vector<ColliderContact>& all) const;
    void measureRoom(const Group& group, const Places& places, std::vector<double>& room) const;

    const contact::EdgedSurface& surface_;
    const Obstacles& obstacles_;
};

}  // namespace vdbfrac::effects
