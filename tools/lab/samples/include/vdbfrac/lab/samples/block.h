// Solids made straight as phi or elements on nodes, without any file or OpenVDB.
#pragma once

#include <vdbfrac/solver/elastic_operator.h>
#include <vdbfrac/tetmesh/cut_mesh.h>

#include <functional>
#include <vector>

namespace vdbfrac::lab {

/// phi sampled on [lower, upper] grown by two layers, capped at +-3 dx.
tetmesh::NodeField<float> sample(Coord lower, Coord upper, double dx, const std::function<double(Vec3)>& phi);

/// A block of whole cells with a corner at the origin, without any level set (whose zero contour would round off the
/// edges): elements as CutMesh makes them deep inside the material, by patch of 8^3 cells.
struct Block {
    std::vector<tetmesh::CellElement> elements;
    std::vector<Coord> nodes;
    double h = 1;  ///< m

    Block(Coord cells, double spacing, tetmesh::Lattice::Kind kind = tetmesh::Lattice::Kind::six);

    std::vector<Vec3> restPositions() const;
    /// Rest positions bent, twisted and stretched by up to a fifth of an edge of 1 m: no tet is inverted, none is at
    /// rest.
    std::vector<Vec3> bentPositions() const;
};

/// The elements and nodes of a cut mesh.
Block asBlock(const tetmesh::CutMesh& mesh);

solver::ElasticOperator elasticOperator(const Block& block, const solver::Material& material,
                                        solver::Elasticity elasticity = solver::Volumetric::cell);
solver::ElasticOperator elasticOperator(const tetmesh::CutMesh& mesh, const solver::Material& material,
                                        solver::Elasticity elasticity = solver::Volumetric::cell);

std::vector<Mat3> diagonalBlocks(const solver::ElasticOperator& elastic, const solver::Tangent& tangent);

}  // namespace vdbfrac::lab
