// A value of every tet of a body, which goes along when the body is cut again.
#pragma once

#include <vdbfrac/tetmesh/body_mesh.h>

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace vdbfrac::tetmesh {

/// Plastic flow, damage, temperature: what a tet has been through. Tets without material hold the first value.
template <class T>
class TetField {
public:
    TetField() = default;
    explicit TetField(std::size_t elements, const T& first = {}) : first_(first), value_(tetEntry(elements, 0), first)
    {
    }

    std::size_t elements() const { return value_.size() / kMaxTets; }
    T& operator()(std::size_t element, std::size_t tet) { return value_[tetEntry(element, tet)]; }
    const T& operator()(std::size_t element, std::size_t tet) const { return value_[tetEntry(element, tet)]; }
    /// Of all tets, by tetEntry().
    std::span<const T> values() const { return value_; }
    std::span<T> values() { return value_; }

    /// After an update: each tet has the value of the one it was.
    void carry(const BodyMesh& mesh, const PreviousElements& previous);

private:
    T first_{};
    std::vector<T> value_;
};

template <class T>
void TetField<T>::carry(const BodyMesh& mesh, const PreviousElements& previous)
{
    std::vector<T> now(tetEntry(mesh.elements().size(), 0), first_);
    for (const PreviousElements::Kept& run : previous.kept)
        std::copy_n(value_.begin() + std::ptrdiff_t(tetEntry(run.old, 0)), tetEntry(run.count, 0),
                    now.begin() + std::ptrdiff_t(tetEntry(run.first, 0)));
    for (const PreviousElements::Recut& r : previous.recut)
        for (std::size_t t = 0; t < kMaxTets; ++t)
            if (mesh.elements()[r.element].fraction[t] > 0) now[tetEntry(r.element, t)] = value_[tetEntry(r.old[t], t)];
    value_ = std::move(now);
}

}  // namespace vdbfrac::tetmesh
