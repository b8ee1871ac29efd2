// Parts of the outer surface that are fitted to rims which have moved. Not installed.
#pragma once

#include "skin_topology.h"

#include <vdbfrac/skin/skin_cut.h>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace vdbfrac::skin {

/// A place of the outer surface, and the sharp edge that it is on, or else a triangle.
struct PlaceOnSkin {
    std::uint32_t place = 0;
    bool isSmooth = false;
    std::uint32_t number = 0, triangle = 0;
    std::uint32_t given = 0;  ///< one of the points that lie there
    bool isCorner = false;    ///< sharp edges meet there, or the surface ends
    auto operator<=>(const PlaceOnSkin&) const = default;
};

/// The places of given points that parts have, as far as `isWanted`, rising.
std::vector<PlaceOnSkin> placesOf(const SkinTopology& skin, std::span<const SkinCut::Part> parts,
                                  const std::function<bool(std::uint32_t place)>& isWanted);

/// Gives parts copies of the given points that lie at these places, one of each, behind the points of the cut.
void copyGiven(const SkinTopology& skin, std::span<const PlaceOnSkin> places, std::vector<SkinCut::Part>& parts,
               std::vector<SkinCut::Point>& points);

/// Of the edges of parts, by the angles opposite to them.
enum class Weights {
    exact,    ///< at obtuse angles below 0: a point may be shifted by more than those round it
    positive  ///< no point is; obtuse angles count for next to nothing
};

/// A displacement [m] of points of the cut, at X [m], that is harmonic on parts where `isFree`, with that which is
/// given elsewhere, and none of given points: where rims come together, what is between them comes to lie there too.
/// Discretised with cotangents (Pinkall and Polthier 1993), which is exact where the displacement is linear. Where
/// needles leave rounding alone it stays as it is.
std::vector<Vec3> harmonic(const SkinTopology& skin, std::span<const SkinCut::Part> parts, std::span<const Vec3> X,
                           std::span<const std::uint8_t> isFree, std::vector<Vec3> shift, Weights weights);

/// Of a corner of a part or of a torn face [m].
const Vec3& placeOf(const SkinTopology& skin, std::span<const SkinCut::Point> points, std::uint32_t corner);

/// Twice the area [m^2] of a part that looks outward; below 0 of one that looks inward.
double outwardArea(const SkinTopology& skin, std::span<const SkinCut::Point> points, const SkinCut::Part& part);

/// Where lips have passed each other parts that look inward lie over others, which look outward. Takes the former out.
void dropInward(const SkinTopology& skin, std::span<const SkinCut::Point> points, std::vector<SkinCut::Part>& parts);

}  // namespace vdbfrac::skin
