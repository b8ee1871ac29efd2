// The bar that tests tear.
#pragma once

#include <sstream>
#include <string>

namespace vdbfrac::test {

/// A bar along y with a notch at its middle, between slabs of grips at y = +-.4 m that move apart.
struct NotchedBar {
    int frames = 8;
    double fps = 4, voxelSize = 0.1;
    std::string substeps = "\"auto\"";
    double length = 1, thickness = 0.4;  ///< m; what goes on beyond the grips is at rest
    std::string youngsModulus = "1e5", density = "1000";

    /// The scene as TOML; `rest`: its effects and output.
    std::string text(const std::string& rest) const
    {
        std::ostringstream s;
        s << "version = 1\nname = \"bar\"\n[time]\nframes = [1, " << frames << "]\nfps = " << fps
          << "\nsubsteps = " << substeps << "\n[grid]\nvoxel_size = " << voxelSize
          << "\n[[body]]\nname = \"bar\"\nshape = { box = { size = [0.4, " << length << ", " << thickness
          << "] } }\ncut = [{ cylinder = { axis = \"z\", radius = 0.1, center = [0.2, 0, 0] } }]\nmaterial = \"m\"\n"
          << "[material.m]\nyoungs_modulus = " << youngsModulus << "\npoisson_ratio = 0.3\ndensity = " << density
          << "\n";
        for (const char* side : {"", "-"})
            s << "[[grip]]\nbody = \"bar\"\nregion = { box = { size = [1, 0.1, 1], center = [0, " << side
              << "0.4, 0] } }\nmove = { velocity = [0, " << side << "0.1, 0] }\n";
        return s.str() + rest;
    }
};

inline const char* const kTear = "[damping]\nstiffness = 0.002\n[fracture]\ntoughness = 60\n";

}  // namespace vdbfrac::test
