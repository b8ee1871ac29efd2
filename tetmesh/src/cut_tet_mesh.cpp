#include <vdbfrac/tetmesh/cut_tet_mesh.h>

#include "body_volume.h"
#include "coord_ranges.h"
#include "nodal_weights.h"
#include "weld.h"

#include <vdbfrac/base/disjoint_sets.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/trilinear.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <mutex>
#include <numeric>
#include <optional>

namespace vdbfrac::tetmesh {

namespace {

constexpr std::uint8_t kNone = 255;  // no label: the tet has no material

}  // namespace

struct CutTetMesh::Weights {
    std::once_flag made;
    std::optional<NodalWeights> weights;
};

CutTetMesh::CutTetMesh(const TetMesh& mesh, double spacing, double voxelSize, NodeField<float> phi,
                       const RestShape& shape)
    : h_(spacing), dx_(voxelSize), phi_(std::move(phi)), rest_(phi_), weights_(std::make_unique<Weights>())
{
    sortIntoBlocks(mesh);
    findStars();
    measureShapes();
    seen_.resize(points_.size());
    for (std::size_t p = 0; p < points_.size(); ++p) {
        seen_[p] = phiAt(points_[p]);
        wasMaterial_.push_back(seen_[p] < 0);
        pointsOfVoxelCell_.push_back({floorOf(points_[p] / dx_), std::uint32_t(p)});
    }
    std::sort(pointsOfVoxelCell_.begin(), pointsOfVoxelCell_.end());
    for (const auto& face : boundaryOf(tets_))
        for (std::uint32_t p : face)
            if (seen_[p] < 0) {
                const Vec3& X = points_[p];
                const std::string place =
                    "(" + shortNumber(X.x()) + ", " + shortNumber(X.y()) + ", " + shortNumber(X.z()) + ") m";
                throw InputError(
                    {place, "the mesh of tets does not enclose the material", "phi >= 0 at its boundary", ""});
            }
    cut_.resize(tets_.size());
    label_.assign(star_.size(), kNone);
    copies_.assign(points_.size(), 0);
    cut(allTets());
    if (shape) correct(shape);
    for (std::uint32_t p = 0; p < points_.size(); ++p) classify(p);
    numberNodes();
    makeElements();
}

CutTetMesh::CutTetMesh(CutTetMesh&&) noexcept = default;
CutTetMesh::~CutTetMesh() = default;

/// Blocks by rising coordinate, tets of a block in their order in `mesh`, points in that of their first tet.
void CutTetMesh::sortIntoBlocks(const TetMesh& mesh)
{
    constexpr double kBlock = 8;  // spacings
    std::vector<std::pair<Coord, std::uint32_t>> order;
    for (std::uint32_t t = 0; t < mesh.tets.size(); ++t) {
        Vec3 sum = Vec3::Zero();
        for (std::uint32_t p : mesh.tets[t]) sum += mesh.points[p];
        order.push_back({floorOf(sum / (4 * kBlock * h_)), t});
    }
    std::sort(order.begin(), order.end());
    constexpr std::uint32_t kUnseen = ~0u;
    std::vector<std::uint32_t> number(mesh.points.size(), kUnseen);
    for (std::size_t i = 0; i < order.size(); ++i) {
        std::array<std::uint32_t, 4> tet{};
        for (std::size_t a = 0; a < 4; ++a) {
            const std::uint32_t p = mesh.tets[order[i].second][a];
            if (number[p] == kUnseen) {
                number[p] = std::uint32_t(points_.size());
                points_.push_back(mesh.points[p]);
            }
            tet[a] = number[p];
        }
        tets_.push_back(tet);
        const bool next = i > 0 && order[i].first != order[i - 1].first;
        patchOfTet_.push_back(i == 0 ? 0 : patchOfTet_.back() + next);
    }
}

void CutTetMesh::findStars()
{
    starStart_.assign(points_.size() + 1, 0);
    for (const auto& tet : tets_)
        for (std::uint32_t p : tet) ++starStart_[p + 1];
    for (std::size_t p = 0; p < points_.size(); ++p) starStart_[p + 1] += starStart_[p];
    std::vector<std::uint32_t> next(starStart_.begin(), starStart_.end() - 1);
    star_.resize(starStart_.back());
    slot_.resize(tets_.size());
    for (std::uint32_t t = 0; t < tets_.size(); ++t)
        for (std::size_t a = 0; a < 4; ++a) {
            slot_[t][a] = next[tets_[t][a]]++;
            star_[slot_[t][a]] = t;
        }
}

void CutTetMesh::measureShapes()
{
    shape_.resize(tets_.size());
    parallelChunks(tets_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) {
            Mat3 edges;
            for (std::size_t k = 0; k < 3; ++k)
                edges.col(Eigen::Index(k)) = points_[tets_[t][k + 1]] - points_[tets_[t][0]];
            const Mat3 gradients = h_ * edges.inverse();  // its rows: grad N_1, N_2, N_3
            for (std::size_t a = 0; a < 3; ++a)
                for (std::size_t d = 0; d < 3; ++d)
                    shape_[t].gradient[a][d] = gradients(Eigen::Index(a), Eigen::Index(d));
            shape_[t].volume = edges.determinant() / 6 / (h_ * h_ * h_);
        }
    });
}

