// Which of some items each item is nearest to, along links.
#pragma once

#include <vdbfrac/base/grouping.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace vdbfrac {

inline constexpr std::uint32_t kNoSource = std::numeric_limits<std::uint32_t>::max();

/// Of each item the source to which the fewest links lead, a source itself, kNoSource where none does. `links`: the
/// items that each is linked to, in both directions. A breadth-first search from all sources.
inline std::vector<std::uint32_t> nearestSources(const Groups& links, std::span<const std::uint8_t> isSource)
{
    std::vector<std::uint32_t> nearest(isSource.size(), kNoSource), reached;
    for (std::uint32_t i = 0; i < isSource.size(); ++i)
        if (isSource[i]) nearest[i] = i, reached.push_back(i);
    for (std::size_t r = 0; r < reached.size(); ++r)
        for (const std::uint32_t next : links[reached[r]])
            if (nearest[next] == kNoSource) nearest[next] = nearest[reached[r]], reached.push_back(next);
    return nearest;
}

}  // namespace vdbfrac
