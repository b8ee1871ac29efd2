// The standard block as a problem: n^3 nodes, unit cube, E = 1 MPa, nu = .3, rho = 1000 kg/m^3, plain tets, bottom
// clamped, top moved up. Whole or with an open crack through half of it.
#pragma once

#include <vdbfrac/solver/backward_euler.h>

#include <vector>

namespace vdbfrac::tools::bench {

inline constexpr double kBlockStep = 1. / 240;  // s
inline constexpr double kBlockSpeed = 0.4;      // m/s, of the top

/// An open crack through the half of the block below the middle in x. Aligned: its plane, the middle one, belongs to
/// every coarser lattice. Between: one cell higher, within the cells of all of these.
enum class Crack { none, aligned, between };

/// Whole cells with a corner at the origin. No level set: its zero contour would cut the faces.
struct BlockMesh {
    std::vector<tetmesh::CellElement> elements;  ///< by block of 8^3 cells
    std::vector<Coord> nodes;
    double h = 1;  ///< m

    /// Nodes on the crack are duplicated, and the cells above take the copies. n must be 2^k + 1 then.
    explicit BlockMesh(int n, Crack crack = Crack::none);
};

/// From rest, the top already moving.
struct BlockProblem {
    BlockMesh mesh;
    solver::ElasticOperator elastic;
    solver::State state;
    solver::Boundary boundary;

    explicit BlockProblem(int n, Crack crack = Crack::none);

    /// Targets of the held nodes: the top `distance` [m] further up than it is in `state`.
    void moveTop(double distance);
    /// Rest positions bent, twisted and stretched by up to a fifth: no tet is inverted, none is at rest.
    std::vector<Vec3> bent() const;
};

}  // namespace vdbfrac::tools::bench
