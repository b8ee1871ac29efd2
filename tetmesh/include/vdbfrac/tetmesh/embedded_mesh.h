// Points that ride in the material while it deforms and is cut: the vertices of a render mesh, probes, samples.
#pragma once

#include <vdbfrac/tetmesh/body_mesh.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::tetmesh {

class EmbeddedMesh {
public:
    /// A tet; no element: the point has no material that carries it, from the start or because it has gone.
    struct Place {
        static constexpr std::uint32_t kNone = 0xffffffff;
        std::uint32_t element = kNone, tet = 0;
    };

    EmbeddedMesh() = default;
    /// Takes points X [m] of the rest configuration into the tets that they lie in.
    EmbeddedMesh(const BodyMesh& mesh, std::span<const Vec3> X);
    /// The same points where places() of another one, of an equal mesh, had them.
    EmbeddedMesh(const BodyMesh& mesh, std::span<const Vec3> X, std::vector<Place> places);

    std::size_t size() const { return point_.size(); }
    bool isLost(std::size_t point) const { return place_[point].element == Place::kNone; }
    std::size_t lost() const;
    /// In numbers of the body's nodes; of one that is not lost.
    const EmbeddedPoint& operator[](std::size_t point) const { return point_[point]; }
    const std::vector<Place>& places() const { return place_; }

    /// After an update of the mesh: each point stays in its tet, on the side of a crack where that tet has more
    /// material.
    void carry(const BodyMesh& mesh, const CutUpdate& update);
    /// Where the points are when the body's nodes are at x [m]. A point that is lost keeps what `at` says.
    void deform(std::span<const Vec3> x, std::span<Vec3> at) const;

private:
    std::vector<EmbeddedPoint> point_;
    std::vector<Place> place_;
};

}  // namespace vdbfrac::tetmesh
