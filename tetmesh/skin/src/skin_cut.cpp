#include <vdbfrac/skin/skin_cut.h>

#include "crossings.h"
#include "kept_skin.h"
#include "lips.h"
#include "redivide.h"
#include "rest_parts.h"
#include "slivers.h"
#include "specks.h"
#include "taken_skin.h"
#include "torn_detail.h"
#include "torn_faces.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/planar.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace vdbfrac::skin {

using tetmesh::inOrder;
using tetmesh::NamedPolygon;
using tetmesh::PlanarPolygon;
using tetmesh::PlanarTriangles;
using tetmesh::triangulate;

namespace {

/// Divides triangles that the crack crosses.
class TriangleDivider {
public:
    TriangleDivider(const SkinTopology& skin, const Crossings& crossings, std::span<const std::uint8_t> isOpen)
        : skin_(skin), crossings_(crossings), isOpen_(isOpen)
    {
    }

    /// The parts of a triangle outside of cracks and in them, as numbers of corners 0 to 2 and, from 3 on, of
    /// crossings + 3.
    struct Divided {
        std::vector<std::array<std::uint32_t, 3>> kept, taken;
        bool isSound = true;  // false when rounding left a gap
    };
    Divided divide(std::uint32_t triangle, std::span<const RimSegment> segments) const
    {
        const auto& corner = skin_.triangles[triangle];
        const Vec3 &a = skin_.points[corner[0]], &b = skin_.points[corner[1]], &c = skin_.points[corner[2]];
        NamedPolygon<std::uint32_t> named((b - a).cross(c - a));
        const auto numberOf = [&](std::uint32_t crossing) {
            return named.number(crossing + 3, crossings_.points[crossing].X);
        };
        PlanarPolygon& polygon = named.polygon;
        std::vector<std::uint32_t> round;
        std::vector<std::uint8_t> labels;
        for (std::uint32_t k = 0; k < 3; ++k) {
            round.push_back(named.number(k, skin_.points[corner[k]]));
            std::uint8_t label = isOpen_[corner[k]];
            labels.push_back(label);
            for (std::uint32_t crossing : along(triangle, k)) {
                round.push_back(numberOf(crossing));
                labels.push_back(label ^= 1);
            }
        }
        polygon.goRound(round, labels);
        for (const RimSegment& s : segments)
            polygon.lines.push_back({numberOf(s.crossing[0]), numberOf(s.crossing[1])});
        const PlanarTriangles triangles = triangulate(polygon);
        Divided divided{{}, {}, triangles.isSound};
        for (std::size_t i = 0; i < triangles.triangles.size(); ++i)
            (triangles.label[i] ? divided.taken : divided.kept).push_back(named.names(triangles.triangles[i]));
        return divided;
    }

private:
    /// Crossings on side k of a triangle, in its direction.
    std::vector<std::uint32_t> along(std::uint32_t triangle, std::uint32_t k) const
    {
        const std::uint32_t edge = skin_.edgeOf[triangle][k];
        const auto& ends = skin_.edges[edge];
        const Vec3 direction = skin_.points[ends[1]] - skin_.points[ends[0]];
        const auto isBefore = [](const Crossing& c, std::uint32_t e) { return !c.onEdge || c.skin < e; };
        auto at = std::lower_bound(crossings_.points.begin(), crossings_.points.end(), edge, isBefore);
        std::vector<std::pair<double, std::uint32_t>> found;
        for (; at != crossings_.points.end() && at->skin == edge; ++at)
            found.push_back({direction.dot(at->X), std::uint32_t(at - crossings_.points.begin())});
        return inOrder(std::move(found), skin_.triangles[triangle][k] != ends[0]);
    }

    const SkinTopology& skin_;
    const Crossings& crossings_;
    std::span<const std::uint8_t> isOpen_;  // of each point of the skin
};

std::vector<std::uint8_t> openPoints(const SkinTopology& skin, const CrackLattice& lattice)
{
    std::vector<std::uint8_t> open(skin.points.size());
    parallelChunks(open.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) open[i] = isOpen(lattice, skin.points[i]);
    });
    return open;
}

/// The segments of a triangle, of all that are sorted by triangle.
std::span<const RimSegment> segmentsOf(const Crossings& crossings, std::uint32_t triangle)
{
    return std::ranges::equal_range(crossings.segments, triangle, {}, &RimSegment::triangle);
}

}  // namespace

