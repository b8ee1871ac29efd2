// How much of each tet belongs to each voxel node. Not installed.
#pragma once

#include <vdbfrac/base/vec.h>
#include <vdbfrac/tetmesh/node_field.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::tetmesh {

/// Integrals of the trilinear function of each voxel node over each tet, in units of a voxel: by sub-tets of equal
/// volume, none wider than half a voxel as long as kMaxParts allows, at their centroids.
class NodalWeights {
public:
    NodalWeights(std::span<const Vec3> points, std::span<const std::array<std::uint32_t, 4>> tets, double voxelSize);

    struct Weight {
        std::uint32_t tet = 0;
        float volume = 0;
    };
    /// Of the tets round a voxel node, by rising tet.
    std::span<const Weight> at(Coord voxel) const
    {
        const std::int32_t i = number_(voxel);
        return i < 0 ? std::span<const Weight>()
                     : std::span(weights_).subspan(start_[std::size_t(i)],
                                                   start_[std::size_t(i) + 1] - start_[std::size_t(i)]);
    }
    /// Calls f(voxel) for every voxel node that a tet belongs to.
    template <class F>
    void eachVoxel(std::size_t tet, const F& f) const
    {
        for (std::size_t i = tetStart_[tet]; i < tetStart_[tet + 1]; ++i) f(voxels_[voxelOfTet_[i]]);
    }

private:
    static constexpr int kMaxParts = 16;

    std::vector<Coord> voxels_;
    NodeField<std::int32_t> number_;  // of each voxel; -1: no tet is near
    std::vector<std::size_t> start_;  // of each voxel, and the end
    std::vector<Weight> weights_;
    std::vector<std::size_t> tetStart_;  // of each tet, and the end
    std::vector<std::uint32_t> voxelOfTet_;
};

}  // namespace vdbfrac::tetmesh
