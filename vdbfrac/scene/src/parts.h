// Inner tables of a scene: solids, files, motions.
#pragma once

#include "read_table.h"

#include <vdbfrac/scene/scene.h>

#include <filesystem>

namespace vdbfrac::scene {

struct Context {
    Complaints& complaints;
    std::filesystem::path folder;  ///< of the scene; relative paths start there
};

/// The text `mesh = "x.obj"`, short for `mesh = { file = "x.obj" }`, as that table; all else as it is.
Node asFileTable(const Node& node);

Primitive readSolid(const Item& item, Context& context);

/// A list of solids; `bounded` refuses endless ones.
std::vector<Primitive> readSolids(const Item& item, bool bounded, Context& context);

/// A bounded solid or a file.
decltype(Body::shape) readShape(const Item& item, Context& context);

/// Any solid or a file.
decltype(Collider::shape) readAnyShape(const Item& item, Context& context);

decltype(Grip::move) readMotion(const Item& item, Context& context);

Path readPath(const Item& item, Context& context);

}  // namespace vdbfrac::scene
