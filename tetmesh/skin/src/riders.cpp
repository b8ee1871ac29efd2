#include <vdbfrac/skin/riders.h>

#include "carrier.h"
#include "crack_lattice.h"
#include "node_search.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/cut_mesh.h>
#include <vdbfrac/tetmesh/nodes_where.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <algorithm>
#include <set>
#include <utility>

namespace vdbfrac::skin {

namespace {

using Tets = std::vector<tetmesh::TetShare>;

struct Reached {
    Tets tets;
    Coord at;     ///< where they are
    Coord least;  ///< of all nodes that were looked at
};

/// The tets at a node, or at the first with any that edges lead to: without entering a crack, or through all.
Reached tetsReached(const Carrier& carrier, const CrackField& cracks, Coord start, bool throughCracks)
{
    constexpr std::size_t kWidest = 4000;  // nodes looked at
    const auto isClosed = [&](Coord n) {
        return holdsTogether(cracks.c(n), carrier.body.restPhi()(n), carrier.body.voxelSize());
    };
    std::vector<Coord> reached{start};
    std::set<Coord> seen{start};
    for (std::size_t i = 0; i < reached.size() && i < kWidest; ++i) {
        if (Tets tets = carrier.tetsAt(reached[i]); !tets.empty()) return {std::move(tets), reached[i], *seen.begin()};
        forNeighbours(reached[i], [&](Coord next) {
            if ((throughCracks || isClosed(next)) && seen.insert(next).second) reached.push_back(next);
        });
    }
    return {{}, start, *seen.begin()};
}

/// What cracks have closed off on all sides and eaten up goes along with what is beyond them, whatever its fragment:
/// all of it with the same, as it is drawn as one.
Reached tetsFrom(const Carrier& carrier, const CrackField& cracks, Coord start)
{
    const auto side = std::lower_bound(cracks.material.begin(), cracks.material.end(), start,
                                       [](const auto& entry, Coord n) { return entry.first < n; });
    if (side != cracks.material.end() && side->first == start) start = side->second;
    Reached own = tetsReached(carrier, cracks, start, false);
    if (!own.tets.empty()) return own;
    const FragmentAt anyFragment;
    return tetsReached({carrier.body, anyFragment, carrier.fragmentOfNode}, cracks, own.least, true);
}

struct Found {
    tetmesh::EmbeddedPoint point;
    double least = -1e300;  // smallest weight: below 0 outside of the tet
    double outside = 0;     // m

    void see(const tetmesh::RestTet& tet, const Vec3& X)
    {
        const tetmesh::EmbeddedPoint at = tet.embed(X);
        if (const double weight = at.leastWeight(); weight > least)
            point = at, least = weight, outside = point.isInTet() ? 0 : tet.outside(point);
    }
};

std::vector<std::uint32_t> nodesOf(std::span<const tetmesh::RestTet> tets)
{
    std::vector<std::uint32_t> nodes;
    for (const tetmesh::RestTet& tet : tets) nodes.insert(nodes.end(), tet.node.begin(), tet.node.end());
    sortUnique(nodes);
    return nodes;
}

/// What carries the riders of one anchor.
class Anchored {
public:
    Anchored(const Carrier& carrier, const CrackField& cracks, const Reached& reached)
        : carrier_(carrier), cracks_(cracks), at_(reached.at)
    {
        for (const tetmesh::TetShare& tet : reached.tets) tets_.push_back(restTet(tet));
    }

    /// X in a tet at the anchor, in one beside these, or as near to one of the anchor's as can be.
    Found nearest(const Vec3& X)
    {
        constexpr double kSurely = 1e-9;  // least weight of what is in a tet and, whatever the rounding, in no other
        Found best;
        for (const tetmesh::RestTet& tet : tets_) {
            best.see(tet, X);
            if (best.least > kSurely) break;
        }
        if (tets_.empty() || best.point.isInTet()) return best;
        const Found beside = isBesideCrack(X) ? onThisSide(X) : withSharedNodes(X);
        return beside.least > best.least && beside.point.isInTet() ? beside : best;
    }

private:
    tetmesh::RestTet restTet(const tetmesh::TetShare& tet) const
    {
        return carrier_.body.restTet(tet.element, std::uint32_t(tet.tet));
    }
    template <class Visit>
    void forCorners(const Vec3& X, const Visit& visit) const
    {
        const Coord low = tetmesh::floorOf(X / carrier_.body.voxelSize());
        for (int k = 0; k < tetmesh::kCorners; ++k) visit(low + tetmesh::cornerOffset(k));
    }
    bool isBesideCrack(const Vec3& X) const
    {
        bool any = false;
        forCorners(X, [&](Coord n) { any = any || cracks_.c(n) > 0; });
        return any;
    }
    /// At the front of a crack tets of both lips share nodes: there only those count that are at a corner of X's voxel
    /// to which a straight way leads.
    Found onThisSide(const Vec3& X) const
    {
        const auto isMaterial = [&](Coord n) { return carrier_.hasMaterial(n) && !(cracks_.c(n) > 0); };
        Found best;
        forCorners(X, [&](Coord n) {
            if (n == at_ || !isMaterial(n) || !areStraightJoined(at_, n, isMaterial)) return;
            for (const tetmesh::TetShare& tet : carrier_.tetsAt(n)) best.see(restTet(tet), X);
        });
        return best;
    }
    Found withSharedNodes(const Vec3& X)
    {
        if (nodes_.empty()) nodes_ = nodesOf(tets_);
        const auto beside = carrier_.body.locate(X, nodes_);
        return beside ? Found{beside->point, beside->point.leastWeight(), 0} : Found();
    }

