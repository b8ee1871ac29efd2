#include <vdbfrac/solver/elastic_operator.h>

#include "operator_data.h"

#include <vdbfrac/base/parallel.h>

#include <Eigen/Dense>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <type_traits>

namespace vdbfrac::solver {

Tangent::Tangent() = default;
Tangent::~Tangent() = default;
Tangent::Tangent(Tangent&&) noexcept = default;
Tangent& Tangent::operator=(Tangent&&) noexcept = default;
std::size_t Tangent::bytes() const { return capacity_ * sizeof(TetTangent) + yieldingCount_ * sizeof(LaneYielding); }

void Tangent::resize(std::size_t tets)
{
    if (tets > capacity_) {
        capacity_ = capacity_ == 0 ? tets : tets + tets / 8;              // cracks add a few a step
        tets_ = std::make_unique_for_overwrite<TetTangent[]>(capacity_);  // first touched by the threads that fill it
    }
    count_ = tets;
}

void Tangent::resetYielding(std::size_t batches)
{
    if (batches != yieldingCount_)
        yielding_ = batches > 0 ? std::make_unique_for_overwrite<LaneYielding[]>(batches) : nullptr;
    yieldingCount_ = batches;
    for (std::size_t b = 0; b < batches; ++b) std::fill_n(yielding_[b].left, kLanes, 1.F), yielding_[b].any = false;
}

namespace {

/// Sylvester's criterion, far cheaper than eigenvalues.
bool isDefinite(const Mat3& S)
{
    return S(0, 0) > 0 && S.topLeftCorner<2, 2>().determinant() > 0 && S.determinant() > 0;
}

/// Sums over the tets round each node of a quarter of the tet's material volume, times the density and times the
/// stiffness of its material: one pass over the elements for both.
void lump(std::span<const ElementSet> sets, double h, std::vector<double>& mass, std::vector<double>& stiffness)
{
    for (const ElementSet& set : sets) {
        const Material& m = set.material;
        const double stiff = 8 * (2 * m.mu + std::abs(m.lambda)) / (h * h);
        for (std::size_t number = 0; number < set.elements.size(); ++number) {
            const tetmesh::CellElement& e = set.elements[number];
            const tetmesh::CellTets& tets = tetmesh::cellTets(e.shape);
            for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
                const double a = 0.25 * m.rho * h * h * h * tets.volume[t] * e.fraction[t];
                const double b =
                    0.25 * stiff * h * h * h * tets.volume[t] * e.fraction[t] * solver::stiffness(set, number, t);
                for (int c : tets.corner[t]) {
                    const std::size_t n = set.firstNode + e.node[std::size_t(c)];
                    mass[n] += a, stiffness[n] += b;
                }
            }
        }
    }
}

/// to[n] += sum of the slots of node n.
void addSums(const NodeSums<Vec3>& sums, std::span<Vec3> to)
{
    eachNode<double>(to.size(), [&](std::size_t n) { to[n] += sums(n); });
}

}  // namespace

ElasticOperator::ElasticOperator(std::span<const ElementSet> sets, std::size_t nodeCount, double h,
                                 Elasticity elasticity)
    : data_(std::make_unique<Data>())
{
    Data& d = *data_;
    d.sets.assign(sets.begin(), sets.end());
    d.p = makePatches(sets, nodeCount, elasticity.meanStrain > 0);
    d.mass.assign(nodeCount, 0.), d.stiffness.assign(nodeCount, 0.);
    lump(sets, h, d.mass, d.stiffness);
    d.patchEnergy.resize(d.p.patches.size());
    d.h = h;
    d.cellDilation = elasticity.volumetric == Volumetric::cell;
    d.meanStrain = elasticity.meanStrain;
    d.strain = elasticity.strain;
    d.law = &lawOf(d.strain);
    d.slots = Scratch(kDiagonalRows * d.p.slotCount);
    for (int thread = 0; thread < threadSlots(); ++thread) {
        d.in.emplace_back(3 * d.p.largestStride);
        d.out.emplace_back(kDiagonalRows * d.p.largestStride);
        d.psi.emplace_back();
    }
    for (const ElementSet& set : sets) d.elements += set.elements.size();
}
ElasticOperator::~ElasticOperator() = default;
ElasticOperator::ElasticOperator(ElasticOperator&&) noexcept = default;
ElasticOperator& ElasticOperator::operator=(ElasticOperator&&) noexcept = default;

