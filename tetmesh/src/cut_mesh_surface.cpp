#include <vdbfrac/tetmesh/cut_mesh_surface.h>

#include "weld.h"

#include <vdbfrac/base/parallel.h>

#include <Eigen/Dense>

#include <algorithm>

namespace vdbfrac::tetmesh {

namespace {

constexpr std::size_t kCellChunk = 1024;

/// Voxel offsets, in a cell, of the ends of the edge that a polygon's corner lies on.
struct Crossing {
    Coord in, out;
    double t;
};

Crossing crossing(const CellStencil& stencil, const Piece& piece, std::size_t k)
{
    const SubTet& sub = stencil.subTets[piece.subTet];
    return {stencil.vertices[sub.vertex[piece.cut.edge[k][0]]], stencil.vertices[sub.vertex[piece.cut.edge[k][1]]],
            piece.cut.t[k]};
}

void addCell(CutPolygons& soup, const CutMesh& mesh, std::uint32_t index)
{
    const Cell& cell = mesh.cells()[index];
    const CellStencil& stencil = mesh.stencil(mesh.lattice().shapeOf(cell.coord));
    const Coord base = mesh.lattice().coarsening * cell.coord, lower = mesh.phi().lower() - Coord{1, 1, 1};
    for (std::size_t n = 0; n < cell.pieces.size(); ++n) {
        const Piece& piece = cell.pieces[n];
        if (piece.cut.polygonSize == 0) continue;
        soup.polygons.push_back(
            {std::uint32_t(soup.key.size()), index, std::uint16_t(n), std::uint16_t(piece.cut.polygonSize)});
        for (std::size_t k = 0; k < std::size_t(piece.cut.polygonSize); ++k) {
            const Crossing c = crossing(stencil, piece, k);
            soup.key.push_back(crossingKey(base + c.in, base + c.out, lower));
            soup.node.push_back(c.t == 1 ? crossingKey(base + c.out, base + c.out, lower) : 0);
            soup.torn.push_back(mesh.wasMaterial(base + c.out));
        }
    }
}

/// The polygons of all cells, in their order.
CutPolygons gatherPolygons(const CutMesh& mesh)
{
    const std::size_t cells = mesh.cells().size();
    std::vector<CutPolygons> part((cells + kCellChunk - 1) / kCellChunk);
    parallelChunks(cells, kCellChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) addCell(part[begin / kCellChunk], mesh, std::uint32_t(i));
    });
    CutPolygons soup;
    for (const CutPolygons& p : part) soup.add(p);
    return soup;
}

/// The place of a corner of a polygon.
EmbeddedPoint embedCorner(const CutMesh& mesh, const CutPolygons::Polygon& polygon, std::uint32_t corner)
{
    const Cell& cell = mesh.cells()[polygon.cell];
    const Piece& piece = cell.pieces[polygon.piece];
    const CellElement& element = mesh.elements()[cell.firstElement + piece.element];
    const CellStencil& stencil = mesh.stencil(element.shape);
    const Crossing c = crossing(stencil, piece, corner - polygon.firstCorner);
    return embed(mesh, element, stencil.subTets[piece.subTet].parent, c.in.toVec() + c.t * (c.out - c.in).toVec());
}

}  // namespace

EmbeddedPoint embed(const CutMesh& mesh, const CellElement& element, int tet, const Vec3& local)
{
    const CellTets& tets = cellTets(element.shape);
    const auto& corner = tets.corner[std::size_t(tet)];
    const auto& gradient = tets.gradient[std::size_t(tet)];
    const int c0 = corner[0];
    const Vec3 d = local / mesh.lattice().coarsening - Vec3(c0 & 1, c0 >> 1 & 1, c0 >> 2 & 1);
    EmbeddedPoint p;
    for (std::size_t a = 0; a < 4; ++a) {
        p.node[a] = element.node[std::size_t(corner[a])];
        p.weight[a] = (a == 0 ? 1 : 0) + gradient[a][0] * d.x() + gradient[a][1] * d.y() + gradient[a][2] * d.z();
    }
    return p;
}

