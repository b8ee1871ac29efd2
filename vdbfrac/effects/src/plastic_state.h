// What a body has flowed, and how it lasts. Not installed.
#pragma once

#include "plastic_law.h"

#include <vdbfrac/base/vec.h>
#include <vdbfrac/core/archive.h>
#include <vdbfrac/core/body.h>
#include <vdbfrac/core/stages.h>
#include <vdbfrac/solver/elastic_operator.h>
#include <vdbfrac/tetmesh/tet_field.h>

#include <vector>

namespace vdbfrac::effects {

/// Of each tet; empty until the body first flows.
struct PlasticState {
    tetmesh::TetField<Mat3> inverse;            ///< A: inverse of what it has flowed, symmetric
    tetmesh::TetField<double> strain, tension;  ///< a; W = sum of <s1> da [J/m^3]

    bool any() const { return inverse.elements() > 0; }
    void begin(std::size_t elements);
    void carry(const tetmesh::BodyMesh& mesh, const tetmesh::PreviousElements& previous);
    /// Each tet has what the tet of another mesh of the body has in which its middle lies.
    void take(const tetmesh::BodyMesh& mesh, const PlasticState& from, const tetmesh::BodyMesh& fromMesh);

    /// y of each element; where a tet of it has flowed as far as it can, it yields no more.
    std::vector<double> yieldStrains(const tetmesh::BodyMesh& mesh, const PlasticLaw& law) const;
    /// Of each tet; empty: none.
    std::vector<core::DrivingWork> drivingWork(const PlasticLaw& law) const;
};

void save(const PlasticState& state, const core::Body& body, core::Archive& archive);
/// What save wrote of a body of as many elements. Throws FileError.
PlasticState restoredPlasticState(const core::Archive& archive, const core::Body& body);

}  // namespace vdbfrac::effects
