// The lips of cracks that are yet to come, in a surface that is cut by all cracks of a run.
//
// Either lip rides on its own side of the crack, and where material is stretched unevenly the sides carry them a little
// apart: a hairline would tell where it is going to tear.
#pragma once

#include <vdbfrac/core/body.h>
#include <vdbfrac/core/drawing.h>
#include <vdbfrac/core/stages.h>
#include <vdbfrac/skin/opposite.h>
#include <vdbfrac/tetmesh/render_mesh.h>

#include <cstdint>
#include <vector>

namespace vdbfrac::core {

class JoinedLips {
public:
    /// Of a body as it is drawn at the end of a run.
    JoinedLips(const tetmesh::DrawnTopology& drawn, const Stages& stages, const Body& body, double fps);

    /// Gives points that the crack has not come to in a frame, counted from 0, the mean of their displacement and that
    /// of the lip opposite, and of their velocities.
    void join(std::size_t frame, DrawnBody& drawn) const;

    /// Of each point: does it lie on another lip at rest?
    const std::vector<std::uint8_t>& isJoined() const { return isJoined_; }

private:
    std::vector<std::uint8_t> isJoined_;
    std::vector<skin::Opposite> lips_;
    std::vector<Vec3> gap_;             // m, of each: from its point to what is opposite, at rest
    std::vector<std::uint32_t> frame_;  // of each: that in which the crack has come; 0 where none is known to have
};

}  // namespace vdbfrac::core
