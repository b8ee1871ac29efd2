// What cracks of a run take of a body's outer surface, in a surface that is cut by all of them from the first frame on.
#pragma once

#include <vdbfrac/base/by_voxel.h>
#include <vdbfrac/core/body.h>
#include <vdbfrac/core/drawing.h>
#include <vdbfrac/core/stages.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace vdbfrac::core {

/// Faces that would span what is open, as their corners go with pieces that have parted: arrivals tell when a crack has
/// come to a place, not when what is beside it has gone elsewhere.
class PartedFaces {
public:
    /// `drawn` and the mesh of the body have to live as long. `mayRide`: of each point, whether it goes with what
    /// cracks take in any frame.
    PartedFaces(const tetmesh::DrawnTopology& drawn, std::span<const std::uint8_t> mayRide, const Body& body);
    bool hasAny() const { return !skin_.empty() || !frame_.empty(); }
    /// Corners of faces that stay and are longer than the material beside them. `at`: of each point; `x`: of each node
    /// [m].
    std::vector<std::uint32_t> spanning(std::span<const Vec3> at, std::span<const Vec3> x) const;
    /// To be called for all frames in order.
    void seeTaken(std::uint32_t frame, std::span<const Vec3> at, std::span<const Vec3> x);
    /// The first frame in which a face that cracks take spans a gap; the largest number where it does in none.
    std::uint32_t frameOf(std::uint32_t face) const { return frame_[face - drawn_->taken[0]]; }

private:
    bool isLong(std::size_t face, std::span<const Vec3> at, std::span<const Vec3> x) const;
    double stretchAlong(const Vec3& A, const Vec3& B, std::span<const Vec3> x) const;

    const tetmesh::DrawnTopology* drawn_;
    const tetmesh::BodyMesh* mesh_;
    double dx_;                         // m
    ByVoxel elements_;                  // by their middles, in spacings of the mesh
    std::vector<std::uint32_t> skin_;   // faces that stay, with a point that may go with what does not
    std::vector<std::uint32_t> frame_;  // of each face that cracks take
};

/// Faces that are there until a crack comes to them, and lie in one point from then on: at first where they were, so
/// that motion blur sees them shrink on the spot, then in a point of what stays. So they have points of their own: one
/// for all that go in the same frame and voxel.
class TakenFaces {
public:
    /// Of a body as Drawing::followWhole draws it at the end of a run. Between lips that are closed there are no faces
    /// where they meet. fps: frames a second.
    TakenFaces(const tetmesh::DrawnTopology& drawn, bool lipsClosed, const Stages& stages, const Body& body, double fps,
               const PartedFaces& parted);

    /// Gives a body as it is drawn in a frame, counted from 0, the faces' own points. `before`: the body's other points
    /// in the frame before [m]; may be empty unless goesIn(frame).
    void addTo(std::size_t frame, std::span<const Vec3> before, DrawnBody& drawn) const;
    /// Does any face go in this frame?
    bool goesIn(std::size_t frame) const;
    /// Faces that are never there, as no crack is known to have come to them.
    std::size_t unknown() const { return unknown_; }

private:
    struct Point {
        std::uint32_t from = 0;   // the point of the surface that it lies on
        std::uint32_t frame = 0;  // in this one it lies where `patch` was, from then on on `goesTo`
        std::uint32_t patch = 0;
        std::uint32_t goesTo = 0;
    };

    std::vector<Point> points_;  // after those of the surface
    std::shared_ptr<const tetmesh::DrawnTopology> topology_;
    std::size_t unknown_ = 0;
};

}  // namespace vdbfrac::core
