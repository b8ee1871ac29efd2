// How points of a surface that is cut by all cracks of a run move before these have come.
//
// A point in the gap of a crack rides on what is left beside it, some way off: the skin would be creased where it is
// going to tear. Until then it rides in the tet that it lies in, which the crack takes or leaves to the other side.
#pragma once

#include <vdbfrac/core/ancestry.h>
#include <vdbfrac/core/body.h>
#include <vdbfrac/core/stages.h>
#include <vdbfrac/skin/skin.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::core {

class BeforeCracks {
public:
    /// A tet that cracks took on the way to a frame, counted from 0.
    struct Tet {
        std::array<Vec3, 4> X{};  ///< m, at rest: of its nodes
        std::uint32_t frame = 0;
    };

    /// `tets`: all that cracks took from a body during the run, the last taken first; `outside`: points of its surface
    /// that lie outside of the tets that carry them.
    BeforeCracks(std::span<const Tet> tets, std::span<const skin::OutsidePoint> outside, const Stages& stages,
                 const Body& body, double fps);

    /// Moves points to which no crack has come in a frame, counted from 0. `ofNodes`: positions [m] or velocities
    /// [m/s] of the nodes of the body, then of those of tets() that are there, four of each, in their order.
    void carry(std::size_t frame, std::span<const Vec3> ofNodes, std::span<Vec3> ofPoints) const;

    /// From this frame on these points go with what carries them at the end, whatever the time of arrival. Returns
    /// whether any did not.
    bool leave(std::size_t frame, std::span<const std::uint32_t> points);
    /// Of all points of the surface: does it move them in any frame?
    std::vector<std::uint8_t> moves(std::size_t points) const;

    /// Numbers of the tets that carry a point, rising.
    const std::vector<std::uint32_t>& tets() const { return used_; }

private:
    struct Point {
        std::uint32_t point = 0;
        std::uint32_t until = 0;  // the frame in which the crack has come
        tetmesh::EmbeddedPoint in;
    };
    std::vector<Point> points_;
    std::vector<std::uint32_t> used_;
};

}  // namespace vdbfrac::core
