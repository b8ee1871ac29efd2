// The element kernel: eight lattice cells at a time, one a lane. Not installed.
//
// Every operation on a lane is a plain IEEE double operation and nothing is contracted, so the lanes compute the same
// bits whatever vector unit the file is compiled for; kernel_dispatch.cpp picks the widest the machine has.
// Symbols as in corotational.h, and: h lattice spacing; V material volume of a tet; E = F h; avg mean over the
// tets of a cell, weighted by V. "Cell dilation" splits the energy with the bulk modulus K = lambda + 2 mu/3 and takes the
// bulk part from the mean dilatation of the cell,
//   Psi = mu (|S - I|^2 - tr(S - I)^2 / 3) + K/2 avg(tr(S - I))^2,
// which frees the tets of a cell from locking near nu = .5 (mean dilatation; Nagtegaal, Parks, Rice 1974). Averaging the
// lambda term alone would leave 2 mu/3 of the bulk stiffness locked.
#pragma once

#include <vdbfrac/tetmesh/cell.h>

#include <cstdint>

namespace vdbfrac::solver {

inline constexpr int kLanes = 8;

/// Eight cells of one shape. A lane that is not used has no volume in any tet.
struct alignas(64) Batch {
    double volume[tetmesh::kMostTets][kLanes];  ///< V [m^3]
    double mu[kLanes], lambda[kLanes];          ///< [Pa]
    std::uint16_t corner[tetmesh::kCorners][kLanes];  ///< local node
    tetmesh::CellShape shape;
    bool contiguous;  ///< corner[c][l] == corner[c][0] + l for all c, l: rows of a lattice
};

/// What a product with the tangent needs of eight cells. A product is bound by reading this, so it is kept in single
/// precision: a slightly different symmetric operator inside an iteration whose residual is evaluated in double.
struct alignas(64) BatchTangent {
    float R[tetmesh::kMostTets][9][kLanes];  ///< row-major
    float T[tetmesh::kMostTets][6][kLanes];  ///< twist operator times V / h^2: xx, yy, zz, yz, zx, xy
};

/// Vectors of a patch: three rows (x, y, z) of `stride` doubles, kLanes more than there are nodes.
struct PatchData {
    const Batch* batch = nullptr;
    BatchTangent* tangent = nullptr;  ///< written by evaluate when not null, read by product and diagonal
    double* psi = nullptr;            ///< evaluate: energy density [J/m^3], [batch][tet][lane]; may be null
    int batches = 0;
    int stride = 0;
    double h = 1;
    const double* in = nullptr;  ///< x [m] or a displacement
    double* out = nullptr;       ///< added to: gradient [N], K times in, or (six rows) diagonal blocks
};

struct KernelResult {
    double energy = 0;          ///< [J]
    std::int64_t robustTets = 0;  ///< tets that took the scalar path
};

/// Scalar path for a lane whose polar decomposition is not safe in closed form. Row-major F, R; S, T as in BatchTangent.
struct RobustTet {
    void (*polar)(const double* F, double* R, double* S);
    void (*twist)(const double* S, double t, double* T);
};

struct Kernel {
    KernelResult (*evaluate)(const PatchData&, bool cellDilation, const RobustTet&);
    void (*product)(const PatchData&, bool cellDilation);
    void (*diagonal)(const PatchData&, bool cellDilation);  ///< out: six rows xx, yy, zz, yz, zx, xy
    const char* name;
};

/// The widest kernel this machine runs.
const Kernel& kernel();
/// All kernels this machine runs, for tests: their results are equal to the bit.
const Kernel* const* kernels(int& count);

}  // namespace vdbfrac::solver
