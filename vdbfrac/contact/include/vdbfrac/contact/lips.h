// Lips of cracks: what has gone between two of them, and where it was.
#pragma once

#include <vdbfrac/core/body.h>
#include <vdbfrac/tetmesh/embedded_surface.h>

#include <span>
#include <vector>

namespace vdbfrac::contact {

/// A point on a lip. The direction to the other lip is that from a point deep below: the tets at a crack may be
/// crushed.
struct Lip {
    double gap = 0;                ///< m: to the other lip at rest; 0: it is on none
    tetmesh::EmbeddedPoint below;  ///< in nodes of the body
};

/// A point of a surface [m] and its normal.
struct AtRest {
    Vec3 at, normal;
};

/// Of points of a body's cut surface. A gap was material before the body tore, and is no wider than what a crack takes.
std::vector<Lip> lipsOf(const core::Body& body, std::span<const AtRest> points);

}  // namespace vdbfrac::contact