std::span<const ElementSet> ElasticOperator::sets() const { return data_->sets; }
double ElasticOperator::h() const { return data_->h; }
Elasticity ElasticOperator::elasticity() const
{
    return {data_->cellDilation ? Volumetric::cell : Volumetric::none, data_->strain, data_->meanStrain};
}
std::size_t ElasticOperator::nodeCount() const { return data_->mass.size(); }
std::int64_t ElasticOperator::tetCount() const { return data_->p.tets; }
std::span<const double> ElasticOperator::mass() const { return data_->mass; }
std::span<const double> ElasticOperator::stiffness() const { return data_->stiffness; }
const ElasticWork& ElasticOperator::work() const { return data_->work; }

void ElasticOperator::setAsleep(std::span<const std::uint8_t> nodes)
{
    Data& d = *data_;
    const std::vector<std::uint8_t> before = std::move(d.asleep);
    d.asleep.clear();
    d.tetsAsleep = 0;
    if (nodes.empty()) return;
    d.asleep.resize(d.p.patches.size());
    d.energyAsleep.resize(d.p.patches.size());
    for (std::size_t i = 0; i < d.p.patches.size(); ++i) {
        const Patch& patch = d.p.patches[i];
        const std::span runs = std::span(d.p.runs).subspan(patch.firstRun, patch.runs);
        const bool asleep = std::all_of(runs.begin(), runs.end(), [&](const NodeRun& run) {
            const auto own = nodes.subspan(run.node, run.count);
            return std::all_of(own.begin(), own.end(), [](std::uint8_t mark) { return mark != 0; });
        });
        d.asleep[i] = asleep;
        if (asleep) d.tetsAsleep += patch.tets;
        if (before.empty() || !before[i]) d.energyAsleep[i] = std::numeric_limits<double>::quiet_NaN();
    }
}

bool ElasticOperator::hasAsleep() const { return data_->tetsAsleep > 0; }

std::size_t ElasticOperator::bytes() const
{
    const Data& d = *data_;
    return d.p.bytes() + (d.mass.size() + d.stiffness.size()) * sizeof(double) +
           (kDiagonalRows * d.p.slotCount + (kDiagonalRows + 3) * d.p.largestStride * d.in.size()) * sizeof(double);
}

std::size_t ElasticOperator::productBytes() const
{
    const Patches& p = data_->p;
    const auto contiguous = std::size_t(
        std::count_if(p.contiguous.begin(), p.contiguous.end(), [](std::uint32_t slot) { return slot != kNoSlot; }));
    // Start and slots.
    const std::size_t unread = sizeof(std::uint32_t) * (p.laneOfElement.size() + 2 * kLanes * contiguous);
    return p.tangentCount * sizeof(TetTangent) + p.bytes() - unread + (2 * p.slots.size() + nodeCount()) * sizeof(Vec3);
}

std::size_t ElasticOperator::productBytesWritten() const { return data_->p.slots.size() * sizeof(Vec3); }

double ElasticOperator::evaluate(std::span<const Vec3> x, std::span<Vec3> gradient, Tangent* tangent,
                                 double share) const
{
    const Data& d = *data_;
    if (tangent) {
        tangent->resize(d.p.tangentCount);
        tangent->ofCells_ = false;
        tangent->share_ = share;
        tangent->resetYielding(d.p.yields.size());
    }
    std::atomic<std::int64_t> robust = 0;
    d.eachPatch(x, tangent, [&](std::size_t i, const PatchData& patch, const double* in, double* out) {
        const KernelResult r = kernel().evaluate(patch, kRobust, in, out);
        d.patchEnergy[i] = r.energy;
        if (r.robustTets) robust += r.robustTets;
    });
    if (!gradient.empty()) addSums(d.sums<Vec3>(), gradient);
    d.work.robustTets += robust;
    d.work.evaluations += 1;
    d.work.evaluatedTets += d.tetsAwake();
    return d.totalEnergy() + d.asleepEnergy(x);
}

