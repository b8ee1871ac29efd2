// The kernels: eight lattice cells at a time, one a lane, and eight nodes at a time. Not installed.
//
// Every operation on a lane is a plain IEEE operation, fused multiply-add where the unit has it, and each lane is added
// up in the same order: AVX2 and AVX-512 give the same bits, and so does any number of threads. Plain code, for
// machines without fused operations, rounds twice where they round once. kernel_dispatch.cpp picks the widest unit of
// the machine. Symbols as in corotational.h, and: h lattice spacing; V material volume of a tet; E = F h; avg mean over
// the tets of a cell, weighted by V. "Cell dilation" splits the energy with the bulk modulus K = lambda + 2 mu/3 and
// takes the bulk part from the mean dilatation of the cell,
//   Psi = mu (|S - I|^2 - tr(S - I)^2 / 3) + K/2 avg(tr(S - I))^2,
// which frees the tets of a cell from locking near nu = .5 (mean dilatation; Nagtegaal, Parks, Rice 1974). Averaging
// the lambda term alone would leave 2 mu/3 of the bulk stiffness locked. With it goes a share theta ("mean strain") of
// the deviatoric energy that the mean of F has, which frees them from most of what they are too stiff in bending:
//   Psi = (1 - theta) dev(F) + theta dev(avg F) + K/2 avg(tr(S - I))^2,  dev(F) = mu (|S - I|^2 - tr(S - I)^2 / 3).
// The mean is one more tet of the cell: it has a strain, a stress and a tangent. The share of the tets resists what the
// mean does not see (hourglass modes).
#pragma once

#include <vdbfrac/solver/material.h>
#include <vdbfrac/tetmesh/cell.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace vdbfrac::solver {

inline constexpr int kLanes = 8;

/// Eight cells of one shape. Whole cells in a row of the lattice, the common case, need nothing but this.
struct Batch {
    std::array<std::uint16_t, tetmesh::kCorners> corner{};  ///< local nodes of the first cell
    /// Entry of `LaneCorners`; -1: a row, cell l has corner[c] + l and corner[c | 1] = corner[c] + 1.
    std::int32_t gathered = -1;
    /// Entry of `LaneVolumes`; -1: eight whole cells. Of `LaneTets` for the shape tet, of `LaneCells` if it has flowed.
    std::int32_t cut = -1;
    std::uint32_t tangent = 0;  ///< place of its first tet among the tangents; after its last comes the mean, if any
    tetmesh::CellShape shape = tetmesh::CellShape::six;
    bool flowed = false;  ///< cells of the lattice with rest gradients of their own
};

/// Local nodes of cells that are not in a row.
struct alignas(64) LaneCorners {
    std::uint16_t corner[tetmesh::kCorners][kLanes];
};

/// Material volume of each tet over the volume of its cell, times the factor on its stiffness. A lane that is not used
/// has none.
struct alignas(64) LaneVolumes {
    double share[tetmesh::kMaxTets][kLanes];
};

/// Eight tets of any shape.
struct alignas(64) LaneTets {
    double gradient[3][3][kLanes];  ///< TetGradients
    double share[1][kLanes];        ///< material volume over h^3. A lane that is not used has none
    std::uint16_t corner[4][kLanes];
};

/// Eight cells of the lattice in which a tet has flowed.
struct alignas(64) LaneCells {
    double gradient[tetmesh::kMaxTets][3][3][kLanes];  ///< TetGradients: h Fp^-T grad N
    double share[tetmesh::kMaxTets][kLanes];           ///< LaneVolumes
};

/// What a product with the tangent needs of a tet in eight cells: R and T, or of Green's strain F and Sigma V / h^2
/// (see kernel_laws.h). A product is bound by reading this, so it is kept in single precision: a slightly different
/// symmetric operator inside an iteration whose residual is evaluated in double. Also the mean over the tets of a cell,
/// which makes a product that is near that of the energy at a sixth of the bytes and half of the arithmetic: R is then
/// the rotation nearest to the mean, T the mean twist operator times h in the frame of R.
struct alignas(32) TetTangent {
    float R[9][kLanes];  ///< row-major
    float T[6][kLanes];  ///< R (twist operator) R^T times V / h^2: xx, yy, zz, yz, zx, xy
};

/// What yields among eight cells, in their tangent.
struct alignas(64) LaneYielding {
    float left[kLanes];  ///< the shear modulus over what it is without flow, damping included in both
    /// Of n at the corners, times the root of what the tangent is less by for its square [sqrt(N/m)]; set where `any`.
    float slope[tetmesh::kCorners][3][kLanes];
    bool any;
};
struct alignas(64) LaneYields {
    double strain[kLanes];  ///< y (Yield); infinity in cells that never flow
};

/// Local nodes from `local` on that are consecutive nodes of the system from `node` on.
struct NodeRun {
    std::uint32_t node = 0;
    std::uint16_t local = 0, count = 0;
};

