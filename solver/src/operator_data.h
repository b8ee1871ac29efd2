// What an elastic operator holds, and its loop over patches. Not installed.
#pragma once

#include "node_loops.h"
#include "patches.h"
#include "robust_tet.h"
#include "strain_law.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>

namespace vdbfrac::solver {

inline constexpr std::size_t kDiagonalRows = 6;  // numbers of a symmetric 3x3 block

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

struct ElasticOperator::Data {
    Patches p;
    std::vector<double> mass, stiffness;
    double h = 1;
    bool cellDilation = true;
    double meanStrain = 0;  // share of the means of cells in the shear modulus
    Strain strain = Strain::corotational;
    const StrainLaw* law = nullptr;  // of `strain`
    std::size_t elements = 0;
    std::vector<ElementSet> sets;
    mutable ElasticWork work;
    mutable std::vector<double> patchEnergy;  // of the last pass
    std::vector<std::uint8_t> asleep;         // is a patch left out? Empty: none is
    std::int64_t tetsAsleep = 0;
    mutable std::vector<double> energyAsleep;  // of such a patch [J]; NaN: not yet known
    // Scratch, made once: what each patch adds to each of its nodes, and vectors of the patch that a thread works on.
    Scratch slots{0};
    std::vector<Scratch> in, out;
    mutable std::vector<std::vector<double>> psi;  // of energyDensities and shearStrains, made when first asked for

    /// `tangent` may be null.
    PatchData patchData(std::size_t i, const Tangent* tangent) const
    {
        const Patch& patch = p.patches[i];
        PatchData d;
        d.batch = p.batches.data() + patch.firstBatch;
        d.corners = p.corners.data();
        d.volumes = p.volumes.data();
        d.tets = p.laneTets.data();
        d.flowed = p.laneCells.data();
        if (tangent) {
            if (tangent->ofCells_)
                d.cells = tangent->tets_.get() + patch.firstBatch;
            else
                d.tangent = tangent->tets_.get();
            d.share = tangent->share_;
            if (tangent->yielding_) d.yielding = tangent->yielding_.get() + patch.firstBatch;
        }
        if (patch.yield) d.yields = p.yields.data() + patch.firstBatch, d.yieldShare = patch.yield->share;
        d.run = p.runs.data() + patch.firstRun;
        d.batches = int(patch.batches), d.runs = int(patch.runs);
        d.nodes = int(patch.nodes), d.stride = int(patch.stride());
        d.h = h;
        d.mu = patch.mu, d.lambda = patch.lambda, d.bulk = patch.lambda + 2. / 3. * patch.mu;
        d.strain = strain, d.cellDilation = cellDilation, d.meanStrain = meanStrain;
        return d;
    }

    /// Calls f(patch number, patch, in, out) for every patch, with scratch of its own: `in` holds x, `out` three rows
    /// of zeros; then puts `out` into the patch's slots. Those of patches that are left out are 0, as is their energy.
    template <class V, class F>
    void eachPatch(std::span<const V> x, const Tangent* tangent, const F& f) const
    {
        eachPatch(x, tangent, false, f);
    }
    /// Of those that are left out too, with `all`.
    template <class V, class F>
    void eachPatch(std::span<const V> x, const Tangent* tangent, bool all, const F& f) const
    {
        using Real = typename V::Scalar;
        parallelChunks(p.patches.size(), 1, [&](std::size_t i, std::size_t) {
            if (!all && isAsleep(i)) {
                patchEnergy[i] = 0;
                clearSlots<Real>(i, 3);
                return;
            }
            const PatchData patch = patchData(i, tangent);
            [[maybe_unused]] const FlushFor<Real> flush{};
            Real* const u = in[std::size_t(threadSlot())].template as<Real>();
            Real* const sum = out[std::size_t(threadSlot())].template as<Real>();
            kernel().of<Real>().read(patch, x.data()->data(), u);
            std::fill_n(sum, 3 * patch.stride, Real(0));
            f(i, patch, u, sum);
            kernel().of<Real>().write(patch, sum, slots.as<Real>() + 3 * std::size_t(p.patches[i].firstSlot));
        });
    }

    template <class V>
    NodeSums<V> sums() const
    {
        return {slots.as<V>(), p.slotStart.data(), p.slots.data(), p.contiguous.data()};
    }