void ElasticOperator::energyDensities(std::span<const Vec3> x, std::vector<double>& density, bool all) const
{
    const Data& d = *data_;
    constexpr std::size_t kTets = tetmesh::kMaxTets;
    density.resize(d.elements * kTets);
    d.eachPatch(x, nullptr, all, [&](std::size_t i, PatchData patch, const double* in, double* out) {
        const Patch& range = d.p.patches[i];
        std::vector<double>& psi = d.psi[std::size_t(threadSlot())];
        psi.resize(std::max(psi.size(), range.batches * kTets * kLanes));
        patch.psi = psi.data();
        (void)kernel().evaluate(patch, kRobust, in, out);
        for (std::size_t e = range.firstElement; e < range.firstElement + range.elements; ++e) {
            const std::size_t batch = d.p.laneOfElement[e] / kLanes, lane = d.p.laneOfElement[e] % kLanes;
            for (std::size_t t = 0; t < kTets; ++t)
                density[e * kTets + t] = t < d.p.tetsOf(batch) && d.volumeShare(batch, t, lane) > 0
                                             ? psi[((batch - range.firstBatch) * kTets + t) * kLanes + lane]
                                             : 0;
        }
    });
    for (std::size_t i = 0; i < d.p.patches.size() && !all; ++i)
        if (const Patch& patch = d.p.patches[i]; d.isAsleep(i))
            std::fill_n(density.begin() + std::ptrdiff_t(patch.firstElement * kTets), patch.elements * kTets, 0.);
    std::size_t entry = 0;  // what the kernel has is over the stiffness
    for (const ElementSet& set : d.sets) {
        for (std::size_t i = 0; i < set.stiffness.size(); ++i) density[entry + i] *= double(set.stiffness[i]);
        entry += set.elements.size() * kTets;
    }
    d.work.evaluations += 1;
    d.work.evaluatedTets += all ? d.p.tets : d.tetsAwake();
}

void ElasticOperator::shearStrains(std::span<const Vec3> x, std::vector<double>& n) const
{
    const Data& d = *data_;
    n.assign(d.elements, 0.);
    d.eachPatch(x, nullptr, [&](std::size_t i, PatchData patch, const double* in, double* out) {
        if (!patch.yields) return;
        const Patch& range = d.p.patches[i];
        std::vector<double>& shear = d.psi[std::size_t(threadSlot())];
        shear.resize(std::max(shear.size(), std::size_t(range.batches) * kLanes));
        patch.shear = shear.data();
        (void)kernel().evaluate(patch, kRobust, in, out);
        for (std::size_t e = range.firstElement; e < range.firstElement + range.elements; ++e)
            n[e] = shear[d.p.laneOfElement[e] - range.firstBatch * kLanes];
    });
    d.work.evaluations += 1;
    d.work.evaluatedTets += d.tetsAwake();
}

/// Energy of the patches that are left out [J]; it is found once.
double ElasticOperator::Data::asleepEnergy(std::span<const Vec3> x) const
{
    parallelChunks(asleep.size(), 1, [&](std::size_t i, std::size_t) {
        if (!asleep[i] || !std::isnan(energyAsleep[i])) return;
        const PatchData patch = patchData(i, nullptr);
        double* const own = in[std::size_t(threadSlot())].as<double>();
        double* const unused = out[std::size_t(threadSlot())].as<double>();
        kernel().of<double>().read(patch, x.data()->data(), own);
        std::fill_n(unused, 3 * patch.stride, 0.);
        energyAsleep[i] = kernel().evaluate(patch, kRobust, own, unused).energy;
    });
    double sum = 0;
    for (std::size_t i = 0; i < asleep.size(); ++i) sum += asleep[i] ? energyAsleep[i] : 0;
    return sum;
}

/// A tangent for the cells of a patch that is left out: no rotation, no stiffness.
void ElasticOperator::Data::clearTangents(std::size_t patch, TetTangent* cells) const
{
    for (std::size_t b = p.patches[patch].firstBatch; b < p.patches[patch].firstBatch + p.patches[patch].batches; ++b)
        for (std::size_t l = 0; l < kLanes; ++l) {
            for (int k = 0; k < 9; ++k) cells[b].R[k][l] = k % 4 == 0;
            for (int k = 0; k < 6; ++k) cells[b].T[k][l] = 0;
        }
}

template <class F>
void ElasticOperator::Data::eachTet(const Tangent& tangent, const F& f) const
{
    parallelChunks(p.patches.size(), 1, [&](std::size_t i, std::size_t) {
        if (isAsleep(i)) return;
        const Patch& patch = p.patches[i];
        for (std::size_t b = patch.firstBatch; b < patch.firstBatch + patch.batches; ++b)
            for (std::size_t t = 0; t < p.tangentsOf(b); ++t)
                for (std::size_t l = 0; l < kLanes; ++l)
                    if (const double share = shearShare(b, t, l); share > 0)
                        f(tangent.tets_[p.batches[b].tangent + t], l, patch.mu * share * h * leftAt(tangent, b, l));
    });
}

