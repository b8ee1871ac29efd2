// A rod that is strained alike everywhere, with an energy that is known.
#pragma once

#include <vdbfrac/grid/vdb_file.h>
#include <vdbfrac/lab/scenes/scene_run.h>

#include <cmath>
#include <map>
#include <string>

namespace vdbfrac::lab {

/// A rod along y, a metre of it free between grips that reach round its ends (whose edges the level set rounds off).
/// They are moved apart by `strain` of that metre in the first frame and then stand still; steps are static and nu = 0,
/// so at the end of each frame the strain is the same everywhere between them, whatever the section.
struct Rod {
    static constexpr double kE = 1e6, kDensity = 1000;  // Pa, kg/m^3
    static constexpr double kFree = 0.5;                // m from the middle to either grip

    double dx = 1. / 16;  // m
    double strain = 0.02;
    double frame = 0.1;  // s
    int substeps = 1;    // 0: auto
    // Faces a quarter of a voxel outside of nodes, at 1/16.
    std::string shape = "box = { size = [0.28125, 1.5, 0.28125] }";

    double energy() const { return 0.5 * kE * strain * strain; }                   // J/m^3
    double rayleighSpeed() const { return 0.862 * std::sqrt(kE / 2 / kDensity); }  // m/s, of nu = 0 (docs/physics.md)

    /// The scene as TOML; `effects` at its end.
    std::string text(const std::string& effects) const;
};

/// phi [m] of a body, at the voxels where there is material.
std::map<Coord, double> materialPhi(const core::Body& body);

/// A field that an effect adds to the frames, of the first body.
grid::VoxelValues fieldOf(const SceneRun& run, const std::string& name);

}  // namespace vdbfrac::lab
