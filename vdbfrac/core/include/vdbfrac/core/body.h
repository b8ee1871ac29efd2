// One body while it is simulated.
#pragma once

#include <vdbfrac/grid/level_set.h>
#include <vdbfrac/solver/material.h>
#include <vdbfrac/tetmesh/body_mesh.h>
#include <vdbfrac/tetmesh/fragments.h>

#include <cstdint>
#include <memory>
#include <string>

namespace vdbfrac::core {

struct Body {
    std::string name;
    solver::Material material;
    grid::LevelSet phi;
    std::unique_ptr<tetmesh::BodyMesh> mesh;
    tetmesh::FragmentTracker fragments;
    std::uint32_t firstNode = 0;     ///< of the system: node 0 of the mesh
    std::uint32_t firstElement = 0;  ///< of the system: element 0 of the mesh
    double startVolume = 0;          ///< m^3 of material at t = 0
    std::int64_t revision = 0;       ///< how often phi has changed
};

}  // namespace vdbfrac::core