SkinCutter::SkinCutter(std::span<const Vec3> points, std::vector<std::array<std::uint32_t, 3>> triangles,
                       const tetmesh::NodeField<float>& rest, double dx, bool isInParts)
    : triangles_(std::move(triangles)),
      topology_(std::make_shared<const SkinTopology>(topologyOf(points, triangles_))),
      isInner_(triangles_.size()),
      between_(isInParts ? nodesBetweenParts(rest, dx) : std::vector<Coord>()),
      dx_(dx)
{
    // Sheets deeper than this are no surface of the material: parts of a mesh that reach into each other.
    constexpr double kDeep = 1;  // voxels
    offset_ = orderedMax(triangles_.size(), kChunk, 0, [&](std::size_t begin, std::size_t end) {
        double most = 0;
        for (std::size_t t = begin; t < end; ++t) {
            const auto& corner = topology_->triangles[t];
            const Vec3 middle =
                (topology_->points[corner[0]] + topology_->points[corner[1]] + topology_->points[corner[2]]) / 3;
            const double phi = tetmesh::trilinear(rest, Vec3(middle / dx_));
            isInner_[t] = phi < -kDeep * dx_;
            if (!isInner_[t]) most = std::max(most, std::min(std::abs(phi), kDeep * dx_));
        }
        return most;
    });
}

std::span<const std::uint32_t> SkinCutter::places() const { return topology_->pointOf; }

/// Nodes that points of the skin belong to, each on the side of the cracks where its point is.
std::vector<Coord> SkinCutter::anchors(const CrackLattice& lattice) const
{
    std::vector<Coord> all(topology_->points.size());
    parallelChunks(all.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) all[i] = anchorOf(lattice, topology_->points[i]);
    });
    std::vector<Coord> given(topology_->pointOf.size());
    for (std::size_t i = 0; i < given.size(); ++i) given[i] = all[topology_->pointOf[i]];
    return given;
}

/// Divides the triangles that the cracks cross.
void SkinCutter::divide(const Crossings& crossings, std::span<const std::uint8_t> isOpen, SkinCut& cut) const
{
    const std::uint32_t given = std::uint32_t(topology_->pointOf.size());
    const TriangleDivider divider(*topology_, crossings, isOpen);
    for (std::uint32_t t : crossings.looked) {
        const std::span<const RimSegment> segments = segmentsOf(crossings, t);
        if (segments.empty()) continue;
        cut.fate[t] = SkinCut::Fate::cut;
        const auto add = [&](const std::vector<std::array<std::uint32_t, 3>>& from, std::vector<SkinCut::Part>& to) {
            for (const auto& part : from) {
                SkinCut::Part& p = to.emplace_back(SkinCut::Part{t, {}});
                for (std::size_t k = 0; k < 3; ++k)
                    p.corner[k] = part[k] < 3 ? triangles_[t][part[k]] : given + part[k] - 3;
            }
        };
        const TriangleDivider::Divided divided = divider.divide(t, segments);
        cut.defects += !divided.isSound;
        add(divided.kept, cut.parts), add(divided.taken, cut.taken);
    }
}

SkinCut SkinCutter::cut(const tetmesh::NodeField<float>& rest, const tetmesh::NodeField<float>& now,
                        const CrackStyle& style, const FragmentAt& fragment, Taken taken) const
{
    SkinCut cut;
    cut.fate.assign(triangles_.size(), SkinCut::Fate::kept);
    cut.cracks = crackField(rest, now, dx_, fragment, between_);
    const CrackLattice lattice(cut.cracks.c, now, dx_);
    cut.anchor = anchors(lattice);
    cut.mixedVoxels = std::int64_t(lattice.mixedVoxels().size());
    if (lattice.mixedVoxels().empty()) return cut;
    const Crossings crossings = findCrossings(*topology_, lattice);
    const std::vector<std::uint8_t> open = openPoints(*topology_, lattice);
    for (const Crossing& p : crossings.points)
        cut.points.push_back({p.X, p.anchor, p.skin, p.onEdge, p.onEdge ? topology_->trianglesOf[p.skin][0] : p.skin});
    cut.defects = crossings.defects;
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
        if (open[topology_->triangles[t][0]]) cut.fate[t] = SkinCut::Fate::gone;
    divide(crossings, open, cut);
    addTornFaces({lattice, rest, crossings, isInner_, offset_, std::uint32_t(topology_->pointOf.size())}, cut);
    removeSpecks(*topology_, now, dx_, cut);
    std::vector<SkinCut::Point> made;
    if (style.lips == Lips::closed) {
        made = cut.points;
        closeLips(*topology_, lattice, cut);
        removeTiny(*topology_, dx_, cut);
    }
    if (taken == Taken::kept) {
        for (std::uint32_t t = 0; t < triangles_.size(); ++t)
            if (cut.fate[t] == SkinCut::Fate::gone) cut.taken.push_back({t, triangles_[t]});
        fitTaken(*topology_, dx_, made, cut);
    } else {
        cut.taken.clear();
    }
    if (!made.empty()) {
        fitKept(*topology_, dx_, made, triangles_, cut);
        redivide(*topology_, cut.points, cut.taken);  // between rims that have moved since they were fitted
        removeSlivers(*topology_, dx_, cut);
    }
    if (style.detail.amplitude > 0) addTornDetail(style.detail, rest, dx_, cut);
    return cut;
}

}  // namespace vdbfrac::skin
