// Closed lips that touch are drawn on each other, not through each other. Not installed.
//
// Closed lips lie in the middle of the gap that a crack has made. Where that gap closes, the material of both sides
// goes on until it touches, and carries each lip past the other. There both are drawn in the middle between them, and
// the skin beside a rim goes along with it.
#pragma once

#include <vdbfrac/skin/opposite.h>

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/tetmesh/render_mesh.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::skin {

class TouchingLips {
public:
    /// `places`: of each of the first points a number that those with equal coordinates share; dx: voxel size [m].
    TouchingLips(const tetmesh::DrawnTopology& drawn, std::span<const std::uint32_t> places, double dx);

    /// Moves points [m] of lips that have passed each other, with velocities [m/s] to match.
    void part(std::span<Vec3> points, std::span<Vec3> velocity) const;

private:
    struct Move {
        Vec3 way = Vec3::Zero(), velocity = Vec3::Zero();
    };
    /// A point of the skin beside a rim.
    struct Beside {
        std::uint32_t point = 0, rim = 0;  // the latter in point_
        double share = 0;
    };
    std::vector<Vec3> normalsAt(std::span<const Vec3> points) const;
    /// Of one lip: between it and the other.
    struct Gap {
        Vec3 normal, between;
        double size = 0;  // m; below 0 where they have passed each other
        bool isFacing = false;
    };
    static Gap gapOf(const Opposite& lip, std::span<const Vec3> at, std::span<const Vec3> normal);
    Move moveOf(std::size_t lip, std::span<const Vec3> at, std::span<const Vec3> v, std::span<const Vec3> normal) const;
    std::vector<Move> movesOf(std::span<const Vec3> at, std::span<const Vec3> v) const;
    void addBeside(const tetmesh::DrawnTopology& drawn, std::span<const std::uint32_t> places,
                   std::span<const Opposite> rims);

    double dx_ = 0;
    // Points of torn faces, rising; below they go by their numbers in it.
    std::vector<std::uint32_t> point_;
    std::vector<std::array<std::uint32_t, 3>> torn_;
    Groups besidePoint_;  // of each point
    std::vector<Opposite> lips_;
    std::vector<double> past_;  // m: as far each lip is past the other at rest, at most 0
    std::vector<Beside> beside_;
};

}  // namespace vdbfrac::skin
