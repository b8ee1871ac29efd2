// The standard block as a problem: n^3 nodes, unit cube, E = 1 MPa, nu = .3, rho = 1000 kg/m^3, plain tets, bottom
// clamped, top moved up. Whole or with an open crack through half of it.
#pragma once

#include <vdbfrac/lab/samples/block.h>
#include <vdbfrac/solver/backward_euler.h>

namespace vdbfrac::lab::bench {

inline constexpr double kBlockStep = 1. / 240;  // s
inline constexpr double kBlockSpeed = 0.4;      // m/s, of the top

/// An open crack through the half of the block below the middle in x. Aligned: its plane, the middle one, belongs to
/// every coarser lattice. Between: one cell higher, within the cells of all of these.
enum class Crack { none, aligned, between };

/// From rest, the top already moving.
struct BlockProblem {
    Block mesh;
    solver::ElasticOperator elastic;
    solver::State state;
    solver::Boundary boundary;

    /// Nodes on the crack are duplicated, and the cells above take the copies. n must be 2^k + 1 then.
    explicit BlockProblem(int n, Crack crack = Crack::none);

    /// Targets of the held nodes: the top `distance` [m] further up than it is in `state`.
    void moveTop(double distance);
};

}  // namespace vdbfrac::lab::bench
