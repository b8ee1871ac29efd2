// One element in plain scalar form: its deformation and its energy.
#pragma once

#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/vec.h>
#include <vdbfrac/solver/elastic_operator.h>
#include <vdbfrac/tetmesh/element_forces.h>

#include <array>
#include <cstddef>
#include <span>

namespace vdbfrac::solver {

/// An element of a body, and what its tets are made of.
struct ElementOf {
    const tetmesh::CellElement& element;
    const tetmesh::TetGradients* gradients;  ///< of a tet of any shape; else not read
    double h;                                ///< lattice spacing [m]
    const Mat3* inverseFlow = nullptr;       ///< of each of its tets (ElementSet); null: none
    const float* stiffness = nullptr;        ///< of each of its tets; null: 1
    double yieldStrain = kInfinity;          ///< y (Yield); of elasticEnergy alone
    double yieldShare = 1;                   ///< c
};

/// Deformation gradient of tet t, of its elastic part if it has flowed: F Fp^-1; x [m]: of the body's nodes.
Mat3 deformationGradient(const ElementOf& e, std::size_t tet, std::span<const Vec3> x);

/// Stress [Pa] of each tet with material in the frame of the rest configuration, 2 mu e + lambda tr(e) I: with the
/// means of the element where the elasticity has them. Of the others nothing is set.
std::array<Mat3, tetmesh::kMaxTets> elementStress(const ElementOf& e, std::span<const Vec3> x, const Material& material,
                                                  Elasticity elasticity);

/// Of the tets with material; with the means of the element where the elasticity has them. Elastic forces are the
/// gradient of elasticEnergy by x, material forces that by the rest positions of the corners, with the share of
/// material in each tet and what has flowed taken along.
tetmesh::ElementForces elementForces(const ElementOf& e, std::span<const Vec3> x, const Material& material,
                                     Elasticity elasticity);

/// Elastic energy [J], as ElasticOperator has it.
double elasticEnergy(const ElementOf& e, std::span<const Vec3> x, const Material& material, Elasticity elasticity);

}  // namespace vdbfrac::solver
