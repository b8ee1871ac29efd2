#include <vdbfrac/solver/elastic_operator.h>

#include "flush_denormals.h"
#include "patches.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/solver/corotational.h>

#include <Eigen/Dense>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <numeric>
#include <type_traits>

namespace vdbfrac::solver {

Tangent::Tangent() = default;
Tangent::~Tangent() = default;
Tangent::Tangent(Tangent&&) noexcept = default;
Tangent& Tangent::operator=(Tangent&&) noexcept = default;
std::size_t Tangent::bytes() const { return capacity_ * sizeof(BatchTangent); }

void Tangent::resize(std::size_t batches)
{
    if (batches > capacity_) {
        capacity_ = capacity_ == 0 ? batches : batches + batches / 8;  // cracks add a few batches a step
        batches_ = std::make_unique_for_overwrite<BatchTangent[]>(capacity_);  // first touched by the threads that fill it
    }
    count_ = batches;
}

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

constexpr std::size_t kDiagonalRows = 6;  // numbers of a symmetric 3x3 block

/// to[n] += sum of the slots of node n.
void addSums(const NodeSums<Vec3>& sums, std::span<Vec3> to)
{
    parallelChunks(to.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) to[n] += sums(n);
    });
}

/// Memory for numbers of either precision, aligned for the kernel.
class Scratch {
public:
    explicit Scratch(std::size_t doubles) : memory_(std::make_unique_for_overwrite<Line[]>(doubles / 8 + 1)) {}
    template <class T>
    T* as() const
    {
        return reinterpret_cast<T*>(memory_.get());
    }

private:
    struct alignas(64) Line {
        std::byte bytes[64];
    };
    std::unique_ptr<Line[]> memory_;
};

template <class V>
void readPatch(const Patches& p, const Patch& patch, std::span<const V> x, typename V::Scalar* in)
{
    const std::size_t stride = patch.stride();
    const std::uint32_t* const node = p.nodeOfSlot.data() + patch.firstSlot;
    for (std::size_t i = 0; i < patch.nodes; ++i) {
        const V& v = x[node[i]];
        in[i] = v[0], in[stride + i] = v[1], in[2 * stride + i] = v[2];
    }
    for (std::size_t d = 0; d < 3; ++d) std::fill(in + d * stride + patch.nodes, in + (d + 1) * stride, 0);
}

template <class V>
void writePatch(const Patch& patch, const typename V::Scalar* out, V* slot)
{
    const std::size_t stride = patch.stride();
    for (std::size_t i = 0; i < patch.nodes; ++i) slot[patch.firstSlot + i] = V(out[i], out[stride + i], out[2 * stride + i]);
}

/// a.b over a patch, eight partial sums in a fixed order.
template <class Real>
double patchDot(const Real* a, const Real* b, std::size_t count)
{
    Real part[kLanes] = {};
    for (std::size_t i = 0; i < count; i += kLanes)
        for (std::size_t l = 0; l < kLanes; ++l) part[l] += a[i + l] * b[i + l];
    double sum = 0;
    for (Real v : part) sum += double(v);
    return sum;
}

}  // namespace

struct ElasticOperator::Data {
    Patches p;
    std::vector<double> mass, stiffness;
    double h = 1;
    bool cellDilation = true;
    std::size_t elements = 0;
    std::vector<ElementSet> sets;
    mutable ElasticWork work;
    mutable std::vector<double> patchEnergy;  // of the last pass
    // Scratch, made once: what each patch adds to each of its nodes, and vectors of the patch that a thread works on.
    Scratch slots{0};
    std::vector<Scratch> in, out;

    PatchData patchData(std::size_t i, BatchTangent* tangents, double share) const
    {
        const Patch& patch = p.patches[i];
        PatchData d;
        d.batch = p.batches.data() + patch.firstBatch;
        d.corners = p.corners.data();
        d.volumes = p.volumes.data();
        if (tangents) d.tangent = tangents + patch.firstBatch;
        d.batches = int(patch.batches);
        d.stride = int(patch.stride());
        d.h = h;
        d.mu = patch.mu, d.lambda = patch.lambda;
        d.share = share;
        return d;
    }

