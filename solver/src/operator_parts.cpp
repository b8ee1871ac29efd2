// Parts of an elastic operator one at a time: matrices of elements, and the tangent of a coarse lattice.
#include "operator_data.h"

#include <Eigen/Dense>

#include <array>
#include <cstring>
#include <utility>

namespace vdbfrac::solver {

namespace {

/// What the finer cells in a coarse one add up to, weighted by their material.
struct FinerSum {
    Mat3 R = Mat3::Zero();
    double T[6] = {}, weight = 0, left = 0;

    void add(const TetTangent& cell, std::size_t lane, double share, double leftOfCell)
    {
        weight += share, left += share * leftOfCell;
        for (int k = 0; k < 9; ++k) R(k / 3, k % 3) += share * cell.R[k][lane];
        for (int k = 0; k < 6; ++k) T[k] += share * cell.T[k][lane];
    }
    void write(TetTangent& cell, std::size_t lane, const StrainLaw& law) const
    {
        const Mat3 mean = weight > 0 ? law.meanRotation(R / weight) : Mat3::Identity();
        for (int k = 0; k < 9; ++k) cell.R[k][lane] = float(mean(k / 3, k % 3));
        // T is times h, which is twice that of the finer cells.
        for (int k = 0; k < 6; ++k) cell.T[k][lane] = weight > 0 ? float(2 * T[k] / weight) : 0;
    }
};

/// Square of the highest angular frequency of a tet alone times h^2, a quarter of its mass on each vertex [m^2/s^2].
double highestOfTet(const Material& m, const tetmesh::TetGradients& last)
{
    Eigen::Matrix<double, 3, 4> g;
    for (int a = 0; a < 3; ++a) g.col(a + 1) = Vec3(last[std::size_t(a)].data());
    g.col(0) = -(g.col(1) + g.col(2) + g.col(3));
    Eigen::Matrix<double, 12, 12> K;  // over its volume
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) {
            const Vec3 gi = g.col(i), gj = g.col(j);
            K.block<3, 3>(3 * i, 3 * j) =
                m.mu * (gi.dot(gj) * Mat3::Identity() + gj * gi.transpose()) + m.lambda * gi * gj.transpose();
        }
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 12, 12>>(K, Eigen::EigenvaluesOnly).eigenvalues()[11] /
           (m.rho / 4);
}

/// highestOfTet() for the tets of a set: of those of the lattice that have not flowed it is found once.
class HighestOfTets {
public:
    explicit HighestOfTets(const ElementSet& set) : set_(set)
    {
        std::array<bool, 4> seen{};
        if (!set.gradients.empty()) return;
        for (const tetmesh::CellElement& e : set.elements) {
            if (std::exchange(seen[std::size_t(e.shape)], true)) continue;
            const tetmesh::CellTets& cell = tetmesh::cellTets(e.shape);
            for (std::size_t t = 0; t < std::size_t(cell.count); ++t) {
                const auto& g = cell.gradient[t];
                ofLattice_[std::size_t(e.shape)][t] = highestOfTet(set.material, {g[1], g[2], g[3]});
            }
        }
    }
    double operator()(std::size_t e, std::size_t t) const
    {
        const double highest = set_.gradients.empty() && !inverseFlow(set_, e, t)
                                   ? ofLattice_[std::size_t(set_.elements[e].shape)][t]
                                   : highestOfTet(set_.material, restGradients(set_, e, t));
        return highest * stiffness(set_, e, t);
    }

private:
    const ElementSet& set_;
    std::array<std::array<double, tetmesh::kMaxTets>, 4> ofLattice_{};
};

}  // namespace

double ElasticOperator::highestFrequency() const
{
    double highest = 0;
    for (const ElementSet& set : data_->sets) {
        const HighestOfTets of(set);
        highest = orderedMax(set.elements.size(), kChunk, highest, [&](std::size_t begin, std::size_t end) {
            double most = 0;
            for (std::size_t e = begin; e < end; ++e)
                for (std::size_t t = 0; t < std::size_t(tetmesh::cellTets(set.elements[e].shape).count); ++t)
                    most = std::max(most, of(e, t));
            return most;
        });
    }
    return std::sqrt(highest) / data_->h;
}

