// Connected pieces of material, with ids that last.
#pragma once

#include <vdbfrac/tetmesh/body_mesh.h>

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace vdbfrac::tetmesh {

/// One fragment over its whole life. Ids are never reused; a split leaves the id with the larger part.
struct Fragment {
    std::uint32_t id = 0;
    std::int64_t parent = -1;  ///< the fragment it broke off, -1 for one that was there at the start
    double birth = 0;          ///< s
    double restVolume = 0;     ///< material now in it [m^3]; 0 when it is gone
};

class FragmentTracker {
public:
    FragmentTracker() = default;
    /// Ids are taken from `nextId` (several bodies share one sequence), larger fragments first.
    FragmentTracker(const BodyMesh& mesh, std::uint32_t& nextId);
    /// What fragments() and ofNode() of another gave.
    FragmentTracker(std::vector<Fragment> fragments, std::vector<std::uint32_t> ofNode)
        : fragments_(std::move(fragments)), ofNode_(std::move(ofNode))
    {
    }

    /// Follows the mesh through an update. `previousNode` as in CutUpdate; `nextId` is advanced for new fragments.
    void update(const BodyMesh& mesh, std::span<const std::uint32_t> previousNode, double time, std::uint32_t& nextId);

    const std::vector<Fragment>& fragments() const { return fragments_; }  ///< by rising id, also those gone
    const std::vector<std::uint32_t>& ofNode() const { return ofNode_; }   ///< id of each node's fragment
    std::size_t alive() const;

private:
    std::vector<Fragment> fragments_;
    std::vector<std::uint32_t> ofNode_;
};

}  // namespace vdbfrac::tetmesh
