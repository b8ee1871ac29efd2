#include <vdbfrac/lab/scenes/rod.h>

#include <vdbfrac/tetmesh/node_field.h>

#include <sstream>

namespace vdbfrac::lab {

std::string Rod::text(const std::string& effects) const
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
        s << "[[grip]]\nbody = \"rod\"\nregion = { halfspace = { normal = [0, " << side << ", 0], offset = " << kFree
          << " } }\nmove.keys = [{ time = 0 }, { time = " << frame << ", translate = [0, " << side * strain / 2
          << ", 0] }]\n";
    return s.str() + effects;
}

std::map<Coord, double> materialPhi(const core::Body& body)
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

grid::VoxelValues fieldOf(const SceneRun& run, const std::string& name)
{
    for (const core::FrameSource* source : run.simulation.stages().frames)
        for (const auto& field : source->fields())
            if (field.name == name) return std::get<grid::VoxelValues>(source->take(run.simulation.bodies()[0], name));
    return {};
}

}  // namespace vdbfrac::lab
