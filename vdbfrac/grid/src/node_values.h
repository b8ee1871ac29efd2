// Values of some voxel nodes. Not installed.
#pragma once

#include <vdbfrac/tetmesh/node_field.h>

#include <span>
#include <utility>
#include <vector>

namespace vdbfrac::grid {

/// One behind the other, in the order in which their nodes came: of a NodeField's blocks large values would fill
/// little.
template <class T>
class NodeValues {
public:
    /// Of nodes within a box, both ends included.
    NodeValues(Coord lower, Coord upper) : number_(lower, upper, -1, -1) {}

    /// Adds nodes of the box that have no value yet.
    void add(std::span<const Coord> nodes)
    {
        number_.cover(nodes);
        for (std::size_t i = 0; i < nodes.size(); ++i) number_.set(nodes[i], std::int32_t(values_.size() + i));
        values_.resize(values_.size() + nodes.size());
    }

    /// Null for nodes without a value; valid until more are added.
    const T* find(Coord c) const
    {
        const std::int32_t n = number_(c);
        return n < 0 ? nullptr : &values_[std::size_t(n)];
    }
    T* find(Coord c) { return const_cast<T*>(std::as_const(*this).find(c)); }

    bool contains(Coord c) const { return number_.contains(c); }  ///< whether it is in the box
    std::size_t size() const { return values_.size(); }

private:
    tetmesh::NodeField<std::int32_t> number_;  // -1: none
    std::vector<T> values_;
};

}  // namespace vdbfrac::grid
