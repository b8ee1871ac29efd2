// Values at points, found again near a point. Not installed.
#pragma once

#include <vdbfrac/base/vec.h>

#include <cmath>
#include <map>
#include <vector>

namespace vdbfrac::contact {

/// In cells as wide as they are looked for far off.
template <class T>
class NearPoints {
public:
    explicit NearPoints(double width) : width_(width) {}

    void add(const Vec3& at, const T& value) { cells_[cellOf(at)].push_back(value); }
    /// Makes the cells in which visitNear() will look; isOpen() then tells what is worth adding.
    void openNear(const Vec3& at)
    {
        visitCells(at, [&](const Coord& cell) { cells_[cell]; });
    }
    bool isOpen(const Vec3& at) const { return cells_.contains(cellOf(at)); }
    /// Calls visit(value) for all within the width of a point, and for more; cell by cell, as they were added.
    template <class Visit>
    void visitNear(const Vec3& at, const Visit& visit) const
    {
        visitCells(at, [&](const Coord& c) {
            if (const auto cell = cells_.find(c); cell != cells_.end())
                for (const T& value : cell->second) visit(value);
        });
    }

private:
    Coord cellOf(const Vec3& at) const
    {
        const Vec3 c = at / width_;
        return {int(std::floor(c.x())), int(std::floor(c.y())), int(std::floor(c.z()))};
    }
    void visitCells(const Vec3& at, const auto& visit) const
    {
        const Coord cell = cellOf(at);
        for (int k = 0; k < 27; ++k) visit(cell + Coord{k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1});
    }

    double width_;
    std::map<Coord, std::vector<T>> cells_;
};

}  // namespace vdbfrac::contact
