#include <vdbfrac/tetmesh/material_tets.h>

#include "weld.h"

#include <vdbfrac/base/parallel.h>

#include <algorithm>
#include <array>
#include <span>
#include <utility>

namespace vdbfrac::tetmesh {

namespace {

constexpr std::size_t kCellChunk = 512;
constexpr std::uint32_t kUnused = ~0u;

using Tet = std::array<std::uint32_t, 4>;
using Prism = std::array<std::uint32_t, 6>;  // a triangle, and the one its normal points to, in the same order

/// What the chunks of cells made, one after the other.
template <class T>
std::vector<T> joined(const std::vector<std::vector<T>>& parts)
{
    std::size_t count = 0;
    for (const auto& p : parts) count += p.size();
    std::vector<T> all;
    all.reserve(count);
    for (const auto& p : parts) all.insert(all.end(), p.begin(), p.end());
    return all;
}

/// Runs visit(cell, part) over all cells in parallel and joins the parts in the order of the cells.
template <class T, class Visit>
std::vector<T> fromCells(const CutMesh& cut, const Visit& visit)
{
    std::vector<std::vector<T>> parts((cut.cells().size() + kCellChunk - 1) / kCellChunk);
    parallelChunks(cut.cells().size(), kCellChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) visit(cut.cells()[i], parts[begin / kCellChunk]);
    });
    return joined(parts);
}

/// A sub-tet with its inside vertices first, in an order that keeps its volume positive.
struct Sorted {
    std::array<Coord, 4> voxel;
    int inside = 0;
};

Sorted sorted(const std::array<Coord, 4>& voxel, const std::array<bool, 4>& inside)
{
    Sorted s;
    std::array<std::size_t, 4> order{};
    std::size_t n = 0;
    for (std::size_t a = 0; a < 4; ++a)
        if (inside[a]) order[n++] = a;
    s.inside = int(n);
    for (std::size_t a = 0; a < 4; ++a)
        if (!inside[a]) order[n++] = a;
    int inversions = 0;
    for (std::size_t a = 0; a < 4; ++a)
        for (std::size_t b = a + 1; b < 4; ++b) inversions += order[a] > order[b];
    if (inversions & 1) s.inside < 2 ? std::swap(order[2], order[3]) : std::swap(order[0], order[1]);
    for (std::size_t a = 0; a < 4; ++a) s.voxel[a] = voxel[order[a]];
    return s;
}

/// A prism as three tets. Each four-sided side is divided from its lowest point.
void divide(Prism p, std::vector<Tet>& tets)
{
    const std::size_t lowest = std::size_t(std::min_element(p.begin(), p.end()) - p.begin());
    if (lowest >= 3) p = {p[3], p[5], p[4], p[0], p[2], p[1]};  // from the other triangle, which keeps the orientation
    while (p[0] != *std::min_element(p.begin(), p.end())) p = {p[1], p[2], p[0], p[4], p[5], p[3]};
    if (std::min(p[1], p[5]) < std::min(p[2], p[4]))
        tets.insert(tets.end(), {Tet{p[0], p[1], p[2], p[5]}, Tet{p[0], p[1], p[5], p[4]}});
    else
        tets.insert(tets.end(), {Tet{p[0], p[1], p[2], p[4]}, Tet{p[0], p[4], p[2], p[5]}});
    tets.push_back({p[0], p[4], p[5], p[3]});
}

/// Where the surface crosses the edge from a voxel node inside to one outside.
struct Crossing {
    std::uint64_t key;
    Coord in, out;
};

/// Divides the material into tets. Points: inside voxel nodes, then crossings.
class MaterialDivider {
public:
    explicit MaterialDivider(const CutMesh& cut) : cut_(cut), keyOrigin_(cut.phi().lower() - Coord{1, 1, 1})
    {
        numberVoxels();
        crossings_ = fromCells<Crossing>(cut, [&](const Cell& cell, auto& part) {
            forSubTets(
                cell,
                [&](const Sorted& s) {
                    for (int a = 0; a < s.inside; ++a)
                        for (int b = s.inside; b < 4; ++b) part.push_back(crossing(s, a, b));
                },
                false);
        });
        const auto byKey = [](const Crossing& a, const Crossing& b) { return a.key < b.key; };
        std::sort(crossings_.begin(), crossings_.end(), byKey);
        crossings_.erase(std::unique(crossings_.begin(), crossings_.end(),
                                     [](const Crossing& a, const Crossing& b) { return a.key == b.key; }),
                         crossings_.end());
    }

    TetMesh run()
    {
        TetMesh mesh;
        mesh.points = points();
        mesh.tets = fromCells<Tet>(cut_, [&](const Cell& cell, auto& part) {
            forSubTets(
                cell, [&](const Sorted& s) { addTets(s, part); }, true);
        });
        mesh.boundary = surfaceOf(mesh.tets);
        return mesh;
    }

private:
    void numberVoxels()
    {
        const auto& phi = cut_.phi();
        number_ = NodeField<std::uint32_t>(phi.lower(), phi.upper(), kUnused, kUnused);
        phi.forEachBlock([&](Coord low) {
            for (int n = 0; n < NodeField<float>::kBlock; ++n) {
                const Coord c = low + Coord{n & 7, n >> 3 & 7, n >> 6};
                if (!(cut_.seenPhi(c) < 0)) continue;
                number_.set(c, std::uint32_t(voxels_.size()));
                voxels_.push_back(c);
            }
        });
    }

