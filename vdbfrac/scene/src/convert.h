// One value of the document as the type its key asks for.
#pragma once

#include "document.h"

#include <vdbfrac/scene/key.h>

#include <optional>
#include <string>

namespace vdbfrac::scene {

struct Conversion {
    std::optional<Values::Value> value;  ///< empty: the node is not what the key takes
    const Node* culprit = nullptr;       ///< the wrong element, where the node is a list
    std::string hint = {};
};

Conversion convert(const Node& node, const Key& key);

}  // namespace vdbfrac::scene