double CutTetMesh::phiAt(const Vec3& X) const
{
    const double sum = trilinear(phi_, X / dx_);
    return std::abs(sum) < kSnap * dx_ ? 0 : sum;
}

/// Counts the copies of a point: tets of its star with a face in common that holds material share one.
void CutTetMesh::classify(std::uint32_t point)
{
    const std::size_t first = starStart_[point], count = starStart_[point + 1] - first;
    struct Face {
        std::array<std::uint32_t, 2> others;
        std::uint32_t tet;  // in the star
        bool material;      // by a point inside or, of an attached tet, by the shape
        auto operator<=>(const Face&) const = default;
    };
    std::vector<Face> faces;
    DisjointSets sets(count);
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t t = star_[first + i];
        if (cut_[t].fraction == 0) continue;
        for (std::size_t a = 0; a < 4; ++a)
            for (std::size_t b = 0; b < a; ++b) {
                const std::uint32_t p = tets_[t][a], q = tets_[t][b];
                if (p == point || q == point) continue;
                std::size_t opposite = 0;
                while (opposite == a || opposite == b || tets_[t][opposite] == point) ++opposite;
                const bool inside = seen_[point] < 0 || seen_[p] < 0 || seen_[q] < 0;
                const bool attached = !attached_.empty() && (attached_[t] >> opposite & 1);
                faces.push_back({{std::min(p, q), std::max(p, q)}, i, inside || attached});
            }
    }
    std::sort(faces.begin(), faces.end());
    for (std::size_t i = 1; i < faces.size(); ++i) {
        const Face &a = faces[i - 1], &b = faces[i];
        if (a.others == b.others && (a.material || b.material)) sets.join(a.tet, b.tet);
    }
    std::uint8_t copies = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        const bool material = cut_[star_[first + i]].fraction > 0;
        const std::uint32_t root = sets.find(i);
        label_[first + i] = !material ? kNone : root == i ? copies++ : label_[first + root];
    }
    assert(copies < kNone);
    copies_[point] = copies;
}

void CutTetMesh::numberNodes()
{
    firstNode_.assign(points_.size() + 1, 0);
    pointOfNode_.clear();
    for (std::uint32_t p = 0; p < points_.size(); ++p) {
        firstNode_[p] = std::uint32_t(pointOfNode_.size());
        pointOfNode_.insert(pointOfNode_.end(), copies_[p], p);
    }
    firstNode_.back() = std::uint32_t(pointOfNode_.size());
}

void CutTetMesh::makeElements()
{
    elements_.clear(), gradients_.clear(), tetOfElement_.clear();
    elementOfTet_.assign(tets_.size(), -1);
    for (std::uint32_t t = 0; t < tets_.size(); ++t) {
        if (cut_[t].fraction == 0) continue;
        CellElement e;
        e.shape = CellShape::tet;
        e.patch = patchOfTet_[t];
        for (std::size_t a = 0; a < 4; ++a) e.node[a] = firstNode_[tets_[t][a]] + label_[slot_[t][a]];
        std::fill(e.node.begin() + 4, e.node.end(), e.node[0]);
        e.fraction[0] = cut_[t].fraction * shape_[t].volume;
        elementOfTet_[t] = std::int32_t(elements_.size());
        tetOfElement_.push_back(t);
        elements_.push_back(e);
        gradients_.push_back(shape_[t].gradient);
    }
    volume_ = sumOfVolumes(*this);
}

