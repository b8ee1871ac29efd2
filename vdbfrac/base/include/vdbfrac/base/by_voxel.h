// Things found by the voxels that they are in.
#pragma once

#include <vdbfrac/base/vec.h>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace vdbfrac {

/// Calls visit(voxel) for each from `low` to `high`, x fastest.
template <class Visit>
void forVoxelsOf(Coord low, Coord high, const Visit& visit)
{
    for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y)
            for (int x = low.x; x <= high.x; ++x) visit(Coord{x, y, z});
}

class ByVoxel {
public:
    void add(Coord voxel, std::uint32_t thing) { entries_.emplace_back(voxel, thing); }
    void sort() { std::sort(entries_.begin(), entries_.end()); }  ///< before the first visit

    /// Calls visit(thing) for those in each voxel of a box; what is in several comes as often.
    template <class Visit>
    void visit(Coord low, Coord high, const Visit& visit) const
    {
        forVoxelsOf(low, high, [&](Coord voxel) {
            auto at = std::lower_bound(entries_.begin(), entries_.end(), std::pair{voxel, std::uint32_t(0)});
            for (; at != entries_.end() && at->first == voxel; ++at) visit(at->second);
        });
    }

private:
    std::vector<std::pair<Coord, std::uint32_t>> entries_;
};

}  // namespace vdbfrac
