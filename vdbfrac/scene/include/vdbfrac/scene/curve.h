// A factor that changes over time.
#pragma once

#include <vector>

namespace vdbfrac::scene {

/// Linear between its keys, held before the first and after the last.
struct Curve {
    struct Key {
        double time = 0;  ///< s
        double scale = 1;
        bool operator==(const Key&) const = default;
    };
    std::vector<Key> keys;  ///< times strictly rising; without any the factor is 1

    double at(double time) const;
    bool operator==(const Curve&) const = default;
};

}  // namespace vdbfrac::scene
