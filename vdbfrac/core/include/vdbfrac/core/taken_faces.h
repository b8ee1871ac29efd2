// What cracks of a run take of a body's outer surface, in a surface that is cut by all of them from the first frame on.
#pragma once

#include <vdbfrac/core/body.h>
#include <vdbfrac/core/drawing.h>
#include <vdbfrac/core/stages.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace vdbfrac::core {

/// When the material on both sides of faces that cracks take has moved apart, so that they would span what is open:
/// some of their corners get no arrival before.
class PartedFaces {
public:
    /// `drawn` has to live as long. dx: voxel size [m].
    PartedFaces(const tetmesh::DrawnTopology& drawn, double dx);
    /// To be called for all frames, counted from 0, the last first. `carried`: the surface's points as they are carried
    /// at the end of the run [m].
    void see(std::uint32_t frame, std::span<const Vec3> carried);
    bool hasAny() const { return !frame_.empty(); }
    /// The first frame in which a face spans a gap; kNever, the largest number, where it does in none.
    std::uint32_t frameOf(std::uint32_t face) const { return frame_[face - drawn_->taken[0]]; }

private:
    const tetmesh::DrawnTopology* drawn_;
    double dx_;
    std::vector<std::uint32_t> frame_;  // of each face that cracks have taken
};

/// Faces that are there until a crack comes to them, and lie in one point from then on. So they have points of their
/// own: one for all that go in the same frame.
class TakenFaces {
public:
    /// Of a body as Drawing::followWhole draws it at the end of a run. Between lips that are closed there are no faces
    /// where they meet. fps: frames a second.
    TakenFaces(const tetmesh::DrawnTopology& drawn, bool lipsClosed, const Stages& stages, const Body& body, double fps,
               const PartedFaces& parted);

    /// Gives a body as it is drawn in a frame, counted from 0, the faces' own points.
    void addTo(std::size_t frame, DrawnBody& drawn) const;
    /// Faces that are never there, as no crack is known to have come to them.
    std::size_t unknown() const { return unknown_; }

private:
    struct Point {
        std::uint32_t from = 0;   // the point of the surface that it lies on
        std::uint32_t frame = 0;  // from this one on it lies on `goesTo`
        std::uint32_t goesTo = 0;
    };

    std::vector<Point> points_;  // after those of the surface
    std::shared_ptr<const tetmesh::DrawnTopology> topology_;
    std::size_t unknown_ = 0;
};

}  // namespace vdbfrac::core
