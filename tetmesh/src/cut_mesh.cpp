#include <vdbfrac/tetmesh/cut_mesh.h>

#include "body_volume.h"
#include "coord_ranges.h"
#include "true_share.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>

#include <cassert>
#include <cmath>
#include <numeric>
#include <string>

namespace vdbfrac::tetmesh {

namespace {

constexpr std::size_t kCutChunk = 64;

/// All coordinates that were set in a mark field, in the field's fixed order.
std::vector<Coord> markedCoords(const NodeField<std::int32_t>& marks)
{
    std::vector<Coord> coords;
    marks.forEachBlock([&](Coord low) {
        marks.forEachNode(low, [&](Coord c) {
            if (marks(c) >= 0) coords.push_back(c);
        });
    });
    return coords;
}

std::vector<std::uint32_t> allUpTo(std::size_t count)
{
    std::vector<std::uint32_t> all(count);
    std::iota(all.begin(), all.end(), 0u);
    return all;
}

/// Collects indices below a bound, each once.
class IndexSet {
public:
    explicit IndexSet(std::size_t bound) : has_(bound) {}
    void add(std::int32_t i)
    {
        if (i < 0 || has_[std::size_t(i)]) return;
        has_[std::size_t(i)] = 1;
        found_.push_back(std::uint32_t(i));
    }
    std::vector<std::uint32_t> sorted() &&
    {
        std::sort(found_.begin(), found_.end());
        return std::move(found_);
    }

private:
    std::vector<std::uint8_t> has_;
    std::vector<std::uint32_t> found_;
};

}  // namespace

CutMesh::CutMesh(Lattice lattice, NodeField<float> phi, const RestShape& shape)
    : lattice_(lattice), phi_(std::move(phi)), rest_(phi_), corrections_(1)
{
    const int most = lattice_.kind == Lattice::Kind::six ? kMaxCoarsening : 1;
    if (lattice_.coarsening < 1 || lattice_.coarsening > most)
        throw Error("a lattice of " + std::to_string(lattice_.coarsening) + " voxels to a cell; 1 to " +
                    std::to_string(most) + " are possible");
    for (CellShape shape : {CellShape::six, CellShape::fiveEven, CellShape::fiveOdd})
        if ((shape == CellShape::six) == (lattice_.kind == Lattice::Kind::six))
            cellStencil_[std::size_t(shape)] = makeCellStencil(lattice_, shape);
    starStencil_ = {makeStarStencil(lattice_, false), makeStarStencil(lattice_, true)};
    findCells();
    findLatticeNodes();
    const std::vector<std::uint32_t> all = allUpTo(cells_.size());
    cutCells(all);
    if (shape && !lattice_.wholeTets) correct(shape);
    reclassify(allUpTo(latticeNodes_.size()));
    numberNodes();
    placeElements(regroup(all), {});
    volume_ = sumOfVolumes(*this);
}

double CutMesh::seenPhi(Coord voxel) const { return seen(phi_(voxel)); }

double CutMesh::seen(double value) const
{
    // Whole tets end at the first nodes that are not material. Those lie as often within half a voxel inside of the
    // surface as outside, so the volume is right in the mean; what is cut off of them keeps the surface closed.
    constexpr double kInside = 0.5, kCutOff = 0.01;  // voxels
    if (lattice_.wholeTets) return lattice_.voxelSize * (value < -kInside * lattice_.voxelSize ? -1 : kCutOff);
    return std::abs(value) < kSnap * lattice_.voxelSize ? 0. : value;
}

void CutMesh::seenPhi(Coord base, std::span<const Coord> offsets, std::vector<double>& phi) const
{
    phi.resize(offsets.size());
    for (std::size_t v = 0; v < phi.size(); ++v) phi[v] = seenPhi(base + offsets[v]);
}

void CutMesh::findCells()
{
    const int m = lattice_.coarsening;
    const Coord lower = phi_.lower(), upper = phi_.upper();
    const Coord first{floorDiv(lower.x, m) - 1, floorDiv(lower.y, m) - 1, floorDiv(lower.z, m) - 1};
    const Coord last{floorDiv(upper.x, m) + 1, floorDiv(upper.y, m) + 1, floorDiv(upper.z, m) + 1};
    cellIndex_ = NodeField<std::int32_t>(first, last, -1, 0);
    phi_.forEachBlock([&](Coord low) {
        phi_.forEachNode(low, [&](Coord voxel) {
            if (seenPhi(voxel) < 0) forCellsRound(voxel, m, [&](Coord cell) { cellIndex_.set(cell, 0); });
        });
    });
    std::vector<Coord> found = markedCoords(cellIndex_);
    sortByPatch(found);
    const Coord size = patchOf(last) + Coord{1, 1, 1};
    for (std::size_t i = 0; i < found.size(); ++i) {
        const Coord p = patchOf(found[i]);
        cellIndex_.set(found[i], std::int32_t(i));
        cells_.push_back(Cell{found[i], std::uint32_t((p.z * size.y + p.y) * size.x + p.x), true, 0, 0, 0, {}});
    }
}

/// Blocks of 8^3 cells, counted from the box of phi: its place does not change while material goes.
Coord CutMesh::patchOf(Coord cell) const
{
    const int m = lattice_.coarsening;
    const Coord low = phi_.lower() + Coord{1, 1, 1};  // a layer below the lowest material voxel
    return {(cell.x - floorDiv(low.x, m)) >> 3, (cell.y - floorDiv(low.y, m)) >> 3, (cell.z - floorDiv(low.z, m)) >> 3};
}

void CutMesh::sortByPatch(std::vector<Coord>& coords) const
{
    std::sort(coords.begin(), coords.end(), [&](Coord a, Coord b) {
        const Coord pa = patchOf(a), pb = patchOf(b);
        return pa != pb ? pa < pb : a < b;
    });
}

void CutMesh::findLatticeNodes()
{
    latticeIndex_ = NodeField<std::int32_t>(cellIndex_.lower(), cellIndex_.upper() + Coord{1, 1, 1}, -1, 0);
    for (const Cell& cell : cells_)
        for (int c = 0; c < kCorners; ++c) latticeIndex_.set(cornerOf(cell.coord, c), 0);
    latticeNodes_ = markedCoords(latticeIndex_);
    sortByPatch(latticeNodes_);
    for (std::size_t i = 0; i < latticeNodes_.size(); ++i) latticeIndex_.set(latticeNodes_[i], std::int32_t(i));
    copies_.assign(latticeNodes_.size(), 0);
}

std::vector<std::uint32_t> CutMesh::cellsTouching(const std::vector<Coord>& voxels) const
{
    IndexSet touched(cells_.size());
    for (Coord voxel : voxels)
        forCellsRound(voxel, lattice_.coarsening, [&](Coord cell) { touched.add(cellIndex_(cell)); });
    return std::move(touched).sorted();
}

std::vector<std::uint32_t> CutMesh::latticeNodesTouching(const std::vector<Coord>& voxels) const
{
    const int m = lattice_.coarsening;
    IndexSet touched(latticeNodes_.size());
    for (Coord v : voxels) {
        forCellsRound(v, m, [&](Coord cell) {
            if (!hasAttached(cell)) return;
            for (int c = 0; c < kCorners; ++c) touched.add(latticeIndex_(cornerOf(cell, c)));
        });
        forBox({ceilDiv(v.x - m, m), ceilDiv(v.y - m, m), ceilDiv(v.z - m, m)},
               {floorDiv(v.x + m, m), floorDiv(v.y + m, m), floorDiv(v.z + m, m)}, [&](Coord node) {
                   const std::int32_t vertex = star(node).find(v - m * node);
                   if (vertex >= 0 && std::size_t(vertex) < star(node).ofTets) touched.add(latticeIndex_(node));
               });
    }
    return std::move(touched).sorted();
}

/// Cuts cells; returns those whose elements may not be what they were. Inside the band phi changes in many cells that
/// stay whole.
std::vector<std::uint32_t> CutMesh::cutCells(const std::vector<std::uint32_t>& cells)
{
    std::vector<std::uint8_t> differs(cells.size());
    parallelChunks(cells.size(), kCutChunk, [&](std::size_t begin, std::size_t end) {
        std::vector<double> phi;
        for (std::size_t i = begin; i < end; ++i) differs[i] = cutCell(cells_[cells[i]], phi);
    });
    std::vector<std::uint32_t> found;
    for (std::size_t i = 0; i < cells.size(); ++i)
        if (differs[i]) found.push_back(cells[i]);
    return found;
}

/// `phi`: scratch. Returns false for a cell that was whole and is.
bool CutMesh::cutCell(Cell& cell, std::vector<double>& phi) const
{
    const CellStencil& stencil = cellStencil_[std::size_t(lattice_.shapeOf(cell.coord))];
    seenPhi(lattice_.coarsening * cell.coord, stencil.vertices, phi);
    const bool wasWhole = cell.whole;
    cell.pieces.clear();
    cell.whole = std::all_of(phi.begin(), phi.end(), [](double p) { return p < 0; });
    if (cell.whole) return !wasWhole;
    const Corrections& own = corrections_[cell.corrections];
    for (std::size_t s = 0; s < stencil.subTets.size(); ++s) {
        const auto& corner = stencil.subTets[s].vertex;
        const std::array<double, 4> value{phi[corner[0]], phi[corner[1]], phi[corner[2]], phi[corner[3]]};
        if (*std::min_element(value.begin(), value.end()) >= 0) {
            if (isAttached(cell, s)) cell.pieces.push_back({std::uint16_t(s), 0, wholeCut(own.factor[s])});
            continue;
        }
        std::array<Vec3, 4> vertex;
        for (std::size_t a = 0; a < 4; ++a) vertex[a] = stencil.vertices[corner[a]].toVec();
        cell.pieces.push_back({std::uint16_t(s), 0, cutTet(vertex, value)});
        if (!own.factor.empty() && own.factor[s] != 1) scale(cell.pieces.back().cut, own.factor[s]);
    }
    return true;
}

CutUpdate CutMesh::update(std::span<const VoxelPhi> newPhi)
{
    std::vector<Coord> changed, left;  // voxel nodes seen differently; those that are no longer material
    for (const auto& [voxel, value] : newPhi) {
        if (!phi_.contains(voxel)) continue;  // far outside: no cell of ours looks there
        const double before = seenPhi(voxel);
        phi_.set(voxel, value);
        const double now = seenPhi(voxel);
        assert(now >= before && "material never grows");
        if (now == before) continue;
        changed.push_back(voxel);
        if (before < 0 && now >= 0) left.push_back(voxel);
    }
    sortUnique(changed), sortUnique(left);  // a voxel may be listed twice
    CutUpdate update;
    update.changedVoxels = std::int64_t(changed.size());
    if (changed.empty()) {
        update.previousNode = allUpTo(nodes_.size());
        update.previousElement.kept = {{0, 0, std::uint32_t(elements_.size())}};
        return update;
    }
    const std::vector<std::uint32_t> cells = cellsTouching(changed);
    const std::vector<std::uint32_t> dirty = latticeNodesTouching(left);
    std::vector<std::uint32_t> different = cutCells(cells);
    addCellsRound(dirty, different);
    Renumbering numbering = renumber(reclassify(dirty));
    const Regrouped regrouped = regroup(std::move(different));
    update.previousElement = previousElements(regrouped, numbering.previous);
    placeElements(regrouped, numbering);
    volume_ = sumOfVolumes(*this);
    update.previousNode = std::move(numbering.previous);
    update.cutCells = std::int64_t(cells.size());
    update.classifiedNodes = std::int64_t(dirty.size());
    update.groupedCells = std::int64_t(regrouped.cells.size());
    update.topologyChanged = !left.empty();
    return update;
}

}  // namespace vdbfrac::tetmesh
