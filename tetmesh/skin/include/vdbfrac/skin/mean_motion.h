// Points outside of the material go along with all of it that is near and on their side of the cracks.
//
// A point that one tet carries swings with it; at the edge of a crack tets hang by a corner, or are crushed or
// inverted, and the skin gets spikes. So, from a little way outside on, a point is carried by the mean of the affine
// motions of the tets round it. Affine motions stay exact.
#pragma once

#include <vdbfrac/skin/riders.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace vdbfrac::skin {

struct Carrier;

class MeanMotion {
public:
    struct Point {
        std::uint32_t rider = 0;
        Vec3 X = Vec3::Zero();  ///< m, at rest
        double distance = 0;    ///< m: how far it is outside
        double share = 0;       ///< of the mean motion in that of the point; the rest is that of its tet
    };

    MeanMotion() = default;
    /// Of those riders that are outside of their tets. The arguments are as for embedRiders, which gave `embedded`.
    MeanMotion(const tetmesh::BodyMesh& body, const CrackField& cracks, std::span<const Rider> riders,
               const Embedded& embedded, const FragmentAt& fragment, std::span<const std::uint32_t> fragmentOfNode);

    /// Evens out the motions of points that edges join, where these have little in common: at the front of a crack,
    /// where one lip goes over into the other, and where a point was taken for one of the other lip. `edges`: pairs of
    /// points(), those of an edge once or in both orders.
    void evenOut(std::vector<std::array<std::uint32_t, 2>> edges);

    std::span<const Point> points() const { return points_; }  ///< riders rise
    /// At each of points(), from the positions [m] or velocities [m/s] of all nodes of the body.
    std::vector<Vec3> at(std::span<const Vec3> ofNodes) const;

private:
    struct Term {
        std::uint32_t node = 0;
        double weight = 0;
        Vec3 gradient = Vec3::Zero();  // of the weight [1/m]
    };
    /// The mean motion round a voxel node: a sum over nodes of the body.
    struct Round {
        Vec3 X = Vec3::Zero();  // of the voxel node [m]
        std::vector<Term> terms;
        double volume = 0;                  // of the material there [voxels]
        std::optional<std::uint32_t> side;  // its fragment, where that has to be asked
    };
    struct Part {
        std::uint32_t round = 0;
        double weight = 0;  // of a point they add up to 1
    };
    using Parts = std::vector<Part>;  // rounds rise
    static Round round(const Carrier& carrier, Coord voxel);
    void weigh(Point& point, Parts& parts, double dx) const;
    static double common(const Parts& a, const Parts& b);
    Parts mixed(std::uint32_t point, std::span<const std::uint32_t> beside) const;

    std::vector<Point> points_;
    std::vector<Parts> parts_;  // of each point; none where no material is near
    std::vector<Round> rounds_;
};

}  // namespace vdbfrac::skin