/// Makes all elements anew; says what they were. Those of tets that were not cut again differ by numbers of nodes only.
PreviousElements CutTetMesh::replaceElements(std::span<const std::uint32_t> cutTets)
{
    PreviousElements result;
    if (cutTets.empty()) {
        result.kept = {{0, 0, std::uint32_t(elements_.size())}};
        return result;
    }
    for (std::uint32_t t : cutTets)
        if (const std::int32_t e = elementOfTet_[t]; e >= 0)
            result.replaced.push_back({std::uint32_t(e), elements_[std::size_t(e)], gradients_[std::size_t(e)]});
    const std::vector<std::int32_t> before = elementOfTet_;
    makeElements();
    auto nextCut = cutTets.begin();
    for (std::uint32_t e = 0; e < elements_.size(); ++e) {
        const std::uint32_t t = tetOfElement_[e], old = std::uint32_t(before[t]);
        nextCut = std::lower_bound(nextCut, cutTets.end(), t);
        auto& kept = result.kept;
        if (nextCut != cutTets.end() && *nextCut == t)
            result.recut.push_back({e, {old}});
        else if (!kept.empty() && kept.back().first + kept.back().count == e &&
                 kept.back().old + kept.back().count == old)
            ++kept.back().count;
        else
            kept.push_back({e, old, 1});
    }
    return result;
}

/// Stores phi and returns the points that see a change, sorted.
std::vector<std::uint32_t> CutTetMesh::takePhi(std::span<const VoxelPhi> newPhi, CutUpdate& update)
{
    std::vector<std::uint32_t> near, changed;
    for (const auto& [voxel, value] : newPhi) {
        if (!phi_.contains(voxel) || phi_(voxel) == value) continue;
        phi_.set(voxel, value);
        ++update.changedVoxels;
        for (int c = 0; c < kCorners; ++c) {
            const Coord cell = voxel - cornerOffset(c);
            auto it = std::lower_bound(pointsOfVoxelCell_.begin(), pointsOfVoxelCell_.end(), std::pair(cell, 0u));
            for (; it != pointsOfVoxelCell_.end() && it->first == cell; ++it) near.push_back(it->second);
        }
    }
    sortUnique(near);
    for (std::uint32_t p : near)
        if (const double now = phiAt(points_[p]); now != seen_[p]) {
            seen_[p] = now;
            changed.push_back(p);
        }
    return changed;
}

CutUpdate CutTetMesh::update(std::span<const VoxelPhi> newPhi)
{
    CutUpdate update;
    std::vector<std::uint32_t> tets, touched;
    for (std::uint32_t p : takePhi(newPhi, update)) {
        tets.insert(tets.end(), star_.begin() + starStart_[p], star_.begin() + starStart_[p + 1]);
        if (seen_[p] >= 0) detach(p, tets);
    }
    sortUnique(tets);
    cut(tets);
    for (std::uint32_t t : tets) touched.insert(touched.end(), tets_[t].begin(), tets_[t].end());
    sortUnique(touched);
    const std::vector<std::uint8_t> oldLabel = label_;
    const std::vector<std::uint32_t> oldFirst = firstNode_;
    for (std::uint32_t p : touched) classify(p);
    numberNodes();
    update.previousNode = previousNodes(oldLabel, oldFirst);
    update.topologyChanged = label_ != oldLabel;
    update.previousElement = replaceElements(tets);
    update.cutCells = update.groupedCells = std::int64_t(tets.size());
    update.classifiedNodes = std::int64_t(touched.size());
    return update;
}

/// Of each node the old one that any of its tets had: material only goes, so each of them had one.
std::vector<std::uint32_t> CutTetMesh::previousNodes(const std::vector<std::uint8_t>& oldLabel,
                                                     const std::vector<std::uint32_t>& oldFirst) const
{
    std::vector<std::uint32_t> previous(pointOfNode_.size());
    for (std::uint32_t p = 0; p < points_.size(); ++p)
        for (std::uint32_t s = starStart_[p]; s < starStart_[p + 1]; ++s)
            if (label_[s] != kNone) previous[firstNode_[p] + label_[s]] = oldFirst[p] + oldLabel[s];
    return previous;
}

