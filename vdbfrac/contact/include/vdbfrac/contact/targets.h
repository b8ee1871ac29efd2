// Tets near the surface, in which samples are found.
#pragma once

#include <vdbfrac/core/body.h>
#include <vdbfrac/tetmesh/phi_tets.h>

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace vdbfrac::contact {

/// A part of a tet near the surface, in nodes of the system.
struct Target {
    std::array<std::uint32_t, 4> node{};
    std::array<float, 4> phi{};  ///< at these nodes [m]
    float restVolume = 0;        ///< of the whole tet, times six [m^3]
    std::uint32_t inside = 0;    ///< into Targets::inside
    std::uint32_t fragment = 0;
    std::uint16_t body = 0;
};

/// Where a point is, as a target sees it: linear all over space.
struct InTarget {
    std::array<double, 4> share{};  ///< barycentric in the whole tet
    /// m: as at rest. Infinity: the tet is flat or turned over, and sees nothing.
    double phi = std::numeric_limits<double>::infinity();
    Vec3 outward = Vec3::Zero();  ///< gradient of phi in space
};

/// All targets of a scene.
class Targets {
public:
    void set(std::span<const core::Body> bodies, double depth);

    std::size_t size() const { return target_.size(); }
    const Target& operator[](std::size_t i) const { return target_[i]; }
    /// Those of one element, one after another.
    struct Group {
        std::uint32_t first = 0, end = 0, fragment = 0;
        std::uint16_t nodes = 0;
        std::array<std::uint32_t, tetmesh::kCorners> node{};  ///< all that its targets have
        std::span<const std::uint32_t> nodesOfTargets() const { return std::span(node).first(nodes); }
        float size = 0;  ///< m: of its tets, and no less than what is typical of the body
        /// m: its middle at rest, and where out is there (unit length).
        Eigen::Vector3f X = Eigen::Vector3f::Zero(), outward = Eigen::Vector3f::Zero();
    };
    const std::vector<Group>& groups() const { return group_; }
    double spacing() const { return spacing_; }  ///< m: a typical size
    InTarget locate(std::size_t target, const Vec3& y, std::span<const Vec3> x) const;
    /// The least of the barycentric coordinates of y in the part of the tet: it is inside from 0 on. What is farther
    /// outside than `reach` may be told as -infinity; so is what a tet that is nearly flat would see.
    double leastShare(std::size_t target, const Vec3& y, double reach, std::span<const Vec3> x) const;
    /// Does it see nothing, flat or turned over as it is?
    bool isBlind(std::size_t target, std::span<const Vec3> x) const;
    std::size_t bytes() const;

private:
    void add(const core::Body& body, std::uint16_t number, double depth);

    std::vector<Target> target_;
    std::vector<Group> group_;
    std::vector<tetmesh::TetMatrix> inside_;
    double spacing_ = 0;
};

}  // namespace vdbfrac::contact
