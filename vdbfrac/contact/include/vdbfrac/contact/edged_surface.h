// Samples of surfaces with their sharp edges, and points between samples that have come so far apart that something
// narrow would pass.
#pragma once

#include <vdbfrac/contact/contact_surface.h>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace vdbfrac::contact {

/// A touching surface with more points, numbered after its samples: on edges that are stretched, as far apart as
/// samples are at rest. They keep nothing from step to step; what they may do is between what the ends of their edges
/// may.
class EdgedSurface : public ContactSurface {
public:
    EdgedSurface() { sampling_.keepsEdges = true; }
    /// Is a point of an edge between two samples, `length` [m] long, near anything?
    using IsNear = std::function<bool(std::uint32_t a, std::uint32_t b, double length)>;
    /// Chooses anew, where a step begins: on edges kLong times as long in x as at rest, and as `spacing` [m].
    void chooseOnEdges(std::span<const Vec3> x, double spacing, const IsNear& isNear);
    void leave() { onEdge_.clear(), ContactSurface::leave(); }
    /// Samples and points on edges.
    std::size_t points() const { return size() + onEdge_.size(); }
    bool isOnEdge(std::size_t i) const { return i >= size(); }

    // As those of samples, for all points.
    std::size_t body(std::size_t i) const { return ContactSurface::body(isOnEdge(i) ? onEdge_[i - size()].a : i); }
    Vec3 at(std::size_t i, std::span<const Vec3> x) const
    {
        return between(i, [&](std::size_t end) { return ContactSurface::at(end, x); });
    }
    double reach(std::size_t i) const
    {
        return between(i, [&](std::size_t end) { return ContactSurface::reach(end); });
    }
    double allowance(std::size_t i) const
    {
        return between(i, [&](std::size_t end) { return memory(end).allowance; });
    }
    /// m^2; of samples that at rest, of points on edges as stretched as they are.
    double area(std::size_t i) const { return isOnEdge(i) ? onEdge_[i - size()].area : ContactSurface::area(i); }
    /// Calls visit(sample, share) for the sample, or the ends of its edge.
    template <class Visit>
    void visitSamples(std::size_t i, const Visit& visit) const
    {
        if (!isOnEdge(i)) return visit(i, 1.);
        const OnEdge& p = onEdge_[i - size()];
        visit(std::size_t(p.a), 1 - p.s), visit(std::size_t(p.b), p.s);
    }
    void addForce(std::size_t i, const Vec3& force, std::span<Vec3> gradient) const
    {
        visitSamples(
            i, [&](std::size_t sample, double share) { ContactSurface::addForce(sample, share * force, gradient); });
    }
    void couple(std::size_t i, solver::Coupling& coupling) const;
    std::size_t bytes() const { return ContactSurface::bytes() + onEdge_.capacity() * sizeof(OnEdge); }

private:
    static constexpr double kLong = 1.5;
    struct OnEdge {
        std::uint32_t a, b;  // samples
        double s;            // 0 at a, 1 at b
        double area;
    };
    template <class Value>
    auto between(std::size_t i, const Value& value) const -> decltype(value(i))
    {
        if (!isOnEdge(i)) return value(i);
        const OnEdge& p = onEdge_[i - size()];
        return (1 - p.s) * value(p.a) + p.s * value(p.b);
    }
    std::vector<OnEdge> onEdge_;
};

}  // namespace vdbfrac::contact
