// Two blocks of gel, one of which comes down on the other.
#pragma once

#include <vdbfrac/core/simulation.h>

#include <Eigen/Geometry>

#include <string>

namespace vdbfrac::test {

inline constexpr double kDx = 0.05;  // m

/// Two blocks of 10 voxels, the upper one coming down; `more` tables.
inline std::string blocks(const std::string& more, const std::string& upper = "[0.1, 0.54, 0.03]",
                          const char* lattice = "six")
{
    return std::string(
               "version = 1\nname = \"blocks\"\n[time]\nframes = [1, 25]\n[grid]\nvoxel_size = 0.05\nlattice = \"") +
           lattice +
           "\"\n[solver]\nnewton_tolerance = 1e-5\n[material.gel]\nyoungs_modulus = 1e5\npoisson_ratio = 0.3\n"
           "density = 1000\n[[body]]\nname = \"lower\"\nmaterial = \"gel\"\nshape = { box = { size = [0.5, 0.5, 0.5] } "
           "}\n"
           "[[body]]\nname = \"upper\"\nmaterial = \"gel\"\nvelocity = [0.1, -1, 0]\n"
           "shape = { box = { size = [0.5, 0.5, 0.5], center = " +
           upper + " } }\n" + more;
}

struct Momentum {
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
    double size = 0;
};
inline Momentum momentumOf(const core::Simulation& s)
{
    Momentum m;
    for (std::size_t i = 0; i < s.x().size(); ++i) {
        const Vec3 p = s.elastic().mass()[i] * s.v()[i];
        m.linear += p, m.angular += s.x()[i].cross(p), m.size += p.norm();
    }
    return m;
}

}  // namespace vdbfrac::test