    /// Calls f(patch number, in, out) for every patch, with scratch of its own: `in` holds x, `out` three rows of
    /// zeros; then puts `out` into the patch's slots.
    template <class V, class F>
    void eachPatch(std::span<const V> x, const F& f) const
    {
        using Real = typename V::Scalar;
        parallelChunks(p.patches.size(), 1, [&](std::size_t i, std::size_t) {
            const Patch& patch = p.patches[i];
            [[maybe_unused]] std::conditional_t<std::is_same_v<Real, float>, FlushDenormals, int> flush;
            Real* const u = in[std::size_t(threadSlot())].template as<Real>();
            Real* const sum = out[std::size_t(threadSlot())].template as<Real>();
            readPatch(p, patch, x, u);
            std::fill_n(sum, 3 * patch.stride(), Real(0));
            f(i, u, sum);
            writePatch(patch, sum, slots.as<V>());
        });
    }

    template <class V>
    NodeSums<V> sums() const
    {
        return {slots.as<V>(), p.slotStart.data(), p.slots.data()};
    }

    double totalEnergy() const { return std::accumulate(patchEnergy.begin(), patchEnergy.end(), 0.); }

    /// Material volume of a tet over h^3; 0 in a lane that is not used.
    double volumeShare(std::size_t batch, std::size_t t, std::size_t l) const
    {
        const Batch& b = p.batches[batch];
        return b.cut < 0 ? tetmesh::cellTets(b.shape).volume[t] : p.volumes[std::size_t(b.cut)].share[t][l];
    }

    template <class F>
    void eachTet(BatchTangent* tangents, const F& f) const;
};

ElasticOperator::ElasticOperator(std::span<const ElementSet> sets, std::size_t nodeCount, double h, Volumetric volumetric)
    : data_(std::make_unique<Data>())
{
    Data& d = *data_;
    d.sets.assign(sets.begin(), sets.end());
    d.p = makePatches(sets, nodeCount);
    d.mass = lumped(sets, nodeCount, h, [](const Material& m) { return m.rho; });
    d.stiffness = lumped(sets, nodeCount, h, [h](const Material& m) { return 8 * (2 * m.mu + std::abs(m.lambda)) / (h * h); });
    d.patchEnergy.resize(d.p.patches.size());
    d.h = h;
    d.cellDilation = volumetric == Volumetric::cell;
    d.slots = Scratch(kDiagonalRows * d.p.nodeOfSlot.size());
    for (int thread = 0; thread < threadSlots(); ++thread) {
        d.in.emplace_back(3 * d.p.largestStride);
        d.out.emplace_back(kDiagonalRows * d.p.largestStride);
    }
    for (const ElementSet& set : sets) d.elements += set.elements.size();
}
ElasticOperator::~ElasticOperator() = default;
ElasticOperator::ElasticOperator(ElasticOperator&&) noexcept = default;
ElasticOperator& ElasticOperator::operator=(ElasticOperator&&) noexcept = default;

std::span<const ElementSet> ElasticOperator::sets() const { return data_->sets; }
double ElasticOperator::h() const { return data_->h; }
Volumetric ElasticOperator::volumetric() const { return data_->cellDilation ? Volumetric::cell : Volumetric::none; }
std::size_t ElasticOperator::nodeCount() const { return data_->mass.size(); }
std::int64_t ElasticOperator::tetCount() const { return data_->p.tets; }
std::span<const double> ElasticOperator::mass() const { return data_->mass; }
std::span<const double> ElasticOperator::stiffness() const { return data_->stiffness; }
const ElasticWork& ElasticOperator::work() const { return data_->work; }

std::size_t ElasticOperator::bytes() const
{
    const Data& d = *data_;
    return d.p.bytes() + (d.mass.size() + d.stiffness.size()) * sizeof(double) +
           (kDiagonalRows * d.p.nodeOfSlot.size() + (kDiagonalRows + 3) * d.p.largestStride * d.in.size()) * sizeof(double);
}

std::size_t ElasticOperator::productBytes() const
{
    const Patches& p = data_->p;
    return p.batches.size() * sizeof(BatchTangent) + p.bytes() - p.laneOfElement.size() * sizeof(p.laneOfElement[0]) +
           (2 * p.nodeOfSlot.size() + nodeCount()) * sizeof(Vec3);
}

