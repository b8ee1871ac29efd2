#include "specks.h"

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/base/grouping.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

namespace vdbfrac::skin {

namespace {

/// What faces that the cut made hang together by: points of the cut, then corners of the outer surface.
class CutPieces {
public:
    CutPieces(const SkinTopology& skin, const SkinCut& cut) : skin_(skin), given_(std::uint32_t(skin.pointOf.size()))
    {
        for (const SkinCut::Part& part : cut.parts)
            for (const std::uint32_t p : part.corner)
                if (p < given_) corners.push_back(skin.pointOf[p]);
        sortUnique(corners);
        points_ = std::uint32_t(cut.points.size());
        DisjointSets sets(points_ + corners.size());
        const auto join = [&](const std::array<std::uint32_t, 3>& face) {
            for (std::size_t k = 1; k < 3; ++k) sets.join(number(face[0]), number(face[k]));
        };
        for (const auto& face : cut.torn) join(face);
        for (const SkinCut::Part& part : cut.parts) join(part.corner);
        name = std::move(sets).names();
    }
    std::uint32_t of(std::uint32_t point) const { return name[number(point)]; }

    std::vector<std::uint32_t> corners;  // of the outer surface, rising
    std::vector<std::uint32_t> name;     // of the piece, of each

private:
    std::uint32_t number(std::uint32_t point) const
    {
        if (point >= given_) return point - given_;
        const auto at = std::ranges::lower_bound(corners, skin_.pointOf[point]);
        return points_ + std::uint32_t(at - corners.begin());
    }

    const SkinTopology& skin_;
    std::uint32_t given_, points_ = 0;
};

}  // namespace

void removeSpecks(const SkinTopology& skin, const tetmesh::NodeField<float>& now, double dx, SkinCut& cut)
{
    const CutPieces pieces(skin, cut);
    std::vector<Eigen::AlignedBox3d> box(pieces.name.size());
    std::vector<std::uint8_t> isKept(pieces.name.size(), 0);  // it has material, or hangs on a whole triangle
    for (std::size_t i = 0; i < pieces.name.size(); ++i) {
        const bool isMade = i < cut.points.size();
        box[pieces.name[i]].extend(isMade ? cut.points[i].X : skin.points[pieces.corners[i - cut.points.size()]]);
        if (isMade && now(cut.points[i].anchor) < 0) isKept[pieces.name[i]] = 1;
    }
    const auto isSmall = [&](std::size_t name) { return !isKept[name] && box[name].sizes().maxCoeff() < dx; };
    std::vector<std::pair<std::uint32_t, std::uint32_t>> small;  // corners of small pieces, with these
    for (std::size_t i = 0; i < pieces.corners.size(); ++i)
        if (const std::uint32_t name = pieces.name[cut.points.size() + i]; isSmall(name))
            small.emplace_back(pieces.corners[i], name);
    for (std::size_t t = 0; t < skin.triangles.size() && !small.empty(); ++t) {
        if (cut.fate[t] != SkinCut::Fate::kept) continue;
        for (const std::uint32_t corner : skin.triangles[t]) {
            const auto at = std::ranges::lower_bound(small, corner, {}, [](const auto& one) { return one.first; });
            if (at != small.end() && at->first == corner) isKept[at->second] = 1;
        }
    }
    for (std::size_t i = 0; i < pieces.name.size(); ++i) cut.specks += pieces.name[i] == i && isSmall(i);
    if (cut.specks == 0) return;
    std::erase_if(cut.torn, [&](const auto& face) { return isSmall(pieces.of(face[0])); });
    const auto isTaken = [&](const SkinCut::Part& part) { return isSmall(pieces.of(part.corner[0])); };
    std::ranges::copy_if(cut.parts, std::back_inserter(cut.taken), isTaken);
    std::erase_if(cut.parts, isTaken);
}

}  // namespace vdbfrac::skin