/// One patch. Vectors are three rows (x, y, z) of `stride` numbers, kLanes more than there are nodes, those 0.
struct PatchData {
    const Batch* batch = nullptr;
    const LaneCorners* corners = nullptr;
    const LaneVolumes* volumes = nullptr;
    const LaneTets* tets = nullptr;
    const LaneCells* flowed = nullptr;
    TetTangent* tangent = nullptr;  ///< of each tet: written by evaluate when not null, read by product and diagonal
    TetTangent* cells = nullptr;    ///< of each batch, means over its cells: read in its place when not null
    double* psi = nullptr;          ///< evaluate: energy density [J/m^3], [batch][tet][lane]; may be null
    double* shear = nullptr;        ///< evaluate: n (Yield), [batch][lane]; only where there are yields; may be null
    const LaneYields* yields = nullptr;  ///< of each batch; null: nothing flows
    double yieldShare = 0;               ///< c (Yield)
    LaneYielding* yielding = nullptr;    ///< of each batch: as `tangent`; null: nothing yields
    const NodeRun* run = nullptr;
    int batches = 0, runs = 0;
    int nodes = 0, stride = 0;
    double h = 1;
    double mu = 0, lambda = 0, bulk = 0;  ///< [Pa]
    Strain strain = Strain::corotational;
    bool cellDilation = false;
    double meanStrain = 0;  ///< theta; 0 without cell dilation
    /// The tangent is that of the energy plus `share` times linear elasticity in the frame of R.
    double share = 0;
};

/// What the patches add to the nodes of a system, xyz after xyz.
template <class Real>
struct SlotSums {
    const Real* slot;
    /// Of each eight nodes: the slot of the first, where they have one each and in a row; else kNoSlot.
    const std::uint32_t* contiguous;
    const std::uint32_t *start, *slots;  ///< slots[start[n]] up to slots[start[n + 1]] are those of node n
};
inline constexpr std::uint32_t kNoSlot = 0xffffffff;

/// Symmetric 3x3 blocks of eight consecutive nodes: xx, yy, zz, yz, zx, xy.
struct alignas(32) LaneBlocks {
    float v[6][kLanes] = {};
};

/// Vectors of conjugate gradients for A = K + diag(massFactor mass), preconditioned by B.
template <class Real>
struct GradientNodes {
    SlotSums<Real> Kp;
    const LaneBlocks* B;  ///< 0 at fixed nodes
    const double* mass;   ///< kg
    double massFactor;    ///< 1/s^2
    Real *r, *p;
    double* u;
};

/// Vectors of the Chebyshev iteration for A = K + diag(added), preconditioned by B.
struct SmootherNodes {
    SlotSums<float> Kx;
    const LaneBlocks* B;
    const float *added, *b;
    float *x, *step;
};

struct KernelResult {
    double energy = 0;            ///< [J]
    std::int64_t robustTets = 0;  ///< tets that took the scalar path
};

/// Scalar path for a lane whose polar decomposition is not safe in closed form. Row-major F, R; S, T as in TetTangent.
struct RobustTet {
    void (*polar)(const double* F, double* R, double* S);
    void (*twist)(const double* S, double t, double* T);
};

/// Eight tets, or what else has an F, with R and S of F = R S: rows of F and R, S as in TetTangent.
struct alignas(64) LanePolars {
    double F[9][kLanes], R[9][kLanes], S[6][kLanes];
};

/// What a kernel does to vectors of one precision. `in`: rows of x [m] or of a displacement; `out` is added to.
template <class Real>
struct VectorKernel {
    /// Rows of the patch from points of the system, xyz after xyz.
    void (*read)(const PatchData&, const Real* points, Real* in);
    /// Rows of the patch as points, xyz after xyz, for its nodes and up to a multiple of kLanes.
    void (*write)(const PatchData&, const Real* out, Real* points);
    /// out += K in; returns in.out of the patch.
    double (*product)(const PatchData&, const Real* in, Real* out);
    // Over nodes [begin, end) of the system; `begin` is a multiple of kLanes.
    /// r -= step A p; returns r.B r.
    double (*updateResidual)(const GradientNodes<Real>&, std::size_t begin, std::size_t end, Real step);
    /// u += move p, then p = B r + beta p; returns the new p.M p.
    double (*updateDirection)(const GradientNodes<Real>&, std::size_t begin, std::size_t end, double move, Real beta);
};

/// `evaluate` adds the gradient [N] to `out`, `diagonal` six rows of diagonal blocks (xx, yy, zz, yz, zx, xy).
struct Kernel {
    KernelResult (*evaluate)(const PatchData&, const RobustTet&, const double* in, double* out);
    void (*diagonal)(const PatchData&, double* out);
    /// Writes the means over cells of `tangent` to `cells`.
    void (*averageTets)(const PatchData&, const RobustTet&, TetTangent* cells);
    /// R and S from F.
    void (*polar)(const RobustTet&, LanePolars&);
    VectorKernel<double> twice;
    VectorKernel<float> single;
    /// step = keep step + move B (b - A x), then x += step; over nodes [begin, end), `begin` a multiple of kLanes.
    void (*smooth)(const SmootherNodes&, std::size_t begin, std::size_t end, float keep, float move);
    const char* name;

    template <class Real>
    const VectorKernel<Real>& of() const
    {
        if constexpr (std::is_same_v<Real, float>)
            return single;
        else
            return twice;
    }
};

/// The widest kernel this machine runs. Throws LimitError where none was compiled for it.
const Kernel& kernel();
/// All kernels this machine runs, narrowest first, for tests: those that fuse are equal to the bit.
std::span<const Kernel* const> kernels();

}  // namespace vdbfrac::solver
