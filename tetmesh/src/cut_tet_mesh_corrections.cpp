// A cut mesh of tets, and the true shape of the body at rest.
#include "true_share.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/cut_tet_mesh.h>

#include <algorithm>
#include <numeric>

namespace vdbfrac::tetmesh {

void CutTetMesh::cut(std::span<const std::uint32_t> tets)
{
    parallelChunks(tets.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const auto& v = tets_[tets[i]];
            TetCut& cut = cut_[tets[i]];
            cut = cutTet({points_[v[0]], points_[v[1]], points_[v[2]], points_[v[3]]},
                         {seen_[v[0]], seen_[v[1]], seen_[v[2]], seen_[v[3]]});
            if (correction_.empty()) continue;
            const double factor = correction_[tets[i]];
            if (cut.fraction > 0 && factor != 1)
                scale(cut, factor);
            else if (attached_[tets[i]])
                cut = wholeCut(factor);
        }
    });
}

std::vector<std::uint32_t> CutTetMesh::allTets() const
{
    std::vector<std::uint32_t> all(tets_.size());
    std::iota(all.begin(), all.end(), 0u);
    return all;
}

/// After the first cut, which is linear: finds how it differs from the shape, and cuts again.
void CutTetMesh::correct(const RestShape& shape)
{
    correction_.assign(tets_.size(), 1);
    attached_.assign(tets_.size(), 0);
    parallelChunks(tets_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        TrueShare share(shape, dx_);
        for (std::size_t t = begin; t < end; ++t) {
            const auto& v = tets_[t];
            if (std::all_of(v.begin(), v.end(), [&](std::uint32_t p) { return seen_[p] < 0; })) continue;
            const double part = share.of({points_[v[0]], points_[v[1]], points_[v[2]], points_[v[3]]});
            const double linear = cut_[t].fraction;
            correction_[t] = linear > 0 ? correction(part, linear) : part >= kMinShare ? part : 0.;
            if (linear == 0 && part >= kMinShare) attached_[t] = share.faces();
        }
    });
    attach();
    cut(allTets());
}

/// Finds what tets with material and no point inside hang on.
void CutTetMesh::attach()
{
    struct Face {
        std::array<std::uint32_t, 3> point;
        std::uint32_t tet, opposite;
        bool material;
        bool operator<(const Face& other) const { return point < other.point; }
    };
    std::vector<Face> faces;
    for (std::uint32_t t = 0; t < tets_.size(); ++t)
        for (std::size_t a = 0; a < 4; ++a) {
            Face face{{tets_[t][(a + 1) % 4], tets_[t][(a + 2) % 4], tets_[t][(a + 3) % 4]},
                      t,
                      tets_[t][a],
                      (attached_[t] >> a & 1) != 0};
            if (std::any_of(face.point.begin(), face.point.end(), [&](std::uint32_t p) { return seen_[p] < 0; }))
                continue;
            std::sort(face.point.begin(), face.point.end());
            faces.push_back(face);
        }
    std::sort(faces.begin(), faces.end());
    for (std::size_t i = 1; i < faces.size(); ++i) {
        if (faces[i].point != faces[i - 1].point) continue;
        for (const auto& [own, other] : {std::pair(faces[i], faces[i - 1]), std::pair(faces[i - 1], faces[i])})
            if (own.material && seen_[other.opposite] < 0) anchors_.push_back({other.opposite, own.tet});
    }
    std::sort(anchors_.begin(), anchors_.end());
    std::vector<std::uint8_t> hangs(tets_.size(), 0);
    for (const auto& [point, tet] : anchors_) hangs[tet] = attached_[tet];
    attached_ = std::move(hangs);
}

/// Adds the tets that went with a point.
void CutTetMesh::detach(std::uint32_t point, std::vector<std::uint32_t>& tets)
{
    auto it = std::lower_bound(anchors_.begin(), anchors_.end(), std::pair(point, 0u));
    for (; it != anchors_.end() && it->first == point; ++it) {
        attached_[it->second] = 0;
        tets.push_back(it->second);
    }
}

}  // namespace vdbfrac::tetmesh