EmbeddedSurface extractSurface(const CutMesh& mesh)
{
    return surfaceOf(mesh, gatherPolygons(mesh), [&](const CutPolygons::Polygon& polygon, std::uint32_t corner) {
        return embedCorner(mesh, polygon, corner);
    });
}

EmbeddedSurface CutMesh::surface() const { return extractSurface(*this); }

namespace {

/// Barycentric coordinates in the parts of a stencil from those in their tets.
std::vector<TetMatrix> insideParts(const CutMesh& mesh, CellShape shape)
{
    const CellStencil& stencil = mesh.stencil(shape);
    CellElement unit;
    unit.shape = shape;
    std::vector<TetMatrix> inside;
    for (const SubTet& sub : stencil.subTets) {
        Eigen::Matrix4d corners;  // in the tet, a column each
        for (int k = 0; k < 4; ++k) {
            const EmbeddedPoint p = embed(mesh, unit, sub.parent, stencil.vertices[sub.vertex[std::size_t(k)]].toVec());
            for (int a = 0; a < 4; ++a) corners(a, k) = p.weight[std::size_t(a)];
        }
        const Eigen::Matrix4d back = corners.inverse();
        inside.emplace_back();
        for (int k = 0; k < 4; ++k)
            for (int a = 0; a < 4; ++a) inside.back()[std::size_t(k)][std::size_t(a)] = back(k, a);
    }
    return inside;
}

}  // namespace

PhiTets CutMesh::phiTets(double depth) const
{
    constexpr CellShape kShapes[] = {CellShape::six, CellShape::fiveEven, CellShape::fiveOdd};
    PhiTets result;
    std::array<std::uint32_t, 3> first{};
    for (CellShape shape : kShapes) {
        if ((shape == CellShape::six) != (lattice_.kind == Lattice::Kind::six)) continue;
        first[std::size_t(shape)] = std::uint32_t(result.inside.size());
        for (const TetMatrix& m : insideParts(*this, shape)) result.inside.push_back(m);
    }
    const auto add = [&](std::uint32_t element, std::size_t subTet, const std::vector<double>& phi,
                         std::vector<PhiTet>& tets) {
        const CellElement& e = elements_[element];
        const SubTet& sub = stencil(e.shape).subTets[subTet];
        std::array<double, 4> value;
        for (std::size_t k = 0; k < 4; ++k) value[k] = phi[sub.vertex[k]];
        if (*std::max_element(value.begin(), value.end()) < -depth) return;
        if (*std::min_element(value.begin(), value.end()) >= 0) return;  // attached: it has no surface
        const std::uint32_t part = first[std::size_t(e.shape)] + std::uint32_t(subTet);
        PhiTet tet{element, lattice_.coarsening > 1 ? part : 0, {}, {}};
        for (std::size_t a = 0; a < 4; ++a) {
            tet.node[a] = e.node[std::size_t(cellTets(e.shape).corner[sub.parent][a])];
            double sum = 0;
            for (std::size_t k = 0; k < 4; ++k) sum += result.inside[part][k][a] * value[k];
            tet.phi[a] = float(sum);
        }
        tets.push_back(tet);
    };
    result.tets = gatherChunks<PhiTet>(cells_.size(), kCellChunk,
                                       [&](std::size_t begin, std::size_t end, std::vector<PhiTet>& tets) {
                                           std::vector<double> phi;
                                           for (const Cell& cell : std::span(cells_).subspan(begin, end - begin)) {
                                               const CellStencil& s = stencil(lattice_.shapeOf(cell.coord));
                                               seenPhi(lattice_.coarsening * cell.coord, s.vertices, phi);
                                               if (cell.whole && *std::max_element(phi.begin(), phi.end()) < -depth)
                                                   continue;
                                               for (std::size_t n = 0; cell.whole && n < s.subTets.size(); ++n)
                                                   add(cell.firstElement, n, phi, tets);
                                               for (const Piece& piece : cell.pieces)
                                                   add(cell.firstElement + piece.element, piece.subTet, phi, tets);
                                           }
                                       });
    return result;
}

}  // namespace vdbfrac::tetmesh
