// The table [wedge] of a scene: settings that 'vdbfrac wedge' simulates side by side. A simulation takes no notice of
// it.
#pragma once

#include <vdbfrac/scene/key.h>
#include <vdbfrac/scene/scene.h>

#include <optional>
#include <string>
#include <vector>

namespace vdbfrac::lab::study {

struct WedgeSpec {
    struct Vary {
        std::string key;
        std::vector<std::string> values;  ///< TOML texts
        int count = 0;                    ///< 1, 2, ..., this in place of `values`
    };
    std::string about;
    std::string combine = "grid";  ///< every value with every other; "list": the first of each, the second of each, ...
    std::vector<Vary> vary;
};

/// Of the table [wedge].
const scene::TableSpec& wedgeTable();

/// Of a scene that was read with it; none without a table [wedge].
std::optional<WedgeSpec> wedgeOf(const scene::Scene& scene);

}  // namespace vdbfrac::lab::study
