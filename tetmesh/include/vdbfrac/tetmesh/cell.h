// How a lattice cell is divided into tets.
//
// Corner c of a cell sits at (c & 1, c >> 1 & 1, c >> 2 & 1), in units of the lattice spacing h.
//   six   Kuhn: one tet for each order (a, b, c) of the axes, through corners 0, a, a+b, 7. Refined grids nest in it.
//   five  four tets at alternate corners and one in the middle; neighbouring cells are mirrored (even, odd).
// A tet of any shape is a cell of its own, "tet": its volume counts as h^3, its gradients are kept beside it.
// Symbols: N_a shape function of tet vertex a; gradient = grad N_a * h; volume = tet volume / h^3.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace vdbfrac::tetmesh {

enum class CellShape : std::uint8_t { six, fiveEven, fiveOdd, tet };

inline constexpr int kCorners = 8;
inline constexpr int kMaxTets = 6;

/// Place of tet t of element e among values of all tets of all elements.
constexpr std::size_t tetEntry(std::size_t element, std::size_t tet) { return element * kMaxTets + tet; }

/// The rest shape of a tet that is a cell of its own: h grad N_a of vertices 1, 2, 3; that of vertex 0 is minus their
/// sum.
using TetGradients = std::array<std::array<double, 3>, 3>;

struct CellTets {
    int count = 0;
    std::array<std::array<int, 4>, kMaxTets> corner{};
    std::array<std::array<std::array<double, 3>, 4>, kMaxTets> gradient{};
    std::array<double, kMaxTets> volume{};
};

namespace detail {

struct Int3 {
    int v[3];
};
constexpr Int3 cornerPoint(int c) { return {{c & 1, c >> 1 & 1, c >> 2 & 1}}; }
constexpr Int3 minus(Int3 a, Int3 b) { return {{a.v[0] - b.v[0], a.v[1] - b.v[1], a.v[2] - b.v[2]}}; }
constexpr Int3 cross(Int3 a, Int3 b)
{
    return {{a.v[1] * b.v[2] - a.v[2] * b.v[1], a.v[2] * b.v[0] - a.v[0] * b.v[2], a.v[0] * b.v[1] - a.v[1] * b.v[0]}};
}
constexpr int dot(Int3 a, Int3 b) { return a.v[0] * b.v[0] + a.v[1] * b.v[1] + a.v[2] * b.v[2]; }

/// Appends a tet, wound so that its volume is positive.
constexpr void addTet(CellTets& cell, std::array<int, 4> c)
{
    const auto edge = [&](int k) { return minus(cornerPoint(c[std::size_t(k)]), cornerPoint(c[0])); };
    if (dot(edge(1), cross(edge(2), edge(3))) < 0) {
        const int swapped = c[2];
        c[2] = c[3];
        c[3] = swapped;
    }
    const int det = dot(edge(1), cross(edge(2), edge(3)));
    const Int3 g[3] = {cross(edge(2), edge(3)), cross(edge(3), edge(1)), cross(edge(1), edge(2))};
    const std::size_t t = std::size_t(cell.count++);
    cell.corner[t] = c;
    cell.volume[t] = det / 6.0;
    for (std::size_t d = 0; d < 3; ++d) {
        for (std::size_t a = 0; a < 3; ++a) cell.gradient[t][a + 1][d] = double(g[a].v[d]) / det;
        cell.gradient[t][0][d] = -double(g[0].v[d] + g[1].v[d] + g[2].v[d]) / det;
    }
}

}  // namespace detail

constexpr CellTets makeCellTets(CellShape shape)
{
    CellTets cell;
    if (shape == CellShape::six) {
        constexpr int kOrder[6][2] = {{0, 1}, {0, 2}, {1, 0}, {1, 2}, {2, 0}, {2, 1}};
        for (auto [a, b] : kOrder) detail::addTet(cell, {0, 1 << a, 1 << a | 1 << b, 7});
        return cell;
    }
    if (shape == CellShape::tet) {
        cell.count = 1;
        cell.corner[0] = {0, 1, 2, 3};
        cell.volume[0] = 1;
        return cell;
    }
    const int flip = shape == CellShape::fiveOdd ? 7 : 0;  // mirrors the cell through its center
    for (int c : {0, 3, 5, 6}) detail::addTet(cell, {c ^ flip, c ^ 1 ^ flip, c ^ 2 ^ flip, c ^ 4 ^ flip});
    detail::addTet(cell, {1 ^ flip, 2 ^ flip, 4 ^ flip, 7 ^ flip});
    return cell;
}

template <CellShape shape>
inline constexpr CellTets kCellTets = makeCellTets(shape);

inline const CellTets& cellTets(CellShape shape)
{
    switch (shape) {
    case CellShape::six: return kCellTets<CellShape::six>;
    case CellShape::fiveEven: return kCellTets<CellShape::fiveEven>;
    case CellShape::fiveOdd: return kCellTets<CellShape::fiveOdd>;
    default: return kCellTets<CellShape::tet>;
    }
}

}  // namespace vdbfrac::tetmesh
