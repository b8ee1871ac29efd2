// The part of a kernel that has diagonal blocks, and means of tangents over cells: seldom needed beside products, so
// one loop serves all types of cells.
#include "kernel_cells.h"
#include "kernel_parts.h"
#include "kernel_tangents.h"

namespace vdbfrac::solver {

namespace {

/// Component d of h grad N_a of tet t.
template <bool hasOwn>
VDBFRAC_INLINE Pack vertexGradient(const AnyCells& cells, int t, int a, int d)
{
    if constexpr (!hasOwn) return all(cells.tets.gradient[std::size_t(t)][std::size_t(a)][std::size_t(d)]);
    const LaneGradients& own = cells.own[t];
    if (a > 0) return gradientOf<Pack>(own, a - 1, d);
    return -(gradientOf<Pack>(own, 0, d) + gradientOf<Pack>(own, 1, d) + gradientOf<Pack>(own, 2, d));
}

/// R and T of tet t, of volume V, or of the mean, `t` then behind the last: its own or those of its cell.
template <class Tangents>
VDBFRAC_INLINE void tangentOfTet(const PatchData& patch, int b, int t, Pack V, Matrix& R, Pack (&T)[6])
{
    if (!patch.cells) return loadTangent<double>(patch.tangent[int(patch.batch[b].tangent) + t], R, T);
    loadTangent<double>(patch.cells[b], R, T);
    Pack own[6];
    for (int k = 0; k < 6; ++k) own[k] = V * T[k];
    Tangents::ofTet(R, own, T);
}

/// Adds what the mean of a cell has, of the sums of V g at its corners.
template <class Tangents>
VDBFRAC_INLINE void addMeanBlocks(const PatchData& patch, int b, int tets, Pack V, const CornersOf<Pack, 3>& sum,
                                  CornersOf<Pack, 6>& K)
{
    const Pack mu = patch.meanStrain * patch.mu * patch.h * (1 + patch.share) * leftOf<double>(patch, b);
    const Pack inverse = V > 0 ? 1. / V : all(0);
    Matrix R;
    Pack T[6];
    tangentOfTet<Tangents>(patch, b, tets, patch.meanStrain * V, R, T);
    for (int c = 0; c < tetmesh::kCorners; ++c) {
        Pack g[3], q[3];
        for (int d = 0; d < 3; ++d) g[d] = sum[c][d] * inverse;
        for (int i = 0; i < 3; ++i) q[i] = R[i][0] * g[0] + R[i][1] * g[1] + R[i][2] * g[2];
        Tangents::addVertexBlock(g, q, R, T, mu * V, K[c]);
        addOuter(q, -2. / 3. * mu * V, K[c]);
    }
}

template <class Tangents, bool hasOwn>
void diagonalBatch(const PatchData& patch, const AnyCells& cells, int b, double* out)
{
    const double theta = cells.tets.count > 1 ? patch.meanStrain : 0;
    const double scale = patch.h * (1 + patch.share), whole = patch.mu * scale;
    const double bulkModulus = patch.lambda * scale + 2. / 3. * whole;
    const Pack left = leftOf<double>(patch, b), mu = (1 - theta) * patch.mu * scale * left;
    const Pack lambda = patch.lambda * scale + (1. - left) * (2. / 3. * whole);
    CornersOf<Pack, 6> K = {};
    CornersOf<Pack, 3> bulk = {}, mean = {};  // sums of V R g and of V g
    Pack cellVolume = all(0);
    for (int t = 0; t < cells.tets.count; ++t) {
        const Pack V = load<double>(cells.share[t]);
        cellVolume += V;
        Matrix R;
        Pack T[6];
        tangentOfTet<Tangents>(patch, b, t, (1 - theta) * V, R, T);
        for (int a = 0; a < 4; ++a) {
            const int c = cells.tets.corner[std::size_t(t)][std::size_t(a)];
            Pack g[3], q[3];
            for (int d = 0; d < 3; ++d) g[d] = vertexGradient<hasOwn>(cells, t, a, d);
            for (int i = 0; i < 3; ++i) q[i] = R[i][0] * g[0] + R[i][1] * g[1] + R[i][2] * g[2];
            Tangents::addVertexBlock(g, q, R, T, mu * V, K[c]);
            addOuter(q, (patch.cellDilation ? -2. / 3. * mu : lambda) * V, K[c]);
            if (patch.cellDilation)
                for (int i = 0; i < 3; ++i) bulk[c][i] += V * q[i];
            if (theta > 0)
                for (int d = 0; d < 3; ++d) mean[c][d] += V * g[d];
        }
    }
    if (patch.cellDilation) {
        const Pack weight = cellVolume > 0 ? bulkModulus / cellVolume : all(0);
        for (int c = 0; c < tetmesh::kCorners; ++c) addOuter(bulk[c], weight, K[c]);
    }
    if (theta > 0) addMeanBlocks<Tangents>(patch, b, cells.tets.count, cellVolume, mean, K);
    if (!patch.cells && patch.yielding && patch.yielding[b].any)
        for (int c = 0; c < tetmesh::kCorners; ++c) {
            Pack slope[3];
            for (int i = 0; i < 3; ++i) slope[i] = load<double>(patch.yielding[b].slope[c][i]);
            addOuter(slope, all(-1), K[c]);
        }
    cells.scatter(K, out);
}

/// Adds to the diagonal of T, by the circles of Gershgorin, what makes its least eigenvalue at least `least`.
VDBFRAC_INLINE void raise(Pack (&T)[6], Pack least)
{
    Pack lowest = least;
    for (int i = 0; i < 3; ++i) {
        const Pack low = T[i] - magnitude(T[3 + (i + 1) % 3]) - magnitude(T[3 + (i + 2) % 3]);
        lowest = low < lowest ? low : lowest;
    }
    for (int i = 0; i < 3; ++i) T[i] += least - lowest;
}

/// Semidefinite, as project() makes tets: where the energy is not convex the tangents of the tets of a cell may add up
/// to a definite one when their mean does not, and what is preconditioned with that follows its softest direction
/// alone.
template <class Tangents>
void averageBatch(const PatchData& patch, int b, const RobustTet& scalar, TetTangent& cell)
{
    const AnyCells cells(patch, patch.batch[b]);
    const TetTangent* const tangent = patch.tangent + patch.batch[b].tangent;
    Pack volume = all(0), T[6];
    Matrix R;
    for (int k = 0; k < 9; ++k) R[k / 3][k % 3] = all(0);
    for (Pack& v : T) v = all(0);
    for (int t = 0; t < cells.tets.count; ++t) {
        const Pack V = load<double>(cells.share[t]);
        const Mask used = V > 0;  // what a tet without material has is of no interest
        volume += V;
        for (int k = 0; k < 9; ++k) R[k / 3][k % 3] += used ? V * load<double>(tangent[t].R[k]) : all(0);
        for (int k = 0; k < 6; ++k) T[k] += used ? load<double>(tangent[t].T[k]) : all(0);
    }
    if (cells.tets.count > 1 && patch.meanStrain > 0)  // its share is that of the tets' means
        for (int k = 0; k < 6; ++k) T[k] += volume > 0 ? load<double>(tangent[cells.tets.count].T[k]) : all(0);
    const Pack inverse = volume > 0 ? 1. / volume : all(0);
    for (int k = 0; k < 9; ++k) R[k / 3][k % 3] = volume > 0 ? R[k / 3][k % 3] * inverse : all(k % 4 == 0);
    for (Pack& v : T) v = v * inverse;
    Tangents::mean(scalar, R, T);
    raise(T, patch.mu * patch.h * Tangents::minEigenvalue(patch.share) * leftOf<double>(patch, b));
    for (int k = 0; k < 9; ++k) store(cell.R[k], R[k / 3][k % 3]);
    for (int k = 0; k < 6; ++k) store(cell.T[k], T[k]);
}

}  // namespace

void VDBFRAC_KERNEL::diagonal(const PatchData& patch, double* out)
{
    withTangents(patch.strain, [&]<class Tangents>() {
        for (int b = 0; b < patch.batches; ++b) {
            const AnyCells cells(patch, patch.batch[b]);
            if (cells.own)
                diagonalBatch<Tangents, true>(patch, cells, b, out);
            else
                diagonalBatch<Tangents, false>(patch, cells, b, out);
        }
    });
}

void VDBFRAC_KERNEL::averageTets(const PatchData& patch, const RobustTet& scalar, TetTangent* cells)
{
    withTangents(patch.strain, [&]<class Tangents>() {
        for (int b = 0; b < patch.batches; ++b) averageBatch<Tangents>(patch, b, scalar, cells[b]);
    });
}

}  // namespace vdbfrac::solver
