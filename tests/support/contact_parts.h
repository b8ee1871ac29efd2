// What contact makes of bodies, without a simulation round it.
#pragma once

#include <vdbfrac/contact/contact_surface.h>
#include <vdbfrac/contact/targets.h>
#include <vdbfrac/core/body.h>

#include <span>

namespace vdbfrac {

/// `depth`: below the surface in which samples are found [m]. The bodies have to live as long.
struct ContactParts {
    contact::ContactSurface surface;
    contact::Targets targets;

    ContactParts(std::span<const core::Body> bodies, double depth)
    {
        surface.start(bodies, 0);
        surface.settle();
        targets.set(bodies, depth);
    }
};

}  // namespace vdbfrac
