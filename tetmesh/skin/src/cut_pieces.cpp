#include "cut_pieces.h"

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/base/grouping.h>

#include <algorithm>
#include <array>
#include <limits>

namespace vdbfrac::skin {

namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

Eigen::AlignedBox3d boxOf(const SkinTopology& skin, std::uint32_t triangle)
{
    Eigen::AlignedBox3d box;
    for (const Vec3& X : skin.corners(triangle)) box.extend(X);
    return box;
}

}  // namespace

/// From parts over triangles that are whole: small pieces as far as they can go, others to the first.
class CutPieces::Grower {
public:
    Grower(CutPieces& pieces, const SkinCut& cut, DisjointSets& sets)
        : pieces_(pieces), skin_(pieces.skin_), cut_(cut), sets_(sets), ownerOf_(skin_.triangles.size(), kNone)
    {
    }
    /// Goes on from the sides of a triangle that a part has whole.
    void grow(const SkinCut::Part& part)
    {
        const std::uint32_t own = pieces_.number(part.corner[0]);
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = placeOf(part.corner[k]), b = placeOf(part.corner[(k + 1) % 3]);
            if (a == kNone || b == kNone) continue;
            for (const std::uint32_t e : skin_.edgeOf[part.triangle])
                if (skin_.edges[e] == std::array{std::min(a, b), std::max(a, b)}) reach(e, own);
        }
        for (std::size_t r = 0; r < reached_.size(); ++r)
            for (const std::uint32_t e : skin_.edgeOf[reached_[r]]) reach(e, own);
        reached_.clear();
    }

private:
    std::uint32_t placeOf(std::uint32_t point) const { return point < pieces_.given_ ? skin_.pointOf[point] : kNone; }

    void reach(std::uint32_t edge, std::uint32_t own)
    {
        for (const std::uint32_t t : skin_.trianglesOf[edge]) {
            if (cut_.fate[t] != SkinCut::Fate::kept) continue;
            if (ownerOf_[t] != kNone) {
                unite(ownerOf_[t], own);
                continue;
            }
            ownerOf_[t] = own;
            if (pieces_.isSmall(sets_.find(own))) {
                pieces_.box_[sets_.find(own)].extend(boxOf(skin_, t));
                pieces_.whole_.emplace_back(t, own), reached_.push_back(t);
            }
        }
    }
    void unite(std::uint32_t a, std::uint32_t b)
    {
        const Eigen::AlignedBox3d both = pieces_.box_[sets_.find(a)].merged(pieces_.box_[sets_.find(b)]);
        sets_.join(a, b);
        pieces_.box_[sets_.find(a)] = both;
    }

    CutPieces& pieces_;
    const SkinTopology& skin_;
    const SkinCut& cut_;
    DisjointSets& sets_;
    std::vector<std::uint32_t> ownerOf_;  // a number of the piece of each whole triangle
    std::vector<std::uint32_t> reached_;
};

CutPieces::CutPieces(const SkinTopology& skin, const SkinCut& cut, double small)
    : skin_(skin), small_(small), given_(std::uint32_t(skin.pointOf.size())), points_(std::uint32_t(cut.points.size()))
{
    for (const SkinCut::Part& part : cut.parts)
        for (const std::uint32_t p : part.corner)
            if (p < given_) corners_.push_back(skin.pointOf[p]);
    sortUnique(corners_);
    DisjointSets sets(points_ + corners_.size());
    const auto join = [&](const std::array<std::uint32_t, 3>& face) {
        for (std::size_t k = 1; k < 3; ++k) sets.join(number(face[0]), number(face[k]));
    };
    for (const auto& face : cut.torn) join(face);
    for (const SkinCut::Part& part : cut.parts) join(part.corner);
    box_.resize(points_ + corners_.size());
    for (std::uint32_t i = 0; i < box_.size(); ++i)
        box_[sets.find(i)].extend(i < points_ ? cut.points[i].X : skin.points[corners_[i - points_]]);
    Grower grower(*this, cut, sets);
    for (const SkinCut::Part& part : cut.parts) grower.grow(part);
    name_ = std::move(sets).names();
}

std::vector<std::pair<std::uint32_t, std::uint32_t>> CutPieces::whole() const
{
    std::vector<std::pair<std::uint32_t, std::uint32_t>> small;
    for (const auto& [triangle, number] : whole_)
        if (isSmall(name_[number])) small.emplace_back(triangle, name_[number]);
    return small;
}

std::uint32_t CutPieces::number(std::uint32_t point) const
{
    if (point >= given_) return point - given_;
    return points_ + std::uint32_t(std::ranges::lower_bound(corners_, skin_.pointOf[point]) - corners_.begin());
}

}  // namespace vdbfrac::skin