double ElasticOperator::evaluate(std::span<const Vec3> x, std::span<Vec3> gradient, Tangent* tangent, double share) const
{
    const Data& d = *data_;
    if (tangent) {
        tangent->resize(d.p.batches.size());
        tangent->share_ = share;
    }
    std::atomic<std::int64_t> robust = 0;
        d.eachPatch(x, [&](std::size_t i, const double* in, double* out) {
        const KernelResult r = kernel().evaluate(d.patchData(i, tangent ? tangent->batches_.get() : nullptr, share), d.cellDilation, kRobust, in, out);
        d.patchEnergy[i] = r.energy;
        if (r.robustTets) robust += r.robustTets;
    });
    if (!gradient.empty()) addSums(d.sums<Vec3>(), gradient);
    d.work.robustTets += robust;
    d.work.evaluations += 1;
    d.work.evaluatedTets += d.p.tets;
    return d.totalEnergy();
}

std::vector<double> ElasticOperator::energyDensities(std::span<const Vec3> x) const
{
    const Data& d = *data_;
    constexpr std::size_t kTets = tetmesh::kMostTets;
    std::vector<double> density(d.elements * kTets, 0.), psi(d.p.batches.size() * kTets * kLanes);
    d.eachPatch(x, [&](std::size_t i, const double* in, double* out) {
        PatchData patch = d.patchData(i, nullptr, 0);
        const std::size_t first = d.p.patches[i].firstBatch;
        patch.psi = psi.data() + first * kTets * kLanes;
        (void)kernel().evaluate(patch, d.cellDilation, kRobust, in, out);
        const Patch& range = d.p.patches[i];
        for (std::size_t e = range.firstElement; e < range.firstElement + range.elements; ++e)
            for (std::size_t t = 0; t < kTets; ++t) {
                const std::size_t batch = d.p.laneOfElement[e] / kLanes, lane = d.p.laneOfElement[e] % kLanes;
                if (d.volumeShare(batch, t, lane) > 0) density[e * kTets + t] = psi[(batch * kTets + t) * kLanes + lane];
            }
    });
    d.work.evaluations += 1;
    d.work.evaluatedTets += d.p.tets;
    return density;
}

/// Calls f(tangent of the batch, tet, lane, mu V / h^2) for every tet with material.
template <class F>
void ElasticOperator::Data::eachTet(BatchTangent* tangents, const F& f) const
{
    parallelChunks(p.patches.size(), 1, [&](std::size_t i, std::size_t) {
        const Patch& patch = p.patches[i];
        for (std::size_t b = patch.firstBatch; b < patch.firstBatch + patch.batches; ++b)
            for (std::size_t t = 0; t < std::size_t(tetmesh::kMostTets); ++t)
                for (std::size_t l = 0; l < kLanes; ++l)
                    if (const double share = volumeShare(b, t, l); share > 0) f(tangents[b], t, l, patch.mu * share * h);
    });
}

void ElasticOperator::project(Tangent& tangent) const
{
    data_->eachTet(tangent.batches_.get(), [&](BatchTangent& batch, std::size_t t, std::size_t l, double mu) {
        const double least = -mu * (1 + tangent.share_);
        double T[6];
        for (std::size_t k = 0; k < 6; ++k) T[k] = batch.tet[t].T[k][l];
        const Eigen::SelfAdjointEigenSolver<Mat3> eigen(unpackSymmetric(T));
        if (eigen.eigenvalues()[0] >= least) return;
        const Vec3 clamped = eigen.eigenvalues().cwiseMax(least);
        packSymmetric(eigen.eigenvectors() * clamped.asDiagonal() * eigen.eigenvectors().transpose(), T);
        for (std::size_t k = 0; k < 6; ++k) batch.tet[t].T[k][l] = float(T[k]);
    });
}

void ElasticOperator::warp(Tangent& tangent) const
{
    tangent.share_ = 0;
    data_->eachTet(tangent.batches_.get(), [](BatchTangent& batch, std::size_t t, std::size_t l, double mu) {
        for (std::size_t k = 0; k < 6; ++k) batch.tet[t].T[k][l] = k < 3 ? float(-mu) : 0;
    });
}

