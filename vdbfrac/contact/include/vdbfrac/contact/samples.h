// Samples of the surface of one body.
#pragma once

#include <vdbfrac/contact/lips.h>
#include <vdbfrac/core/body.h>
#include <vdbfrac/tetmesh/embedded_surface.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace vdbfrac::contact {

/// A sample where faces meet, off a triangle of the cut.
struct Sharp {
    std::uint32_t sample = 0;
    std::array<std::uint32_t, 3> corner{};  // samples
    bool isStrained = false;
    tetmesh::EmbeddedPoint point{};  // where faces meet, in nodes of the system
};

/// Of one body, in its own nodes, or of all of them.
struct Samples {
    using Edge = std::array<std::uint32_t, 2>;
    std::vector<tetmesh::EmbeddedPoint> point;
    std::vector<double> area, reach;
    std::vector<AtRest> rest;
    std::vector<std::uint8_t> isTorn;  ///< on a lip
    std::vector<std::uint64_t> key;    ///< names the place at rest
    std::vector<Edge> edge;
    std::vector<Sharp> sharp;
    std::vector<Lip> lip;  ///< none: lips do not close

    std::size_t bytes() const;
};

/// Where the faces of a body met when it was first seen, and the cut takes that off.
struct SharpPlaces {
    std::vector<std::uint64_t> key;  ///< of the triangle of the cut
    std::vector<Vec3> at;            ///< at rest [m]
};
SharpPlaces sharpPlaces(const core::Body& body);

/// What samples are taken of.
struct Sampling {
    double gap = 0;           ///< m
    bool closesLips = false;  ///< of cracks
    bool keepsEdges = false;  ///< between samples
};

struct Resampled {
    Samples samples;
    std::vector<std::uint32_t> before;  ///< of each, what it was; KeyTable::kNone: there was none
};
/// Of the cut as it is, and at its sharp places. Reaches of samples that were there `before` are what they were where
/// nothing has torn beside them.
Resampled resample(const core::Body& body, const Sampling& sampling, const SharpPlaces& places, const Samples& before);

}  // namespace vdbfrac::contact
