#include <vdbfrac/core/ancestry.h>

#include <string>

namespace vdbfrac::core {

void Ancestry::recut(std::size_t body, std::span<const std::uint32_t> previous, int frame)
{
    Stretch& stretch = bodies_[body];
    std::vector<std::uint32_t> node(previous.begin(), previous.end());
    if (stretch.frame == frame)
        for (std::uint32_t& n : node) n = stretch.node[n];
    stretch = {frame, std::move(node)};
}

std::span<const std::uint32_t> Ancestry::before(std::size_t body, int frame) const
{
    if (bodies_[body].frame != frame) return {};
    return bodies_[body].node;
}

void Ancestry::save(Archive& archive) const
{
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        archive.putOne("ancestry_frame_" + std::to_string(b), bodies_[b].frame);
        archive.put("ancestry_node_" + std::to_string(b), bodies_[b].node);
    }
}

void Ancestry::restoreFrom(const Archive& archive, std::span<const Body> bodies)
{
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
        bodies_[b].frame = archive.getOne<std::int32_t>("ancestry_frame_" + std::to_string(b));
        bodies_[b].node = archive.get<std::uint32_t>("ancestry_node_" + std::to_string(b));
        const bool wasCut = bodies_[b].frame > 0;
        if (bodies_[b].frame < 0 || bodies_[b].node.size() != (wasCut ? bodies[b].mesh->nodeCount() : 0))
            archive.complain("what nodes were before a cut is not of all nodes");
    }
}

}  // namespace vdbfrac::core
