#include "slivers.h"

#include "fitted_parts.h"

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/triangle.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <tuple>

namespace vdbfrac::skin {

namespace {

using Face = std::array<std::uint32_t, 3>;

/// Joins edges of rims that have no face beside them in common, all at once.
class Joiner {
public:
    Joiner(const SkinTopology& skin, double dx, SkinCut& cut)
        : skin_(skin), dx_(dx), cut_(cut), given_(std::uint32_t(skin.pointOf.size()))
    {
        for (SkinCut::Part& part : cut.parts) faces_.push_back(&part.corner);
        for (Face& face : cut.torn) faces_.push_back(&face);
        facesAt_ = groupItems(cut.points.size(), [&](const auto& add) {
            for (std::uint32_t f = 0; f < faces_.size(); ++f)
                for (const std::uint32_t c : *faces_[f])
                    if (c >= given_) add(c - given_, f);
        });
        isTouched_.assign(faces_.size(), 0);
        for (std::uint32_t p = 0; p < cut.points.size(); ++p) joined_.push_back(given_ + p);
    }

    /// Returns whether there was one.
    bool joinOnce()
    {
        bool any = false;
        for (const Edge& edge : shortEdges()) any = join(edge) || any;
        // What was taken goes along, so that the rest is the same whether it is drawn or not.
        for (SkinCut::Part& part : cut_.taken)
            for (std::uint32_t& c : part.corner)
                if (c >= given_) c = joined_[c - given_];
        const auto isFlat = [](const Face& f) { return f[0] == f[1] || f[1] == f[2] || f[2] == f[0]; };
        const auto isFlatPart = [&](const SkinCut::Part& part) { return isFlat(part.corner); };
        std::erase_if(cut_.parts, isFlatPart), std::erase_if(cut_.taken, isFlatPart), std::erase_if(cut_.torn, isFlat);
        return any;
    }

private:
    struct Edge {
        double length = 0;  // m
        std::uint32_t kept = 0, gone = 0;
        bool isFolded = false;  // of a part that looks inward
        bool operator<(const Edge& o) const
        {
            return std::tie(length, kept, gone) < std::tie(o.length, o.kept, o.gone);
        }
    };

    const SkinCut::Point& point(std::uint32_t corner) const { return cut_.points[corner - given_]; }
    const Vec3& place(std::uint32_t corner) const { return placeOf(skin_, cut_.points, corner); }
    bool isSharp(std::uint32_t corner) const { return point(corner).onEdge && skin_.isSharp[point(corner).skin]; }
    std::span<const std::uint32_t> facesAt(std::uint32_t corner) const { return facesAt_[corner - given_]; }
    static bool has(const Face& face, std::uint32_t corner) { return std::ranges::find(face, corner) != face.end(); }

    /// Sides of parts along the rim that are short against the part, or fold it over; the shortest first.
    std::vector<Edge> shortEdges() const
    {
        constexpr double kShort = 0.15, kOfLongest = 0.15;  // voxels; of the longest side of the part
        constexpr double kFold = 0.5;                       // voxels
        std::vector<Edge> edges;
        for (const SkinCut::Part& part : cut_.parts) {
            std::array<double, 3> length{};
            for (std::size_t k = 0; k < 3; ++k)
                length[k] = (place(part.corner[k]) - place(part.corner[(k + 1) % 3])).norm();
            const double longest = std::max({length[0], length[1], length[2]});
            const bool isFolded = outwardArea(skin_, cut_.points, part) < 0;
            const double most = isFolded ? kFold * dx_ : std::min(kShort * dx_, kOfLongest * longest);
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t a = part.corner[k], b = part.corner[(k + 1) % 3];
                if (a < given_ || b < given_ || length[k] > most) continue;
                if (isRim(a, b)) addEdge({length[k], std::min(a, b), std::max(a, b), isFolded}, edges);
            }
        }
        std::sort(edges.begin(), edges.end());
        return edges;
    }
    /// Does an edge have a part on one side and a torn face on the other?
    bool isRim(std::uint32_t a, std::uint32_t b) const
    {
        bool ofPart = false, ofTorn = false;
        for (const std::uint32_t f : facesAt(a))
            if (has(*faces_[f], b)) (f < cut_.parts.size() ? ofPart : ofTorn) = true;
        return ofPart && ofTorn;
    }
    /// A point on a sharp edge can go where the short side lies along that.
    void addEdge(const Edge& edge, std::vector<Edge>& edges) const
    {
        const std::uint32_t a = edge.kept, b = edge.gone;
        const Vec3 way = (place(b) - place(a)).stableNormalized();
        const auto canGo = [&](std::uint32_t gone, std::uint32_t kept) {
            return !isSharp(gone) || (isSharp(kept) && std::abs(skin_.along(point(gone).skin).dot(way)) > kSameFace);
        };
        if (canGo(b, a)) edges.push_back({edge.length, a, b, edge.isFolded});
        if (canGo(a, b)) edges.push_back({edge.length, b, a, edge.isFolded});
    }

