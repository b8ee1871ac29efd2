// A block on a floor, for tests of colliders.
#pragma once

#include <vdbfrac/lab/scenes/scene_run.h>

#include <cmath>
#include <span>
#include <string>

namespace vdbfrac::test {

inline constexpr double kG = 9.81, kE = 1e5, kDensity = 1000;  // m/s^2, Pa, kg/m^3

inline std::string number(double v) { return std::to_string(v); }
inline std::string vector(const Vec3& v)
{
    return "[" + number(v.x()) + ", " + number(v.y()) + ", " + number(v.z()) + "]";
}

/// A block at rest on y = 0, 8 voxels wide and 4 high, faces on planes of nodes.
struct Sled {
    static constexpr double kDx = 0.05, kHeight = 0.2;  // m: voxels unless told otherwise
    Vec3 gravity{0, -kG, 0};
    double start = 0;  // m/s along x
    double friction = 0.3;
    double lift = 0;  // m
    double youngsModulus = kE;
    int fps = 24, frames = 48;
    double voxel = kDx;  // m
    std::string move = {}, lattice = "six", solver = {}, more = {};
    double poissonRatio = 0;

    std::string text() const
    {
        return "version = 1\nname = \"sled\"\n[time]\nframes = [1, " + std::to_string(frames + 1) +
               "]\nfps = " + std::to_string(fps) + "\nsubsteps = 1\n[grid]\nvoxel_size = " + number(voxel) +
               "\nlattice = \"" + lattice + "\"\n[solver]\n" + solver +
               "newton_tolerance = 1e-7\nlinear_tolerance = 1e-6\n[[body]]\nname = \"block\"\n"
               "material = \"gel\"\nshape = { box = { size = [0.4, 0.2, 0.4], center = [0, " +
               number(kHeight / 2 + lift) + ", 0] } }\nvelocity = [" + number(start) +
               ", 0, 0]\n[material.gel]\nyoungs_modulus = " + number(youngsModulus) +
               "\npoisson_ratio = " + number(poissonRatio) +
               "\ndensity = 1000\n[gravity]\nacceleration = " + vector(gravity) +
               "\n[[collider]]\nname = \"floor\"\nshape = { halfspace = { normal = [0, -1, 0] } }\nfriction = " +
               number(friction) + "\n" + (move.empty() ? "" : "move = " + move + "\n") + more;
    }
};

inline Vec3 mean(const core::Simulation& s, std::span<const Vec3> of)
{
    Vec3 sum = Vec3::Zero();
    double total = 0;
    for (std::size_t i = 0; i < of.size(); ++i) sum += s.elastic().mass()[i] * of[i], total += s.elastic().mass()[i];
    return sum / total;
}
inline Vec3 velocity(const core::Simulation& s) { return mean(s, s.v()); }

/// Gravity on a slope, in the frame of the slope.
inline Vec3 onSlope(double angle) { return kG * Vec3(std::sin(angle), -std::cos(angle), 0); }

}  // namespace vdbfrac::test
