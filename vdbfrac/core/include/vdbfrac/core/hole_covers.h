// Covers for what cracks of a run will take, in a surface that is cut by all of them from the first frame on.
#pragma once

#include <vdbfrac/core/body.h>
#include <vdbfrac/core/drawing.h>
#include <vdbfrac/core/stages.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace vdbfrac::core {

/// Faces of the outer surface across holes that lips which meet leave in it at rest. Each has points of its own, which
/// lie on the rim of its hole until the crack comes there, and all in one place from then on.
class HoleCovers {
public:
    /// Of a body as it is drawn at the end of a run. `isJoined`: of each point, does it lie on another lip at rest?
    HoleCovers(std::shared_ptr<const tetmesh::DrawnTopology> drawn, std::span<const std::uint8_t> isJoined,
               const Stages& stages, const Body& body);

    /// Adds the covers to a body as it is drawn at this time [s].
    void addTo(double time, DrawnBody& drawn) const;
    /// Holes without a cover: their rim does not come round, or no crack is known to have come there.
    std::size_t uncovered() const { return uncovered_; }

private:
    struct Cover {
        float arrival = 0;                                   // s: of the crack
        std::vector<std::uint32_t> rim;                      // points
        std::vector<tetmesh::RenderMesh::Corner> corner;     // of an outer face there, of each
        std::vector<std::array<std::uint32_t, 3>> triangle;  // of places in `rim`
    };
    void add(const Cover& cover, std::uint32_t like, tetmesh::DrawnTopology& drawn) const;

    std::vector<Cover> covers_;
    std::shared_ptr<const tetmesh::DrawnTopology> covered_;
    std::size_t uncovered_ = 0;
};

}  // namespace vdbfrac::core
