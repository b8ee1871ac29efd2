#include <vdbfrac/solver/elastic_operator.h>

#include "patches.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/solver/corotational.h>

#include <Eigen/Dense>

#include <atomic>

namespace vdbfrac::solver {

struct Tangent::Data {
    std::vector<BatchTangent> batches;
};
Tangent::Tangent() = default;
Tangent::~Tangent() = default;
Tangent::Tangent(Tangent&&) noexcept = default;
Tangent& Tangent::operator=(Tangent&&) noexcept = default;

struct ElasticOperator::Data {
    Patches p;
    std::vector<double> mass, stiffness;
    double h = 1;
    bool cellDilation = true;
    std::size_t elements = 0;
    mutable ElasticWork work;
    mutable std::vector<Vec3> slotSum;  // scratch: what each patch adds to each of its nodes
};

namespace {

constexpr int kRow[6] = {0, 1, 2, 1, 2, 0}, kColumn[6] = {0, 1, 2, 2, 0, 1};

void packSymmetric(const Mat3& m, double* packed)
{
    for (int k = 0; k < 6; ++k) packed[k] = m(kRow[k], kColumn[k]);
}

Mat3 unpackSymmetric(const double* packed)
{
    Mat3 m;
    for (int k = 0; k < 6; ++k) m(kRow[k], kColumn[k]) = m(kColumn[k], kRow[k]) = packed[k];
    return m;
}

void robustPolar(const double* F, double* R, double* S)
{
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    const Polar p = signedPolar(Eigen::Map<const RowMajor>(F));
    Eigen::Map<RowMajor> out(R);
    out = p.R;
    packSymmetric(p.S, S);
}

void robustTwist(const double* packedS, double t, double* T)
{
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(unpackSymmetric(packedS));
    Polar p;
    p.s = eigen.eigenvalues();
    p.V = eigen.eigenvectors();
    packSymmetric(twistOperator(p, t), T);
}

constexpr RobustTet kRobust = {robustPolar, robustTwist};

/// Sum over the tets round each node of a quarter of the tet's material volume times density(material).
template <class Density>
std::vector<double> lumped(std::span<const ElementSet> sets, std::size_t nodeCount, double h, const Density& density)
{
    std::vector<double> sum(nodeCount, 0.);
    for (const ElementSet& set : sets)
        for (const tetmesh::CellElement& e : set.elements) {
            const tetmesh::CellTets& tets = tetmesh::cellTets(e.shape);
            for (int t = 0; t < tets.count; ++t) {
                const double quarter = 0.25 * density(set.material) * h * h * h * tets.volume[std::size_t(t)] * e.fraction[std::size_t(t)];
                for (int c : tets.corner[std::size_t(t)]) sum[set.firstNode + e.node[std::size_t(c)]] += quarter;
            }
        }
    return sum;
}

/// Vectors of one patch, rows of `stride`.
struct PatchVectors {
    std::vector<double> in, out;

    void read(const Patches& p, const Patch& patch, std::span<const Vec3> x)
    {
        const std::size_t stride = std::size_t(patch.stride());
        in.assign(3 * stride, 0.);
        for (std::size_t i = 0; i < patch.nodes; ++i)
            for (std::size_t d = 0; d < 3; ++d) in[d * stride + i] = x[p.nodeOfSlot[patch.firstSlot + i]][Eigen::Index(d)];
    }
    void clear(const Patch& patch, std::size_t rows) { out.assign(rows * std::size_t(patch.stride()), 0.); }
    void write(const Patch& patch, std::span<Vec3> slotSum) const
    {
        const std::size_t stride = std::size_t(patch.stride());
        for (std::size_t i = 0; i < patch.nodes; ++i)
            slotSum[patch.firstSlot + i] = Vec3(out[i], out[stride + i], out[2 * stride + i]);
    }
};

/// to[n] += sum of the slots of node n.
void addSlots(const Patches& p, std::span<const Vec3> slotSum, std::span<Vec3> to)
{
    parallelChunks(to.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n)
            for (std::uint32_t s = p.slotStart[n]; s < p.slotStart[n + 1]; ++s) to[n] += slotSum[p.slots[s]];
    });
}

