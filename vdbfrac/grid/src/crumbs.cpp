#include <vdbfrac/grid/crumbs.h>

#include <vdbfrac/grid/phi_nodes.h>
#include <vdbfrac/tetmesh/cut.h>
#include <vdbfrac/tetmesh/nodes_where.h>
#include <vdbfrac/tetmesh/parts.h>

#include <vector>

namespace vdbfrac::grid {

namespace {

constexpr int kNear = 3;         // voxels
constexpr float kOutside = .5f;  // voxels, before it is re-levelled

/// Is a node of a larger part near this one?
bool isBesideLarger(Coord c, const tetmesh::PartNames& part, const std::vector<std::size_t>& size)
{
    for (int z = -kNear; z <= kNear; ++z)
        for (int y = -kNear; y <= kNear; ++y)
            for (int x = -kNear; x <= kNear; ++x)
                if (const std::uint32_t other = part(c + Coord{x, y, z});
                    other != tetmesh::kNameless && size[other] > kMostOfCrumb)
                    return true;
    return false;
}

}  // namespace

std::size_t takeOutCrumbs(LevelSet& phi, const tetmesh::NodeField<float>& nodes,
                          const std::function<bool(Coord)>& isApart)
{
    const double dx = phi.voxelSize();
    const std::vector<Coord> material =
        tetmesh::nodesWhere(nodes, [&](Coord c) { return nodes(c) < -tetmesh::kSnap * dx; });
    tetmesh::PartNames part(nodes.lower(), nodes.upper(), tetmesh::kNameless, tetmesh::kNameless);
    part.cover(material);
    if (tetmesh::nameParts(material, part) < 2) return 0;
    std::vector<std::size_t> size(material.size(), 0);
    for (const Coord& c : material) ++size[part(c)];
    std::vector<std::uint8_t> isCrumb(material.size(), 0);  // by the names of parts
    for (const Coord& c : material)
        if (size[part(c)] <= kMostOfCrumb && isApart(c) && isBesideLarger(c, part, size)) isCrumb[part(c)] = 1;
    PhiChanges raised;
    std::size_t crumbs = 0;
    for (std::uint32_t i = 0; i < material.size(); ++i) {
        const std::uint32_t name = part(material[i]);
        crumbs += isCrumb[name] && name == i;
        if (isCrumb[name]) raised.emplace_back(material[i], kOutside * float(dx));
    }
    RelevelWork work;
    if (!raised.empty()) raiseAndRelevel(phi, raised, work);
    return crumbs;
}

}  // namespace vdbfrac::grid