    bool join(const Edge& edge)
    {
        for (const std::uint32_t corner : {edge.kept, edge.gone})
            if (std::ranges::any_of(facesAt(corner), [&](std::uint32_t f) { return isTouched_[f]; })) return false;
        if (!staysSurface(edge) || (!edge.isFolded && bendsRim(edge)) || turnsAny(edge)) return false;
        for (const std::uint32_t corner : {edge.kept, edge.gone})
            for (const std::uint32_t f : facesAt(corner)) isTouched_[f] = 1;
        for (const std::uint32_t f : facesAt(edge.gone)) std::ranges::replace(*faces_[f], edge.gone, edge.kept);
        joined_[edge.gone - given_] = edge.kept;
        return true;
    }
    /// Two ends of an edge can be joined if all that both have edges to are corners of faces of that edge, and no two
    /// faces come to lie on each other.
    bool staysSurface(const Edge& edge) const
    {
        std::vector<std::uint32_t> besideBoth, third;
        const auto nameOf = [&](std::uint32_t c) { return c < given_ ? skin_.pointOf[c] : c; };
        const auto isOther = [&](std::uint32_t c) { return c != edge.kept && c != edge.gone; };
        const auto around = [&](std::uint32_t corner) {
            std::vector<std::uint32_t> names;
            for (const std::uint32_t f : facesAt(corner))
                for (const std::uint32_t c : *faces_[f])
                    if (isOther(c)) names.push_back(nameOf(c));
            sortUnique(names);
            return names;
        };
        std::ranges::set_intersection(around(edge.kept), around(edge.gone), std::back_inserter(besideBoth));
        for (const std::uint32_t f : facesAt(edge.gone))
            if (has(*faces_[f], edge.kept))
                for (const std::uint32_t c : *faces_[f])
                    if (isOther(c)) third.push_back(nameOf(c));
        sortUnique(third);
        if (besideBoth != third) return false;
        const auto joinsThirds = [&](std::uint32_t f) {
            return !(has(*faces_[f], edge.kept) && has(*faces_[f], edge.gone)) &&
                   std::ranges::count_if(*faces_[f], [&](std::uint32_t c) {
                       return isOther(c) && std::ranges::binary_search(third, nameOf(c));
                   }) == 2;
        };
        return std::ranges::none_of(facesAt(edge.kept), joinsThirds) ||
               std::ranges::none_of(facesAt(edge.gone), joinsThirds);
    }
    /// Would the rim move by more than rims that lie on each other may be apart? It turns back where a crack ends.
    bool bendsRim(const Edge& edge) const
    {
        constexpr double kApart = 0.01;  // voxels
        std::vector<std::uint32_t> next;
        for (const std::uint32_t f : facesAt(edge.gone))
            for (const std::uint32_t c : *faces_[f])
                if (c >= given_ && c != edge.gone && c != edge.kept && isRim(edge.gone, c)) next.push_back(c);
        sortUnique(next);
        if (next.size() != 1) return true;
        const Vec3 &a = place(edge.kept), &b = place(next[0]), &p = place(edge.gone);
        return (closestPoint({a, b, b}, p).at - p).norm() > kApart * dx_;
    }
    bool turnsAny(const Edge& edge) const
    {
        const auto areaOf = [&](const Face& f) -> Vec3 {
            return (place(f[1]) - place(f[0])).cross(place(f[2]) - place(f[0]));
        };
        return std::ranges::any_of(facesAt(edge.gone), [&](std::uint32_t f) {
            if (has(*faces_[f], edge.kept)) return false;
            Face moved = *faces_[f];
            std::ranges::replace(moved, edge.gone, edge.kept);
            if (f < cut_.parts.size()) {
                const SkinCut::Part& part = cut_.parts[f];
                const double before = outwardArea(skin_, cut_.points, part);
                return !(outwardArea(skin_, cut_.points, {part.triangle, moved}) > std::min(before, 0.));
            }
            return !(areaOf(moved).dot(areaOf(*faces_[f])) > 0);
        });
    }

    const SkinTopology& skin_;
    double dx_;
    SkinCut& cut_;
    std::uint32_t given_;
    std::vector<Face*> faces_;             // parts, torn faces
    Groups facesAt_;                       // of each point of the cut
    std::vector<std::uint8_t> isTouched_;  // of each face: a point of it has been joined
    std::vector<std::uint32_t> joined_;    // of each point of the cut: that, or the one that it was joined to
};

}  // namespace

void removeSlivers(const SkinTopology& skin, double dx, SkinCut& cut)
{
    constexpr int kMost = 20;  // rounds; each joins about a half of what is left
    for (int round = 0; round < kMost && Joiner(skin, dx, cut).joinOnce(); ++round) {}
    dropInward(skin, cut.points, cut.taken);
}

}  // namespace vdbfrac::skin