    /// One of the slots of a node, where what does not come from the elements is added; null without material.
    template <class V>
    V* firstSlot(std::uint32_t node) const
    {
        return p.slotStart[node] < p.slotStart[node + 1] ? slots.as<V>() + p.slots[p.slotStart[node]] : nullptr;
    }

    bool isAsleep(std::size_t patch) const { return !asleep.empty() && asleep[patch]; }
    std::int64_t tetsAwake() const { return p.tets - tetsAsleep; }
    template <class Real>
    void clearSlots(std::size_t patch, std::size_t rows) const
    {
        std::fill_n(slots.as<Real>() + rows * p.patches[patch].firstSlot, rows * p.patches[patch].slots(), Real(0));
    }
    double totalEnergy() const { return std::accumulate(patchEnergy.begin(), patchEnergy.end(), 0.); }

    /// Material volume of a tet over h^3, times its stiffness; 0 in a lane that is not used.
    double volumeShare(std::size_t batch, std::size_t t, std::size_t l) const
    {
        const Batch& b = p.batches[batch];
        if (b.shape == tetmesh::CellShape::tet) return p.laneTets[std::size_t(b.cut)].share[t][l];
        if (b.flowed) return p.laneCells[std::size_t(b.cut)].share[t][l];
        return b.cut < 0 ? tetmesh::cellTets(b.shape).volume[t] : p.volumes[std::size_t(b.cut)].share[t][l];
    }

    double cellShare(std::size_t batch, std::size_t l) const
    {
        double sum = 0;
        for (std::size_t t = 0; t < p.tetsOf(batch); ++t) sum += volumeShare(batch, t, l);
        return sum;
    }

    /// The part of the shear modulus that the mean of a cell has.
    double meanPart(std::size_t batch) const { return p.tetsOf(batch) > 1 ? meanStrain : 0; }

    /// volumeShare() times the part of the shear modulus that a tet has, or, behind the last, the mean.
    double shearShare(std::size_t batch, std::size_t t, std::size_t l) const
    {
        return t < p.tetsOf(batch) ? (1 - meanPart(batch)) * volumeShare(batch, t, l)
                                   : meanPart(batch) * cellShare(batch, l);
    }

    /// What is left of the shear modulus (Tangent).
    static double leftAt(const Tangent& tangent, std::size_t batch, std::size_t l)
    {
        return tangent.yielding_ ? double(tangent.yielding_[batch].left[l]) : 1;
    }

    /// h grad N_a of a tet.
    Vec3 gradient(std::size_t batch, std::size_t t, std::size_t a, std::size_t l) const
    {
        const Batch& b = p.batches[batch];
        if (b.shape != tetmesh::CellShape::tet && !b.flowed)
            return Vec3(tetmesh::cellTets(b.shape).gradient[t][a].data());
        const auto& own =
            b.flowed ? p.laneCells[std::size_t(b.cut)].gradient[t] : p.laneTets[std::size_t(b.cut)].gradient;
        Vec3 g = Vec3::Zero();
        for (std::size_t k = 0; k < 3; ++k)
            if (a == 0 || a == k + 1) g += (a == 0 ? -1 : 1) * Vec3(own[k][0][l], own[k][1][l], own[k][2][l]);
        return g;
    }

    /// R and T (TetTangent) of a tet in one lane, or behind the last of the mean: its own or those of its cell.
    std::pair<Mat3, Mat3> tangentAt(const Tangent& tangent, std::size_t batch, std::size_t t, std::size_t l) const
    {
        const TetTangent& tet = tangent.tets_[tangent.ofCells_ ? batch : p.batches[batch].tangent + t];
        Mat3 R;
        double packed[6];
        for (int k = 0; k < 9; ++k) R(k / 3, k % 3) = tet.R[k][l];
        for (int k = 0; k < 6; ++k) packed[k] = tet.T[k][l];
        const Mat3 T = unpackSymmetric(packed);
        if (!tangent.ofCells_) return {R, T};
        return {R, law->ofTet(R, shearShare(batch, t, l) * T)};
    }

    double asleepEnergy(std::span<const Vec3> x) const;
    void clearTangents(std::size_t patch, TetTangent* cells) const;

    /// Calls f(tangent, lane, mu V / h^2) for every tet with material and every mean, each with its part of what is
    /// left of mu.
    template <class F>
    void eachTet(const Tangent& tangent, const F& f) const;
};

}  // namespace vdbfrac::solver