template <class V>
double ElasticOperator::multiply(const Tangent& tangent, std::span<const V> u) const
{
    const Data& d = *data_;
    d.eachPatch(u, [&](std::size_t i, const typename V::Scalar* in, typename V::Scalar* out) {
        const PatchData patch = d.patchData(i, tangent.batches_.get(), tangent.share_);
        if constexpr (std::is_same_v<V, Vec3>)
            kernel().product(patch, d.cellDilation, in, out);
        else
            kernel().productSingle(patch, d.cellDilation, in, out);
        d.patchEnergy[i] = patchDot(in, out, 3 * d.p.patches[i].stride());
    });
    d.work.products += 1;
    d.work.productTets += d.p.tets;
    return d.totalEnergy();
}

template <class V>
NodeSums<V> ElasticOperator::sums() const
{
    return data_->sums<V>();
}

template double ElasticOperator::multiply<Vec3>(const Tangent&, std::span<const Vec3>) const;
template double ElasticOperator::multiply<Vec3f>(const Tangent&, std::span<const Vec3f>) const;
template NodeSums<Vec3> ElasticOperator::sums<Vec3>() const;
template NodeSums<Vec3f> ElasticOperator::sums<Vec3f>() const;

namespace {

/// The rotation nearest to m, a weighted mean of rotations.
Mat3 nearestRotation(const Mat3& m)
{
    constexpr double kNear = 0.3;  // Newton-Schulz converges from here, in four steps to single precision
    Mat3 R = m;
    for (int step = 0; step < 4; ++step) {
        const Mat3 off = Mat3::Identity() - R.transpose() * R;
        if (step == 0 && !(off.norm() < kNear && R.determinant() > 0)) return signedPolar(m).R;
        R += 0.5 * R * off;
    }
    return R;
}

}  // namespace

void ElasticOperator::average(const ElasticOperator& fine, const Tangent& fineTangent, const FinerElements& finer, Tangent& tangent) const
{
    const Data &d = *data_, &f = *fine.data_;
    if (tangent.count_ != d.p.batches.size()) {
        tangent.resize(d.p.batches.size());
        std::memset(static_cast<void*>(tangent.batches_.get()), 0, tangent.bytes());  // lanes that no element fills
    }
    tangent.share_ = fineTangent.share_;
    parallelChunks(d.elements, 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t e = begin; e < end; ++e) {
            struct Sum {
                Mat3 R = Mat3::Zero();
                double share = 0, T[6] = {};
            } sum[tetmesh::kMostTets];
            for (std::uint32_t c = finer.start[e]; c < finer.start[e + 1]; ++c) {
                const std::size_t at = f.p.laneOfElement[finer.children[c].element], batch = at / kLanes, lane = at % kLanes;
                const BatchTangent& from = fineTangent.batches_[batch];
                for (std::size_t t = 0; t < std::size_t(tetmesh::kMostTets); ++t) {
                    const double share = f.volumeShare(batch, t, lane);
                    if (!(share > 0)) continue;
                    Sum& to = sum[finer.children[c].coarseTet[t]];
                    to.share += share;
                    for (int k = 0; k < 9; ++k) to.R(k / 3, k % 3) += share * from.tet[t].R[k][lane];
                    for (int k = 0; k < 6; ++k) to.T[k] += from.tet[t].T[k][lane];
                }
            }
            const std::size_t batch = d.p.laneOfElement[e] / kLanes, lane = d.p.laneOfElement[e] % kLanes;
            for (std::size_t t = 0; t < std::size_t(tetmesh::kMostTets); ++t) {
                BatchTangent::Tet& to = tangent.batches_[batch].tet[t];
                const Mat3 R = sum[t].share > 0 ? nearestRotation(sum[t].R / sum[t].share) : Mat3(Mat3::Identity());
                for (int k = 0; k < 9; ++k) to.R[k][lane] = float(R(k / 3, k % 3));
                // T is per V / h^2: a coarse tet has the volume of its finer ones and twice their h.
                for (int k = 0; k < 6; ++k) to.T[k][lane] = float(sum[t].T[k] / 4);
            }
        }
    });
}

