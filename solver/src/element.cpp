#include <vdbfrac/solver/element.h>

#include "strain_law.h"

namespace vdbfrac::solver {

Mat3 deformationGradient(const ElementOf& e, std::size_t t, std::span<const Vec3> x)
{
    const tetmesh::CellTets& tets = tetmesh::cellTets(e.element.shape);
    const auto at = [&](std::size_t a) { return x[e.element.node[std::size_t(tets.corner[t][a])]]; };
    Mat3 F = Mat3::Zero();
    for (std::size_t a = 1; a < 4; ++a) {
        const auto& gradient = e.element.shape == tetmesh::CellShape::tet ? (*e.gradients)[a - 1] : tets.gradient[t][a];
        F += (at(a) - at(0)) * Eigen::Map<const Vec3>(gradient.data()).transpose() / e.h;
    }
    return e.inverseFlow ? Mat3(F * e.inverseFlow[t]) : F;
}

std::array<Mat3, tetmesh::kMaxTets> elementStress(const ElementOf& e, std::span<const Vec3> x, const Material& m,
                                                  Elasticity elasticity)
{
    const tetmesh::CellTets& tets = tetmesh::cellTets(e.element.shape);
    const double theta = tets.count > 1 ? elasticity.meanStrain : 0;
    const StrainLaw& law = lawOf(elasticity.strain);
    std::array<Mat3, tetmesh::kMaxTets> stress;
    double volume = 0, dilation = 0;
    Mat3 mean = Mat3::Zero();
    for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
        if (e.element.fraction[t] == 0) continue;
        const double V = tets.volume[t] * e.element.fraction[t] * (e.stiffness ? double(e.stiffness[t]) : 1.);
        const Mat3 F = deformationGradient(e, t, x);
        stress[t] = law.strain(F);
        volume += V, dilation += V * stress[t].trace(), mean += V * F;
    }
    const Mat3 meanStrain = theta > 0 && volume > 0 ? law.strain(mean / volume) : Mat3(Mat3::Zero());
    for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
        if (e.element.fraction[t] == 0) continue;
        const Mat3 shear = (1 - theta) * stress[t] + theta * meanStrain;
        const double bulk = elasticity.volumetric == Volumetric::cell ? dilation / volume : stress[t].trace();
        stress[t] =
            (e.stiffness ? double(e.stiffness[t]) : 1.) * (2 * m.mu * (shear - shear.trace() / 3 * Mat3::Identity()) +
                                                           (m.lambda + 2. / 3. * m.mu) * bulk * Mat3::Identity());
    }
    return stress;
}

double elasticEnergy(const ElementOf& e, std::span<const Vec3> x, const Material& m, Elasticity elasticity)
{
    const tetmesh::CellTets& tets = tetmesh::cellTets(e.element.shape);
    const bool cellDilation = elasticity.volumetric == Volumetric::cell;
    const double own = cellDilation ? -2. / 3. * m.mu : m.lambda;  // of tr(e)^2 / 2, in each tet
    const double theta = tets.count > 1 ? elasticity.meanStrain : 0;
    const StrainLaw& law = lawOf(elasticity.strain);
    const auto density = [&](const Mat3& F) {
        const Mat3 strain = law.strain(F);
        return m.mu * strain.squaredNorm() + 0.5 * own * strain.trace() * strain.trace();
    };
    double energy = 0, volume = 0, dilation = 0;
    Mat3 mean = Mat3::Zero();
    for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
        if (e.element.fraction[t] == 0) continue;
        const double V =
            e.h * e.h * e.h * tets.volume[t] * e.element.fraction[t] * (e.stiffness ? double(e.stiffness[t]) : 1.);
        const Mat3 F = deformationGradient(e, t, x);
        energy += (1 - theta) * V * density(F);
        volume += V, dilation += V * law.strain(F).trace(), mean += V * F;
    }
    if (theta > 0 && volume > 0) energy += theta * volume * density(mean / volume);
    if (cellDilation && volume > 0) energy += 0.5 * (m.lambda + 2. / 3. * m.mu) * dilation * dilation / volume;
    return energy;
}

}  // namespace vdbfrac::solver
