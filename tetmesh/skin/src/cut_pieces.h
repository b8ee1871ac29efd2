// Small pieces of what a cut leaves of a surface. Not installed.
#pragma once

#include "skin_topology.h"

#include <vdbfrac/skin/skin_cut.h>

#include <Eigen/Geometry>

#include <cstdint>
#include <utility>
#include <vector>

namespace vdbfrac::skin {

/// Pieces of torn faces, parts of the outer surface and, where they are small, triangles of it that are whole. A piece
/// has the number of one of its points.
class CutPieces {
public:
    /// small [m]: of larger pieces it is only known that they are, not where they end.
    CutPieces(const SkinTopology& skin, const SkinCut& cut, double small);

    /// Of a point, numbered as SkinCut::Part has them, that a torn face or a part has.
    std::uint32_t of(std::uint32_t point) const { return name_[number(point)]; }
    std::uint32_t ofCutPoint(std::size_t i) const { return name_[i]; }  ///< of SkinCut::points[i]
    bool isSmall(std::uint32_t piece) const { return size(piece) < small_; }
    double size(std::uint32_t piece) const { return box_[piece].sizes().maxCoeff(); }  ///< m; of the box round it
    std::size_t numbers() const { return name_.size(); }                               ///< all are less
    /// Whole triangles of small pieces, each with its piece.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> whole() const;

private:
    std::uint32_t number(std::uint32_t point) const;
    class Grower;

    const SkinTopology& skin_;
    double small_;
    std::uint32_t given_, points_;
    std::vector<std::uint32_t> corners_;  // of the outer surface that parts have, rising
    std::vector<std::uint32_t> name_;     // of each point of the cut and each of these corners: its piece
    std::vector<Eigen::AlignedBox3d> box_;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> whole_;  // triangle, and a number of its piece
};

}  // namespace vdbfrac::skin
