// The surfaces of all bodies as samples that can touch, and what each of them keeps from step to step.
#pragma once

#include <vdbfrac/core/archive.h>
#include <vdbfrac/core/body.h>
#include <vdbfrac/tetmesh/embedded_surface.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace vdbfrac::contact {

/// What a sample keeps from step to step.
struct TouchMemory {
    static constexpr double kUnseen = -1;
    double allowance = kUnseen;   ///< how deep it may be without being pushed [m]; unseen: nobody has looked yet
    Vec3 stretch = Vec3::Zero();  ///< elastic slip [m]
};

/// A sample is a point of the cut surface with a reach: it touches what is that near. Forces act where the cut has its
/// point, as tractions on the material do: farther out, at nodes that thin cut tets hardly hold, they would crush
/// those.
class TouchingSurface {
public:
    /// `gap`: m. The bodies have to live as long.
    void start(std::span<const core::Body> bodies, double gap);
    /// A body has been cut again. Samples where the surface was before keep their memory; nodes of the system are known
    /// again after settle().
    void recut(const core::Body& body);
    void settle();

    std::size_t size() const { return point_.size(); }
    const tetmesh::EmbeddedPoint& point(std::size_t i) const { return point_[i]; }  ///< in nodes of the system
    /// At rest [m^2]: a third of the triangles round it, added up as vectors.
    double area(std::size_t i) const { return area_[i]; }
    /// m: the gap that touching surfaces keep, where there is as much room at rest, and what the cut is off the
    /// surface.
    double reach(std::size_t i) const { return reach_[i]; }
    std::size_t body(std::size_t i) const { return body_[i]; }
    const Vec3& restPosition(std::size_t i) const { return rest_[i].at; }  ///< m
    const Vec3& restNormal(std::size_t i) const { return rest_[i].normal; }
    Vec3 at(std::size_t i, std::span<const Vec3> x) const { return point_[i].at(x); }
    TouchMemory& memory(std::size_t i) { return memory_[i]; }
    const TouchMemory& memory(std::size_t i) const { return memory_[i]; }

    /// gradient -= what a force [N] on each sample does at the nodes, added up by rising sample.
    void addForces(std::span<const Vec3> force, std::span<Vec3> gradient) const;

    void save(const std::string& name, core::Archive& archive) const;
    void restoreFrom(const std::string& name, const core::Archive& archive);
    std::size_t bytes() const;

private:
    struct AtRest {
        Vec3 at, normal;
    };
    /// The samples of one body, in its own nodes.
    struct Own {
        std::vector<tetmesh::EmbeddedPoint> point;
        std::vector<double> area, reach;
        std::vector<AtRest> rest;
        std::vector<std::uint64_t> key;  // names the place at rest
        std::size_t first = 0;           // of its samples among all
    };
    struct Share {
        std::uint32_t sample;
        double weight;
    };
    Own samplesOf(const core::Body& body) const;
    void collectShares(std::size_t nodes);

    std::span<const core::Body> bodies_;
    double gap_ = 0;
    std::vector<Own> own_;
    std::vector<TouchMemory> memory_;

    bool isSettled_ = false;
    std::vector<tetmesh::EmbeddedPoint> point_;
    std::vector<double> area_, reach_;
    std::vector<AtRest> rest_;
    std::vector<std::uint16_t> body_;
    std::vector<std::uint32_t> node_;   // those that samples depend on, rising
    std::vector<std::uint32_t> start_;  // of each of them in share_, and the end
    std::vector<Share> share_;
};

}  // namespace vdbfrac::contact
