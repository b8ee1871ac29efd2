#include "make_body_mesh.h"

#include <vdbfrac/base/number_text.h>
#include <vdbfrac/grid/body_level_set.h>
#include <vdbfrac/grid/crumbs.h>
#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/grid/phi_sampler.h>
#include <vdbfrac/mesher/delaunay.h>
#include <vdbfrac/tetmesh/cut_mesh.h>
#include <vdbfrac/tetmesh/cut_tet_mesh.h>
#include <vdbfrac/tetmesh/fragments.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace vdbfrac::core {

namespace {

/// Tets of edges near h round the material and half a voxel beyond it, so that phi > 0 at the boundary of the mesh;
/// larger ones, where the scene allows it, where phi says no more than that the surface is far.
tetmesh::TetMesh enclosingTets(const scene::Grid& grid, const grid::LevelSet& phi, std::uint64_t memoryLimit)
{
    constexpr double kMargin = 0.5;         // voxels
    constexpr double kBytesAPoint = 12000;  // of mesher, mesh and solver
    const double dx = phi.voxelSize(), size = mesher::kRadiusOfEdge * grid.coarsening * dx,
                 deep = -0.9 * phi.background();
    const auto sample = grid::phiSampler(phi);
    mesher::DelaunayCriteria criteria;
    criteria.facetSize = size;
    criteria.cellSize = size * grid.grading;
    criteria.maxPoints = std::max<std::size_t>(1, std::size_t(double(memoryLimit) / kBytesAPoint));
    if (grid.grading > 1)
        criteria.sizing = [=](const Vec3& X) { return sample(X) > deep ? size : size * grid.grading; };
    return mesher::delaunayMesh({[=](const Vec3& X) { return sample(X) - kMargin * dx; }, grid::materialBox(phi), {}},
                                criteria);
}

std::unique_ptr<tetmesh::BodyMesh> cutMesh(const scene::Grid& grid, const grid::LevelSet& phi,
                                           const tetmesh::RestShape& shape, std::uint64_t memoryLimit)
{
    using Kind = tetmesh::Lattice::Kind;
    if (grid.lattice == scene::LatticeKind::delaunay)
        return std::make_unique<tetmesh::CutTetMesh>(enclosingTets(grid, phi, memoryLimit),
                                                     grid.coarsening * grid.voxelSize, grid.voxelSize,
                                                     grid::sampleNodes(phi, memoryLimit), shape);
    const Kind kind = grid.lattice == scene::LatticeKind::six ? Kind::six : Kind::five;
    return std::make_unique<tetmesh::CutMesh>(tetmesh::Lattice{kind, grid.coarsening, grid.voxelSize, grid.wholeTets},
                                              grid::sampleNodes(phi, memoryLimit), shape);
}

/// Is a voxel node in a part of the mesh, on a lattice, with less material than crumbs may have?
class SmallParts {
public:
    /// `first`: id of the body's first fragment.
    SmallParts(const Body& body, std::uint32_t first)
        : edge_(int(std::lround(body.mesh->spacing() / body.mesh->voxelSize()))),
          isSmall_(body.mesh->phi().lower(), body.mesh->phi().upper(), false, false)
    {
        const double most = double(grid::kMostOfCrumb) * std::pow(body.mesh->voxelSize(), 3);
        std::vector<std::uint8_t> isSmall;
        for (const tetmesh::Fragment& f : body.fragments.fragments()) isSmall.push_back(f.restVolume < most);
        const std::span<const Coord> lattice = body.mesh->latticeCoords();
        std::vector<Coord> nodes;
        for (std::size_t n = 0; n < lattice.size(); ++n)
            if (isSmall[body.fragments.ofNode()[n] - first]) nodes.push_back(lattice[n]);
        isSmall_.cover(nodes);
        for (const Coord& c : nodes) isSmall_.set(c, true);
    }
    bool operator()(Coord c) const
    {
        const auto low = [&](int at) { return int(std::floor(double(at) / edge_)); };
        const auto high = [&](int at) { return int(std::ceil(double(at) / edge_)); };
        for (const int x : {low(c.x), high(c.x)})
            for (const int y : {low(c.y), high(c.y)})
                for (const int z : {low(c.z), high(c.z)})
                    if (isSmall_(Coord{x, y, z})) return true;
        return false;
    }

private:
    int edge_;  // voxels
    tetmesh::NodeField<bool> isSmall_;
};

}  // namespace

void makeBodyMesh(const scene::Grid& grid, const scene::Body& spec, std::uint64_t memoryLimit,
                  std::uint32_t& nextFragment, Body& body, std::vector<std::string>& notes)
{
    const std::uint32_t first = nextFragment;
    const auto make = [&] {
        nextFragment = first;
        body.mesh = cutMesh(grid, body.phi, grid::restShape(spec, body.phi), memoryLimit);
        body.fragments = tetmesh::FragmentTracker(*body.mesh, nextFragment);
    };
    make();
    if (nextFragment - first < 2) return;
    const double volume = body.mesh->volume();
    const std::size_t crumbs = grid::takeOutCrumbs(body.phi, body.mesh->phi(), SmallParts(body, first));
    if (crumbs == 0) return;
    make();
    notes.push_back("body '" + body.name + "': " + counted(crumbs, "crumb") + " of up to " +
                    std::to_string(grid::kMostOfCrumb) + " voxels, " +
                    shortNumber(100 * (1 - body.mesh->volume() / volume), 2) +
                    " % of its volume, left out: they hang on to it by less than a voxel; what is drawn has them");
}

}  // namespace vdbfrac::core