void ElasticOperator::averageTets(const Tangent& tangent, Tangent& cells) const
{
    const Data& d = *data_;
    cells.resize(d.p.batches.size());
    cells.ofCells_ = true;
    cells.share_ = tangent.share_;
    cells.resetYielding(tangent.yieldingCount_);
    for (std::size_t b = 0; b < tangent.yieldingCount_; ++b)
        std::copy_n(tangent.yielding_[b].left, kLanes, cells.yielding_[b].left);
    parallelChunks(d.p.patches.size(), 1, [&](std::size_t i, std::size_t) {
        if (d.isAsleep(i)) {
            d.clearTangents(i, cells.tets_.get());
            return;
        }
        kernel().averageTets(d.patchData(i, &tangent), kRobust, cells.tets_.get() + d.p.patches[i].firstBatch);
    });
}

void ElasticOperator::project(Tangent& tangent) const
{
    const double minOverMu = data_->law->minEigenvalue(tangent.share_);
    data_->eachTet(tangent, [&](TetTangent& tet, std::size_t l, double mu) {
        const double least = mu * minOverMu;
        double T[6];
        for (std::size_t k = 0; k < 6; ++k) T[k] = tet.T[k][l];
        const Mat3 twist = unpackSymmetric(T);
        if (isDefinite(twist - least * Mat3::Identity())) return;
        const Eigen::SelfAdjointEigenSolver<Mat3> eigen(twist);
        const Vec3 clamped = eigen.eigenvalues().cwiseMax(least);
        packSymmetric(eigen.eigenvectors() * clamped.asDiagonal() * eigen.eigenvectors().transpose(), T);
        for (std::size_t k = 0; k < 6; ++k) tet.T[k][l] = float(T[k]);
    });
}

void ElasticOperator::warp(Tangent& tangent) const
{
    const double minOverMu = data_->law->minEigenvalue(tangent.share_);
    data_->eachTet(tangent, [&](TetTangent& tet, std::size_t l, double mu) {
        for (std::size_t k = 0; k < 6; ++k) tet.T[k][l] = k < 3 ? float(mu * minOverMu) : 0;
    });
}

template <class V>
Product<V> ElasticOperator::multiply(const Tangent& tangent, std::span<const V> u, const NodeBlocks* blocks) const
{
    const Data& d = *data_;
    using Real = typename V::Scalar;
    d.eachPatch(u, &tangent, [&](std::size_t i, const PatchData& patch, const Real* in, Real* out) {
        d.patchEnergy[i] = kernel().of<Real>().product(patch, in, out);
    });
    d.work.products += 1;
    d.work.productTets += d.tetsAwake();
    double energy = d.totalEnergy();
    if (blocks)
        energy += blocks->multiply(u, [&](std::uint32_t node, const V& sum) {
            if (V* slot = d.firstSlot<V>(node)) *slot += sum;
        });
    return {energy, d.sums<V>()};
}

template Product<Vec3> ElasticOperator::multiply(const Tangent&, std::span<const Vec3>, const NodeBlocks*) const;
template Product<Vec3f> ElasticOperator::multiply(const Tangent&, std::span<const Vec3f>, const NodeBlocks*) const;

void ElasticOperator::addProduct(const Tangent& tangent, std::span<const Vec3> u, std::span<Vec3> out,
                                 const NodeBlocks* blocks) const
{
    addSums(multiply(tangent, u, blocks).sums, out);
}

NodeSums<ElasticOperator::PackedBlock> ElasticOperator::diagonal(const Tangent& tangent, const NodeBlocks* blocks) const
{
    const Data& d = *data_;
    PackedBlock* const slot = d.slots.as<PackedBlock>();
    parallelChunks(d.p.patches.size(), 1, [&](std::size_t i, std::size_t) {
        if (d.isAsleep(i)) {
            d.clearSlots<double>(i, kDiagonalRows);
            return;
        }
        const Patch& patch = d.p.patches[i];
        const std::size_t stride = patch.stride();
        double* const out = d.out[std::size_t(threadSlot())].as<double>();
        std::fill_n(out, kDiagonalRows * stride, 0.);
        kernel().diagonal(d.patchData(i, &tangent), out);
        for (std::size_t n = 0; n < patch.nodes; ++n)
            for (std::size_t k = 0; k < kDiagonalRows; ++k)
                slot[patch.firstSlot + n][Eigen::Index(k)] = out[k * stride + n];
    });
    for (std::size_t row = 0; blocks && row < blocks->rows(); ++row) {
        PackedBlock* const own = d.firstSlot<PackedBlock>(blocks->node(row));
        if (!own) continue;
        const auto damping = blocks->damping(row);
        for (std::size_t k = 0; k < kDiagonalRows; ++k) (*own)[Eigen::Index(k)] += double(damping[k]);
    }
    return d.sums<PackedBlock>();
}

}  // namespace vdbfrac::solver
