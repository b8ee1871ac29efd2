// How the tets of an element flow: back to a smaller shear strain. Not installed.
#pragma once

#include <vdbfrac/base/vec.h>

#include <optional>

namespace vdbfrac::effects {

/// Stretches of a tet, from what they are to what is left of them, with the same axes and rotation.
struct PlasticReturn {
    Mat3 axes;
    Vec3 from, to;

    double dilation() const { return to.sum() - from.sum(); }  ///< change of tr e, e as in corotational elasticity
    /// Adds to all alike, which leaves dev e as it is.
    void dilate(double traces) { to.array() += traces / 3; }
    /// B with F B as it goes back.
    Mat3 flow() const;
};

/// To the shear strain |dev e| of F times `left`, in [0, 1], with its volume. Nothing where F is nearly flat, or
/// inverted: there is no log of its stretches.
std::optional<PlasticReturn> plasticReturn(const Mat3& F, double left);

/// Of all changes of tr e with less than `largest` [1] in the end, the one that is nearest to `change`: by how much
/// that is less. `now`: tr e.
double lessDilation(double now, double change, double largest);

/// sqrt(A A^T): of all A Q with a rotation Q, which have the same energy, the one that is symmetric.
Mat3 symmetricFlow(const Mat3& A);

/// Has material with the inverse flow A, symmetric, been drawn out or squashed as far as a bar of `stretch` times its
/// length?
bool isSpent(const Mat3& A, double stretch);

/// The largest principal stress of F [Pa], 0 where none is positive; `left` of the shear modulus mu [Pa], bulk modulus
/// K [Pa].
double tensionOf(const Mat3& F, double left, double mu, double K);

}  // namespace vdbfrac::effects