    /// Calls visit for the sub-tets of a cell that have material: all, or those that are cut.
    template <class Visit>
    void forSubTets(const Cell& cell, const Visit& visit, bool all) const
    {
        if (cell.whole && !all) return;
        const CellStencil& stencil = cut_.stencil(cut_.lattice().shapeOf(cell.coord));
        const Coord base = cut_.lattice().coarsening * cell.coord;
        const std::size_t count = cell.whole ? stencil.subTets.size() : cell.pieces.size();
        for (std::size_t n = 0; n < count; ++n) {
            const SubTet& sub = stencil.subTets[cell.whole ? n : cell.pieces[n].subTet];
            std::array<Coord, 4> voxel;
            std::array<bool, 4> inside{};
            for (std::size_t a = 0; a < 4; ++a) {
                voxel[a] = base + stencil.vertices[sub.vertex[a]];
                inside[a] = number_(voxel[a]) != kUnused;
            }
            const Sorted s = sorted(voxel, inside);
            if (s.inside > 0 && (all || s.inside < 4)) visit(s);
        }
    }

    Crossing crossing(const Sorted& s, int in, int out) const
    {
        const Coord a = s.voxel[std::size_t(in)], b = s.voxel[std::size_t(out)];
        return {crossingKey(a, b, keyOrigin_), a, b};
    }

    std::uint32_t idOf(const Sorted& s, int in, int out) const
    {
        const std::uint64_t key = crossing(s, in, out).key;
        const auto at = std::lower_bound(crossings_.begin(), crossings_.end(), key,
                                         [](const Crossing& c, std::uint64_t k) { return c.key < k; });
        return std::uint32_t(voxels_.size() + std::size_t(at - crossings_.begin()));
    }

    void addTets(const Sorted& s, std::vector<Tet>& tets) const
    {
        const auto node = [&](int a) { return number_(s.voxel[std::size_t(a)]); };
        const auto cross = [&](int in, int out) { return idOf(s, in, out); };
        switch (s.inside) {
        case 4: tets.push_back({node(0), node(1), node(2), node(3)}); break;
        case 3: divide({node(0), node(1), node(2), cross(0, 3), cross(1, 3), cross(2, 3)}, tets); break;
        case 2: divide({node(0), cross(0, 2), cross(0, 3), node(1), cross(1, 2), cross(1, 3)}, tets); break;
        default: tets.push_back({node(0), cross(0, 1), cross(0, 2), cross(0, 3)});
        }
    }

    std::vector<Vec3> points() const
    {
        const double dx = cut_.lattice().voxelSize;
        std::vector<Vec3> points(voxels_.size() + crossings_.size());
        parallelChunks(points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                if (i < voxels_.size()) {
                    points[i] = dx * voxels_[i].toVec();
                    continue;
                }
                const Crossing& c = crossings_[i - voxels_.size()];
                // A crossing on the very node would give tets without volume, and surfaces that touch themselves.
                const double a = cut_.seenPhi(c.in), b = std::max(cut_.seenPhi(c.out), kSnap * dx);
                points[i] = dx * (c.in.toVec() + a / (a - b) * (c.out - c.in).toVec());
            }
        });
        return points;
    }

    /// The faces whose corners are all crossings, outward.
    std::vector<std::array<std::uint32_t, 3>> surfaceOf(const std::vector<Tet>& tets) const
    {
        std::vector<std::array<std::uint32_t, 3>> surface;
        for (const Tet& tet : tets)
            for (const auto& f : kTetFaces)
                if (std::min({tet[f[0]], tet[f[1]], tet[f[2]]}) >= voxels_.size())
                    surface.push_back({tet[f[0]], tet[f[1]], tet[f[2]]});
        return surface;
    }

    const CutMesh& cut_;
    Coord keyOrigin_;
    NodeField<std::uint32_t> number_;  // of voxel nodes inside
    std::vector<Coord> voxels_;
    std::vector<Crossing> crossings_;  // by key, each once
};

}  // namespace

WholeTets wholeTets(const CutMesh& cut)
{
    WholeTets whole;
    std::vector<std::uint32_t> number(cut.nodeCount(), kUnused);
    for (const CellElement& e : cut.elements()) {
        const CellTets& tets = cellTets(e.shape);
        for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
            if (!(e.fraction[t] > 0)) continue;
            Tet tet;
            for (std::size_t a = 0; a < 4; ++a) {
                const std::uint32_t node = e.node[std::size_t(tets.corner[t][a])];
                if (number[node] == kUnused) {
                    number[node] = std::uint32_t(whole.mesh.points.size());
                    whole.mesh.points.push_back(cut.restPosition(node));
                }
                tet[a] = number[node];
            }
            whole.mesh.tets.push_back(tet);
            whole.fraction.push_back(e.fraction[t]);
        }
    }
    whole.mesh.boundary = boundaryOf(whole.mesh.tets);
    return whole;
}

TetMesh materialTets(const CutMesh& cut) { return MaterialDivider(cut).run(); }

}  // namespace vdbfrac::tetmesh
