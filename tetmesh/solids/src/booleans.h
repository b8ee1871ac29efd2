// Booleans of closed surfaces. Not installed.
#pragma once

#include "solid_shapes.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace vdbfrac::solids {

/// Degrees: more than between the pieces of any round surface, less than of edges.
inline constexpr double kCrease = 40;

/// Triangles, and which they are parts of: edges between parts of different ones stay.
struct Parts {
    static constexpr std::uint32_t kNone = 0xffffffff;
    Triangles surface;
    std::vector<std::uint32_t> origin;  ///< of each triangle; kNone where it does not matter
};

/// Corefinement finds the last bits of points by where things lie in memory: these do not depend on them.
Vec3 rounded(const Vec3& X, double edge);

/// A surface united with others, without others again: closed ones, of triangles with edges near `edge` [m]. Its points
/// are rounded. By CGAL's corefinement, with exact predicates. None where one of them is not closed, not oriented
/// outwards or meets itself near the others, or where what is left is no 2-manifold.
std::optional<Parts> carved(const Parts& whole, std::span<const Triangles> add, std::span<const Triangles> cut,
                            double edge);

/// What became of the shells of a surface.
struct United {
    std::size_t shells = 0;      ///< that reach into others
    std::optional<Parts> parts;  ///< none where there are none such, or where they cannot be united
};
/// The shells of a surface, triangles that hang together by points. For those that reach into others what is said of
/// carved() holds; others stay as they are, closed or not.
United united(const Parts& whole, double edge);

}  // namespace vdbfrac::solids
