// Smooth noise in space, from numbers that are the same on every machine.
#pragma once

#include <vdbfrac/base/vec.h>

#include <cstdint>

namespace vdbfrac::tetmesh {

/// Well mixed bits of a number (the finalizer of SplitMix64: Steele et al. 2014).
std::uint64_t mixedBits(std::uint64_t z);

/// In [-1, 1], mostly within .5 of 0; changes over a length of 1, and has two derivatives. Source: value noise, with
/// Perlin's fade of 2002.
double noise(const Vec3& X, std::uint64_t seed);

}  // namespace vdbfrac::tetmesh
