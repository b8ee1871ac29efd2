// Chance that is the same everywhere.
#pragma once

#include <vdbfrac/base/vec.h>

#include <cmath>
#include <cstdint>
#include <random>

namespace vdbfrac::lab::verify {

/// Standard distributions differ from library to library, the generator does not. Nor may the order of throws: one in
/// an expression.
class Dice {
public:
    explicit Dice(std::uint64_t seed) : bits_(seed) {}
    double uniform(double low, double high) { return low + (high - low) * double(bits_() >> 11) * 0x1p-53; }
    double decades(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
    int below(int count) { return int(uniform(0, count)); }
    bool chance(double probability) { return uniform(0, 1) < probability; }
    Vec3 inBox(double half) { return {uniform(-half, half), uniform(-half, half), uniform(-half, half)}; }
    Vec3 direction() { return inBox(1).normalized(); }

private:
    std::mt19937_64 bits_;
};

}  // namespace vdbfrac::lab::verify