PatchData dataOf(const Patches& p, const Patch& patch, double h, const PatchVectors& v)
{
    PatchData d;
    d.batch = p.batches.data() + patch.firstBatch;
    d.batches = int(patch.batches);
    d.stride = patch.stride();
    d.h = h;
    d.in = v.in.data();
    return d;
}

constexpr std::size_t kPatchChunk = 2;  // patches that share scratch vectors

}  // namespace

ElasticOperator::ElasticOperator(std::span<const ElementSet> sets, std::size_t nodeCount, double h, Volumetric volumetric)
    : data_(std::make_unique<Data>())
{
    data_->p = makePatches(sets, nodeCount, h);
    data_->mass = lumped(sets, nodeCount, h, [](const Material& m) { return m.rho; });
    data_->stiffness = lumped(sets, nodeCount, h, [h](const Material& m) { return 8 * (2 * m.mu + std::abs(m.lambda)) / (h * h); });
    data_->h = h;
    data_->cellDilation = volumetric == Volumetric::cell;
    data_->slotSum.resize(data_->p.nodeOfSlot.size());
    for (const ElementSet& set : sets) data_->elements += set.elements.size();
}
ElasticOperator::~ElasticOperator() = default;
ElasticOperator::ElasticOperator(ElasticOperator&&) noexcept = default;
ElasticOperator& ElasticOperator::operator=(ElasticOperator&&) noexcept = default;

std::size_t ElasticOperator::nodeCount() const { return data_->mass.size(); }
std::int64_t ElasticOperator::tetCount() const { return data_->p.tets; }
std::span<const double> ElasticOperator::mass() const { return data_->mass; }
std::span<const double> ElasticOperator::stiffness() const { return data_->stiffness; }
const ElasticWork& ElasticOperator::work() const { return data_->work; }

std::size_t ElasticOperator::bytes() const
{
    const Patches& p = data_->p;
    return p.batches.size() * sizeof(Batch) + (p.elementOfLane.size() + p.nodeOfSlot.size() + p.slots.size() + p.slotStart.size()) * 4 +
           data_->slotSum.size() * sizeof(Vec3) + data_->mass.size() * sizeof(double);
}

double ElasticOperator::evaluate(std::span<const Vec3> x, std::span<Vec3> gradient, Tangent* tangent) const
{
    const Patches& p = data_->p;
    if (tangent) {
        if (!tangent->data_) tangent->data_ = std::make_unique<Tangent::Data>();
        tangent->data_->batches.resize(p.batches.size());
    }
    std::vector<KernelResult> result(p.patches.size());
    parallelChunks(p.patches.size(), kPatchChunk, [&](std::size_t begin, std::size_t end) {
        PatchVectors v;
        for (std::size_t i = begin; i < end; ++i) {
            const Patch& patch = p.patches[i];
            v.read(p, patch, x);
            v.clear(patch, 3);
            PatchData d = dataOf(p, patch, data_->h, v);
            d.out = v.out.data();
            if (tangent) d.tangent = tangent->data_->batches.data() + patch.firstBatch;
            result[i] = kernel().evaluate(d, data_->cellDilation, kRobust);
            v.write(patch, data_->slotSum);
        }
    });
    if (!gradient.empty()) addSlots(p, data_->slotSum, gradient);
    double energy = 0;
    for (const KernelResult& r : result) {
        energy += r.energy;
        data_->work.robustTets += r.robustTets;
    }
    data_->work.evaluations += 1;
    data_->work.evaluatedTets += p.tets;
    return energy;
}

std::vector<double> ElasticOperator::energyDensities(std::span<const Vec3> x) const
{
    const Patches& p = data_->p;
    constexpr std::size_t kTets = tetmesh::kMostTets;
    std::vector<double> density(data_->elements * kTets, 0.);
    parallelChunks(p.patches.size(), kPatchChunk, [&](std::size_t begin, std::size_t end) {
        PatchVectors v;
        std::vector<double> psi;
        for (std::size_t i = begin; i < end; ++i) {
            const Patch& patch = p.patches[i];
            v.read(p, patch, x);
            v.clear(patch, 3);
            psi.assign(patch.batches * kTets * kLanes, 0.);
            PatchData d = dataOf(p, patch, data_->h, v);
            d.out = v.out.data();
            d.psi = psi.data();
            (void)kernel().evaluate(d, data_->cellDilation, kRobust);
            for (std::size_t b = 0; b < patch.batches; ++b)
                for (std::size_t l = 0; l < kLanes; ++l) {
                    const std::int32_t e = p.elementOfLane[(patch.firstBatch + b) * kLanes + l];
                    for (std::size_t t = 0; e >= 0 && t < kTets; ++t)
                        if (p.batches[patch.firstBatch + b].volume[t][l] > 0)
                            density[std::size_t(e) * kTets + t] = d.psi[(b * kTets + t) * kLanes + l];
                }
        }
    });
    data_->work.evaluations += 1;
    data_->work.evaluatedTets += p.tets;
    return density;
}

