// A rod that is strained alike everywhere, with an energy that is known.
#pragma once

#include "scene_run.h"

#include <vdbfrac/tetmesh/node_field.h>

#include <cmath>
#include <map>
#include <sstream>
#include <string>

namespace vdbfrac::test {

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

    std::string text(const std::string& effects) const
    {
        std::ostringstream s;
        s.precision(17);
        s << "version = 1\nname = \"rod\"\n[time]\nframes = [1, 200]\nfps = " << 1 / frame << "\nsubsteps = ";
        if (substeps > 0)
            s << substeps;
        else
            s << "\"auto\"";
        s << "\n[grid]\nvoxel_size = " << dx
          << "\n[solver]\nintegrator = \"static\"\nnewton_tolerance = 1e-9\nlinear_tolerance = 1e-6\n"
          << "[[body]]\nname = \"rod\"\nmaterial = \"m\"\nshape = { " << shape
          << " }\n[material.m]\nyoungs_modulus = " << kE << "\npoisson_ratio = 0\ndensity = " << kDensity << "\n";
        for (const double side : {1., -1.})
            s << "[[grip]]\nbody = \"rod\"\nregion = { halfspace = { normal = [0, " << side
              << ", 0], offset = " << kFree << " } }\nmove.keys = [{ time = 0 }, { time = " << frame
              << ", translate = [0, " << side * strain / 2 << ", 0] }]\n";
        return s.str() + effects;
    }
};

/// phi [m] of a body, at the voxels where there is material.
inline std::map<Coord, double> materialPhi(const core::Body& body)
{
    std::map<Coord, double> values;
    const tetmesh::NodeField<float>& phi = body.mesh->phi();
    phi.forEachBlock([&](Coord low) {
        phi.forEachNode(low, [&](Coord c) {
            if (const float value = phi(c); value < 0) values.emplace(c, value);
        });
    });
    return values;
}

/// A field that an effect adds to the frames, of the first body.
inline grid::VoxelValues fieldOf(const SceneRun& run, const std::string& name)
{
    for (const core::FrameSource* source : run.simulation->stages().frames)
        for (const auto& field : source->fields())
            if (field.name == name) return std::get<grid::VoxelValues>(source->take(run.simulation->bodies()[0], name));
    return {};
}

}  // namespace vdbfrac::test
