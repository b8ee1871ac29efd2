// Items by group, and sorted lists without repetitions.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac {

/// Lists of items, one a group, one behind the other.
struct Groups {
    std::vector<std::uint32_t> start;  ///< of each group in `item`, and the end
    std::vector<std::uint32_t> item;

    std::span<const std::uint32_t> operator[](std::size_t group) const
    {
        return {item.data() + start[group], item.data() + start[group + 1]};
    }
    std::size_t bytes() const { return (start.capacity() + item.capacity()) * sizeof(std::uint32_t); }
};

/// Groups the items that `each(add)` lists by calling add(group, item), twice the same; within a group they stay in
/// order.
template <class Each>
Groups groupItems(std::size_t groups, const Each& each)
{
    Groups result;
    result.start.assign(groups + 1, 0);
    each([&](std::size_t group, std::uint32_t) { ++result.start[group + 1]; });
    for (std::size_t g = 0; g < groups; ++g) result.start[g + 1] += result.start[g];
    result.item.resize(result.start.back());
    std::vector<std::uint32_t> next(result.start.begin(), result.start.end() - 1);
    each([&](std::size_t group, std::uint32_t item) { result.item[next[group]++] = item; });
    return result;
}

/// Of each point the others of the faces that have it, as often as they share one. `eachFace(visit)` calls
/// visit(points of a face), twice the same.
template <class EachFace>
Groups pointsBeside(std::size_t points, const EachFace& eachFace)
{
    return groupItems(points, [&](const auto& add) {
        eachFace([&](std::span<const std::uint32_t> face) {
            for (std::size_t k = 0; k < face.size(); ++k)
                for (std::size_t d = 1; d < face.size(); ++d) add(face[k], face[(k + d) % face.size()]);
        });
    });
}

template <class T>
void sortUnique(std::vector<T>& values)
{
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
}

}  // namespace vdbfrac