void ElasticOperator::project(Tangent& tangent) const
{
    const Patches& p = data_->p;
    const double scale = 1 / (data_->h * data_->h);
    parallelChunks(p.batches.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin; b < end; ++b)
            for (int t = 0; t < tetmesh::kMostTets; ++t)
                for (int l = 0; l < kLanes; ++l) {
                    const double least = -p.batches[b].mu[l] * p.batches[b].volume[t][l] * scale;
                    if (least == 0) continue;
                    double T[6];
                    for (int k = 0; k < 6; ++k) T[k] = tangent.data_->batches[b].T[t][k][l];
                    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(unpackSymmetric(T));
                    if (eigen.eigenvalues()[0] >= least) continue;
                    const Vec3 clamped = eigen.eigenvalues().cwiseMax(least);
                    packSymmetric(eigen.eigenvectors() * clamped.asDiagonal() * eigen.eigenvectors().transpose(), T);
                    for (int k = 0; k < 6; ++k) tangent.data_->batches[b].T[t][k][l] = float(T[k]);
                }
    });
}

void ElasticOperator::warp(Tangent& tangent) const
{
    const Patches& p = data_->p;
    const double scale = 1 / (data_->h * data_->h);
    parallelChunks(p.batches.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin; b < end; ++b)
            for (int t = 0; t < tetmesh::kMostTets; ++t)
                for (int k = 0; k < 6; ++k)
                    for (int l = 0; l < kLanes; ++l)
                        tangent.data_->batches[b].T[t][k][l] = k < 3 ? float(-p.batches[b].mu[l] * p.batches[b].volume[t][l] * scale) : 0;
    });
}

void ElasticOperator::addProduct(const Tangent& tangent, std::span<const Vec3> u, std::span<Vec3> out) const
{
    const Patches& p = data_->p;
    parallelChunks(p.patches.size(), kPatchChunk, [&](std::size_t begin, std::size_t end) {
        PatchVectors v;
        for (std::size_t i = begin; i < end; ++i) {
            const Patch& patch = p.patches[i];
            v.read(p, patch, u);
            v.clear(patch, 3);
            PatchData d = dataOf(p, patch, data_->h, v);
            d.out = v.out.data();
            d.tangent = tangent.data_->batches.data() + patch.firstBatch;
            kernel().product(d, data_->cellDilation);
            v.write(patch, data_->slotSum);
        }
    });
    addSlots(p, data_->slotSum, out);
    data_->work.products += 1;
    data_->work.productTets += p.tets;
}

void ElasticOperator::addDiagonal(const Tangent& tangent, std::span<Mat3> blocks) const
{
    const Patches& p = data_->p;
    std::vector<std::array<double, 6>> slot(p.nodeOfSlot.size());
    parallelChunks(p.patches.size(), kPatchChunk, [&](std::size_t begin, std::size_t end) {
        PatchVectors v;
        for (std::size_t i = begin; i < end; ++i) {
            const Patch& patch = p.patches[i];
            v.clear(patch, 6);
            PatchData d = dataOf(p, patch, data_->h, v);
            d.out = v.out.data();
            d.tangent = tangent.data_->batches.data() + patch.firstBatch;
            kernel().diagonal(d, data_->cellDilation);
            const std::size_t stride = std::size_t(patch.stride());
            for (std::size_t n = 0; n < patch.nodes; ++n)
                for (std::size_t k = 0; k < 6; ++k) slot[patch.firstSlot + n][k] = v.out[k * stride + n];
        }
    });
    parallelChunks(blocks.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n)
            for (std::uint32_t s = p.slotStart[n]; s < p.slotStart[n + 1]; ++s) blocks[n] += unpackSymmetric(slot[p.slots[s]].data());
    });
}

}  // namespace vdbfrac::solver
