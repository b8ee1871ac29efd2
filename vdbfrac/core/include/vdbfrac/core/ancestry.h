// Which node each node was a frame before, and what cracks took since: what surfaces of one topology over a whole run
// need.
#pragma once

#include <vdbfrac/core/archive.h>
#include <vdbfrac/core/body.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace vdbfrac::core {

/// A tet of which cracks have taken all material.
struct TakenTet {
    std::array<std::uint32_t, 4> node{};  ///< in the frame before
    std::array<Vec3, 4> X{};              ///< m, at rest
};

/// Nodes only split, so each has one ancestor in every frame before.
class Ancestry {
public:
    explicit Ancestry(std::span<const Body> bodies);

    /// A body was cut again on the way to a frame (counted from 1 at the first after rest).
    void recut(std::size_t body, const tetmesh::BodyMesh& mesh, const tetmesh::CutUpdate& update, int frame);
    /// Of each node of a body in a frame: its number in the frame before. Empty where they are the same.
    std::span<const std::uint32_t> before(std::size_t body, int frame) const;
    /// The tets of a body that cracks took on the way to a frame.
    std::span<const TakenTet> taken(std::size_t body, int frame) const;

    void save(Archive& archive) const;
    void restoreFrom(const Archive& archive, std::span<const Body> bodies);

private:
    struct Stretch {
        std::int32_t frame = 0;
        std::vector<std::uint32_t> node;
        std::vector<TakenTet> taken;
    };
    std::vector<Stretch> bodies_;       // since the frame before `frame`
    std::vector<std::vector<Vec3>> X_;  // m, at rest: of the nodes of each body now
};

/// Arrays KEY_node and KEY_X of an archive.
void putTets(Archive& archive, const std::string& key, std::span<const TakenTet> tets);
/// None where the archive has no such arrays. Throws FileError where they do not fit.
std::vector<TakenTet> getTets(const Archive& archive, const std::string& key);

}  // namespace vdbfrac::core
