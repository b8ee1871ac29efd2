// The table [study] of a scene: what 'vdbfrac study' runs and measures. A simulation takes no notice of it.
#pragma once

#include <vdbfrac/scene/key.h>
#include <vdbfrac/scene/scene.h>

#include <optional>
#include <string>
#include <vector>

namespace vdbfrac::lab::study {

struct Spec {
    /// A key that changes along with that of its series.
    struct Tied {
        std::string key;
        std::vector<std::string> values;  ///< TOML texts, as many as the series has
    };
    /// Settings that differ in one key: a curve of error against cost.
    struct Series {
        std::string name;
        std::vector<std::string> set;  ///< "key=value", before the key is varied
        std::string key;
        std::vector<std::string> values;  ///< TOML texts, at least one
        std::vector<Tied> tied;
        std::string refines = "auto";  ///< "up", "down": which values are finer; "auto": those that take more work
        std::optional<double> order;   ///< of convergence, as expected
    };
    /// A number that is taken of each run. Which members have a meaning, the quantity says; `body` and `grip` are
    /// filled in where the quantity needs them.
    struct Measure {
        std::string name, quantity, body, grip, collider;
        std::optional<Vec3> point;   ///< m, at rest
        std::optional<Vec3> axis;    ///< of unit length
        std::optional<double> rest;  ///< m: the value that an oscillation is about
        /// m, of the standing wave along `axis`, 0 at `point`, that alone is looked at.
        std::optional<double> wavelength;
        std::optional<double> exact;  ///< the true value, in the unit of the quantity
        std::string source;           ///< of `exact`
        std::optional<double> scale;  ///< what errors are relative to, instead of the true value
        std::optional<double> order;  ///< of convergence, as expected in all series instead of theirs; 0: none is
    };
    std::string about;
    int rounds = 5;  ///< of timing
    std::vector<Series> series;
    std::vector<Measure> measures;
};

/// What the programs of this build read in a scene: that of the effects, [study] and [wedge].
scene::Vocabulary vocabulary();

/// Of a scene that was read with it; none without a table [study].
std::optional<Spec> specOf(const scene::Scene& scene);

/// As the scene has it.
scene::NamedValues tableOf(const Spec& spec);

}  // namespace vdbfrac::lab::study