void ElasticOperator::averageCells(const ElasticOperator& fine, const Tangent& fineCells, const FinerElements& finer,
                                   Tangent& cells) const
{
    constexpr std::size_t kElements = 64;
    const Data &d = *data_, &f = *fine.data_;
    if (cells.count_ != d.p.batches.size()) {
        cells.resize(d.p.batches.size());
        std::memset(static_cast<void*>(cells.tets_.get()), 0,
                    cells.count_ * sizeof(TetTangent));  // lanes that no element fills
    }
    cells.ofCells_ = true;
    cells.share_ = fineCells.share_;
    cells.resetYielding(fineCells.yielding_ ? d.p.batches.size() : 0);
    parallelChunks(d.elements, kElements, [&](std::size_t begin, std::size_t end) {
        for (std::size_t e = begin; e < end; ++e) {
            FinerSum sum;
            for (std::uint32_t c = finer.start[e]; c < finer.start[e + 1]; ++c) {
                const std::size_t at = f.p.laneOfElement[finer.children[c]], batch = at / kLanes, lane = at % kLanes;
                sum.add(fineCells.tets_[batch], lane, f.cellShare(batch, lane), f.leftAt(fineCells, batch, lane));
            }
            const std::size_t at = d.p.laneOfElement[e];
            sum.write(cells.tets_[at / kLanes], at % kLanes, *d.law);
            if (cells.yielding_)
                cells.yielding_[at / kLanes].left[at % kLanes] = sum.weight > 0 ? float(sum.left / sum.weight) : 1;
        }
    });
}

ElasticOperator::ElementMatrix ElasticOperator::elementMatrix(const Tangent& tangent, std::size_t element) const
{
    const Data& d = *data_;
    const std::size_t at = d.p.laneOfElement[element], b = at / kLanes, lane = at % kLanes;
    const tetmesh::CellTets& cell = tetmesh::cellTets(d.p.batches[b].shape);
    const auto patch = std::upper_bound(d.p.patches.begin(), d.p.patches.end(), element,
                                        [](std::size_t e, const Patch& p) { return e < p.firstElement; }) -
                       1;
    const double scale = d.h * (1 + tangent.share_), whole = patch->mu * scale, lame = patch->lambda * scale;
    const double mu = whole * d.leftAt(tangent, b, lane), lambda = lame + 2. / 3. * (whole - mu);
    const double muOfTets = (1 - d.meanPart(b)) * mu;
    ElementMatrix K = ElementMatrix::Zero();
    Eigen::Matrix<double, 24, 1> bulk = Eigen::Matrix<double, 24, 1>::Zero();
    Eigen::Matrix<double, 3, 8> mean = Eigen::Matrix<double, 3, 8>::Zero();  // V h grad N of each corner
    const double cellShare = d.cellShare(b, lane);
    for (std::size_t t = 0; t < std::size_t(cell.count); ++t) {
        const double V = d.volumeShare(b, t, lane);
        if (!(V > 0)) continue;
        const auto [R, T] = d.tangentAt(tangent, b, t, lane);
        for (std::size_t i = 0; i < 4; ++i) {
            const Vec3 gi = d.gradient(b, t, i, lane), qi = R * gi;
            const Eigen::Index row = 3 * cell.corner[t][i];
            bulk.segment<3>(row) += V * qi;
            mean.col(cell.corner[t][i]) += V * gi;
            for (std::size_t j = 0; j < 4; ++j) {
                const Vec3 gj = d.gradient(b, t, j, lane), qj = R * gj;
                const Mat3 dilating = (d.cellDilation ? -2. / 3. * muOfTets : lambda) * V * qi * qj.transpose();
                K.block<3, 3>(row, 3 * cell.corner[t][j]) += d.law->block(gi, gj, R, T, muOfTets * V) + dilating;
            }
        }
    }
    if (d.cellDilation && cellShare > 0) K += (lame + 2. / 3. * whole) / cellShare * bulk * bulk.transpose();
    if (d.meanPart(b) > 0 && cellShare > 0) {
        const auto [R, T] = d.tangentAt(tangent, b, std::size_t(cell.count), lane);
        const double muV = d.meanPart(b) * mu * cellShare;
        for (Eigen::Index i = 0; i < 8; ++i)
            for (Eigen::Index j = 0; j < 8; ++j) {
                const Vec3 gi = mean.col(i) / cellShare, gj = mean.col(j) / cellShare;
                K.block<3, 3>(3 * i, 3 * j) +=
                    d.law->block(gi, gj, R, T, muV) - 2. / 3. * muV * R * gi * gj.transpose() * R.transpose();
            }
    }
    if (!tangent.ofCells_ && tangent.yielding_ && tangent.yielding_[b].any) {
        Eigen::Matrix<double, 24, 1> slope;
        for (int i = 0; i < 24; ++i) slope[i] = double(tangent.yielding_[b].slope[i / 3][i % 3][lane]);
        K -= slope * slope.transpose();
    }
    return K;
}

}  // namespace vdbfrac::solver
