// The way back: plain structs -> values by key, for writing.
#pragma once

#include <vdbfrac/scene/scene.h>

#include <map>
#include <string>

namespace vdbfrac::scene {

/// Everything of one table: values, and the TOML text of its parts by key.
struct Content {
    Values values;
    std::map<std::string, std::string> parts = {};
};

Content contentOfRoot(const Scene& scene);
Content contentOf(const Time& time);
Content contentOf(const Grid& grid);
Content contentOf(const Body& body);
Content contentOf(const Material& material);
Content contentOf(const Grip& grip);
Content contentOf(const Solver& solver);
Content contentOf(const Output& output);
Content contentOf(const Study& study);  ///< without its lists
Content contentOf(const Study::Series& series);
Content contentOf(const Study::Measure& measure);

/// "{ key = value, ... }" with the keys of the spec that the content has.
std::string inlineTable(const TableSpec& spec, const Content& content);

}  // namespace vdbfrac::scene