namespace {

/// q x as a matrix.
Mat3 crossMatrix(const Vec3& q)
{
    Mat3 m;
    m << 0, -q.z(), q.y(), q.z(), 0, -q.x(), -q.y(), q.x(), 0;
    return m;
}

}  // namespace

ElasticOperator::ElementMatrix ElasticOperator::elementMatrix(const Tangent& tangent, std::size_t element) const
{
    const Data& d = *data_;
    const std::size_t at = d.p.laneOfElement[element], b = at / kLanes, lane = at % kLanes;
    const tetmesh::CellTets& cell = tetmesh::cellTets(d.p.batches[b].shape);
    const auto patch = std::upper_bound(d.p.patches.begin(), d.p.patches.end(), element,
                                        [](std::size_t e, const Patch& p) { return e < p.firstElement; }) - 1;
    const double scale = d.h * (1 + tangent.share_), mu = patch->mu * scale, lambda = patch->lambda * scale;
    ElementMatrix K = ElementMatrix::Zero();
    Eigen::Matrix<double, 24, 1> bulk = Eigen::Matrix<double, 24, 1>::Zero();
    double cellShare = 0;
    for (std::size_t t = 0; t < std::size_t(cell.count); ++t) {
        const double V = d.volumeShare(b, t, lane);
        if (!(V > 0)) continue;
        cellShare += V;
        const BatchTangent::Tet& tet = tangent.batches_[b].tet[t];
        Mat3 R;
        double packed[6];
        for (int k = 0; k < 9; ++k) R(k / 3, k % 3) = tet.R[k][lane];
        for (int k = 0; k < 6; ++k) packed[k] = tet.T[k][lane];
        const Mat3 T = unpackSymmetric(packed);
        for (std::size_t i = 0; i < 4; ++i) {
            const Vec3 gi(cell.gradient[t][i].data()), qi = R * gi;
            const Eigen::Index row = 3 * cell.corner[t][i];
            bulk.segment<3>(row) += V * qi;
            for (std::size_t j = 0; j < 4; ++j) {
                const Vec3 gj(cell.gradient[t][j].data()), qj = R * gj;
                K.block<3, 3>(row, 3 * cell.corner[t][j]) += 2 * mu * V * gi.dot(gj) * Mat3::Identity() +
                                                             (d.cellDilation ? -2. / 3. * mu : lambda) * V * qi * qj.transpose() +
                                                             crossMatrix(qi) * T * crossMatrix(qj).transpose();
            }
        }
    }
    if (d.cellDilation && cellShare > 0) K += (lambda + 2. / 3. * mu) / cellShare * bulk * bulk.transpose();
    return K;
}

void ElasticOperator::addProduct(const Tangent& tangent, std::span<const Vec3> u, std::span<Vec3> out) const
{
    (void)multiply(tangent, u);
    addSums(sums<Vec3>(), out);
}

NodeSums<ElasticOperator::PackedBlock> ElasticOperator::diagonal(const Tangent& tangent) const
{
    const Data& d = *data_;
    PackedBlock* const slot = d.slots.as<PackedBlock>();
    parallelChunks(d.p.patches.size(), 1, [&](std::size_t i, std::size_t) {
        const Patch& patch = d.p.patches[i];
        const std::size_t stride = patch.stride();
        double* const out = d.out[std::size_t(threadSlot())].as<double>();
        std::fill_n(out, kDiagonalRows * stride, 0.);
        kernel().diagonal(d.patchData(i, tangent.batches_.get(), tangent.share_), d.cellDilation, out);
        for (std::size_t n = 0; n < patch.nodes; ++n)
            for (std::size_t k = 0; k < kDiagonalRows; ++k) slot[patch.firstSlot + n][Eigen::Index(k)] = out[k * stride + n];
    });
    return d.sums<PackedBlock>();
}

void ElasticOperator::addDiagonal(const Tangent& tangent, std::span<Mat3> blocks) const
{
    const auto sums = diagonal(tangent);
    parallelChunks(blocks.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) blocks[n] += unpackSymmetric(sums(n).data());
    });
}

}  // namespace vdbfrac::solver