    const Carrier& carrier_;
    const CrackField& cracks_;
    Coord at_;
    std::vector<tetmesh::RestTet> tets_;
    std::vector<std::uint32_t> nodes_;  // theirs, once they are needed
};

}  // namespace

namespace {

/// Voxel nodes at which there is material.
std::vector<Coord> nodesWithTets(const Carrier& carrier)
{
    std::vector<Coord> nodes =
        tetmesh::nodesWhere(carrier.body.phi(), [&](Coord c) { return !carrier.tetsAt(c).empty(); });
    std::ranges::sort(nodes);
    if (nodes.empty()) throw Error("no material is left to carry the drawn surface");
    return nodes;
}

/// For what is so far from all material that no search comes there: parts that are thinner than voxels.
Reached nearestOf(std::span<const Coord> nodes, const Carrier& carrier, Coord from)
{
    const Coord at =
        *std::ranges::min_element(nodes, {}, [&](Coord n) { return (n.toVec() - from.toVec()).squaredNorm(); });
    return {carrier.tetsAt(at), at, at};
}

}  // namespace

FragmentAt fragmentsAt(const tetmesh::BodyMesh& body, std::span<const std::uint32_t> fragmentOfNode)
{
    const auto* lattice = dynamic_cast<const tetmesh::CutMesh*>(&body);
    if (lattice && lattice->lattice().kind == tetmesh::Lattice::Kind::six && !lattice->lattice().wholeTets) return {};
    return [&body, fragmentOfNode](Coord voxel) -> std::optional<std::uint32_t> {
        const auto found = body.locate(body.voxelSize() * voxel.toVec());
        return found ? std::optional(fragmentOfNode[found->point.node[0]]) : std::nullopt;
    };
}

Embedded embedRiders(const tetmesh::BodyMesh& body, const CrackField& cracks, std::span<const Rider> riders,
                     const FragmentAt& fragment, std::span<const std::uint32_t> fragmentOfNode)
{
    const Carrier carrier{body, fragment, fragmentOfNode};
    constexpr double kFar = -1;                          // weight of a point a tet's height away
    std::vector<std::pair<Coord, std::uint32_t>> order;  // anchor and number of each rider
    order.reserve(riders.size());
    for (std::uint32_t i = 0; i < riders.size(); ++i) order.emplace_back(riders[i].anchor, i);
    std::sort(order.begin(), order.end());
    std::vector<std::size_t> run;  // starts of equal anchors
    for (std::size_t i = 0; i < order.size(); ++i)
        if (i == 0 || order[i].first != order[i - 1].first) run.push_back(i);
    run.push_back(order.size());
    Embedded embedded;
    embedded.points.resize(riders.size()), embedded.from.resize(riders.size()), embedded.outside.resize(riders.size());
    /// Puts riders of one anchor, in `order` from begin to end, into what was reached; counts those that are far out.
    const auto put = [&](std::size_t begin, std::size_t end, const Reached& reached) {
        Anchored anchored(carrier, cracks, reached);
        std::int64_t far = 0;
        for (std::size_t i = begin; i < end; ++i) {
            const std::uint32_t rider = order[i].second;
            const Found found = anchored.nearest(riders[rider].X);
            embedded.points[rider] = found.point;
            embedded.from[rider] = reached.at;
            embedded.outside[rider] = found.outside;
            far += found.least < kFar;
        }
        return far;
    };
    std::vector<std::uint8_t> isLost(run.size() - 1, 0);
    embedded.far = std::int64_t(orderedSum(isLost.size(), 64, [&](std::size_t begin, std::size_t end) {
        std::int64_t far = 0;
        for (std::size_t r = begin; r < end; ++r) {
            const Reached reached = tetsFrom(carrier, cracks, order[run[r]].first);
            isLost[r] = reached.tets.empty();
            if (!isLost[r]) far += put(run[r], run[r + 1], reached);
        }
        return double(far);
    }));
    if (std::ranges::count(isLost, 1) == 0) return embedded;
    const std::vector<Coord> anywhere = nodesWithTets(carrier);
    for (std::size_t r = 0; r < isLost.size(); ++r)
        if (isLost[r]) embedded.far += put(run[r], run[r + 1], nearestOf(anywhere, carrier, order[run[r]].first));
    return embedded;
}

}  // namespace vdbfrac::skin