EmbeddedSurface CutTetMesh::surface() const
{
    const auto keyOf = [](std::uint32_t in, std::uint32_t out) { return (std::uint64_t(in) + 1) << 32 | out; };
    CutPolygons soup;
    for (std::uint32_t t = 0; t < tets_.size(); ++t) {
        const TetCut& cut = cut_[t];
        if (cut.polygonSize == 0) continue;
        soup.polygons.push_back({std::uint32_t(soup.key.size()), t, 0, std::uint16_t(cut.polygonSize)});
        for (std::size_t k = 0; k < std::size_t(cut.polygonSize); ++k) {
            const std::uint32_t in = tets_[t][cut.edge[k][0]], out = tets_[t][cut.edge[k][1]];
            soup.key.push_back(keyOf(in, out));
            soup.node.push_back(cut.t[k] == 1 ? keyOf(out, out) : 0);
            soup.torn.push_back(wasMaterial_[out]);
        }
    }
    return surfaceOf(*this, soup, [&](const CutPolygons::Polygon& polygon, std::uint32_t corner) {
        const TetCut& cut = cut_[polygon.cell];
        const std::size_t k = corner - polygon.firstCorner;
        EmbeddedPoint p;
        std::copy_n(elements_[std::size_t(elementOfTet_[polygon.cell])].node.begin(), 4, p.node.begin());
        p.weight[cut.edge[k][0]] = 1 - cut.t[k];
        p.weight[cut.edge[k][1]] = cut.t[k];
        return p;
    });
}

PhiTets CutTetMesh::phiTets(double depth) const
{
    PhiTets result;
    for (std::uint32_t e = 0; e < elements_.size(); ++e) {
        PhiTet tet{e, 0, {}, {}};
        std::copy_n(elements_[e].node.begin(), 4, tet.node.begin());
        for (std::size_t a = 0; a < 4; ++a) tet.phi[a] = float(seen_[tets_[tetOfElement_[e]][a]]);
        const auto [least, most] = std::minmax_element(tet.phi.begin(), tet.phi.end());
        if (double(*most) >= -depth && *least < 0) result.tets.push_back(tet);
    }
    return result;
}

/// A scene without fracture never needs them.
const NodalWeights& CutTetMesh::weights() const
{
    std::call_once(weights_->made, [&] { weights_->weights.emplace(points_, tets_, dx_); });
    return *weights_->weights;
}

std::vector<Coord> CutTetMesh::voxelsAbove(std::span<const double> density, double threshold) const
{
    std::vector<Coord> voxels;
    for (std::size_t e = 0; e < elements_.size(); ++e)
        if (density[e * kMaxTets] > threshold)
            weights().eachVoxel(tetOfElement_[e], [&](Coord v) { voxels.push_back(v); });
    sortUniqueCoords(voxels);
    return voxels;
}

/// A tet with X in it has a share of a voxel node beside X.
std::vector<std::uint32_t> CutTetMesh::elementsRound(const Vec3& X) const
{
    const Coord low{int(std::floor(X.x() / dx_)), int(std::floor(X.y() / dx_)), int(std::floor(X.z() / dx_))};
    std::vector<std::uint32_t> found;
    for (int c = 0; c < kCorners; ++c)
        for (const NodalWeights::Weight& w : weights().at(low + cornerOffset(c)))
            if (elementOfTet_[w.tet] >= 0) found.push_back(std::uint32_t(elementOfTet_[w.tet]));
    sortUnique(found);
    return found;
}

/// A tet that is cut counts with the share of it that is material.
void CutTetMesh::addTetsRound(Coord voxel, std::vector<TetShare>& tets) const
{
    for (const NodalWeights::Weight& w : weights().at(voxel))
        if (elementOfTet_[w.tet] >= 0)
            tets.push_back({std::uint32_t(elementOfTet_[w.tet]), 0, double(w.volume) * cut_[w.tet].fraction});
}

}  // namespace vdbfrac::tetmesh
