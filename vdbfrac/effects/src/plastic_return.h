// How an element flows: its tets go back together to a smaller shear strain. Not installed.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/cell.h>

#include <array>
#include <cstddef>
#include <optional>

namespace vdbfrac::effects {

/// Of each tet of an element.
using OfTets = std::array<Mat3, tetmesh::kMaxTets>;

/// The elastic deformations F A of the tets of an element; their mean has a share of its shear energy.
struct ElasticTets {
    OfTets F;
    std::array<double, tetmesh::kMaxTets> part{};  ///< of the material; 0: none
    double meanStrain = 0;                         ///< share of the mean

    Mat3 mean() const;
    double shearStrain() const;                ///< n of all (solver::Yield)
    double dilation() const;                   ///< mean of tr e
    ElasticTets after(const OfTets& B) const;  ///< F A B
};

/// How an element goes back.
struct PlasticReturn {
    OfTets B;            ///< symmetric
    ElasticTets flowed;  ///< what is elastic after it
    double shearStrain;  ///< n of that
};

/// What takes n to `goal`, or as near to it as they get: back in the directions of shear, with
/// the volume; to all the same change of tr e, so that no tet is under pressure against the others. Of two ways the one
/// that gets nearer: each tet in its own directions, or all in those of their mean. Nothing where none lowers n, as
/// where all is nearly flat, or inverted.
std::optional<PlasticReturn> plasticReturn(const ElasticTets& tets, double goal);

/// The tr e nearest to `wanted` that is no farther from 0 than `largest`, on the way there from `now`, which is not
/// either.
double boundedDilation(double now, double wanted, double largest);

/// sqrt(A A^T): of all A Q with a rotation Q, which have the same energy, the one that is symmetric.
Mat3 symmetricFlow(const Mat3& A);

/// Has material with the inverse flow A, symmetric, been drawn out or squashed as far as a bar of `stretch` times its
/// length?
bool isSpent(const Mat3& A, double stretch);

/// The largest principal stress of F [Pa], 0 where none is positive; `left` of the shear modulus mu [Pa], bulk modulus
/// K [Pa].
double tensionOf(const Mat3& F, double left, double mu, double K);

}  // namespace vdbfrac::effects
