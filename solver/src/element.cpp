#include <vdbfrac/solver/element.h>

#include "strain_law.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace vdbfrac::solver {

namespace {

/// The strains of an element's tets and of their mean, which comes after them.
struct Strains : StrainsOf {
    std::size_t mean;                           // number of tets
    std::array<double, tetmesh::kMaxTets> V{};  // m^3, times the factor on the stiffness; 0: no material
    std::array<Mat3, kMost> F;                  // I without material
    double volume = 0, dilation = 0;            // sum of V; mean of tr(e) by V

    Strains(const ElementOf& e, std::span<const Vec3> x, Strain strain);
};

Strains::Strains(const ElementOf& element, std::span<const Vec3> x, Strain strain)
{
    const tetmesh::CellTets& tets = tetmesh::cellTets(element.element.shape);
    mean = std::size_t(tets.count);
    Mat3 sum = Mat3::Zero();
    for (std::size_t t = 0; t < mean; ++t) {
        const double fraction = element.element.fraction[t];
        F[t] = Mat3::Identity();
        if (fraction == 0) continue;
        V[t] = element.h * element.h * element.h * tets.volume[t] * fraction *
               (element.stiffness ? double(element.stiffness[t]) : 1.);
        F[t] = deformationGradient(element, t, x);
        volume += V[t], sum += V[t] * F[t];
    }
    F[mean] = volume > 0 ? Mat3(sum / volume) : Mat3(Mat3::Identity());
    lawOf(strain).measure(std::span(F).first(mean + 1), *this);
    for (std::size_t t = 0; t < mean; ++t) dilation += V[t] * e[t].trace();
    if (volume > 0) dilation /= volume;
}

/// Energy with the means of an element: mu |e|^2 + own tr(e)^2 / 2 in each tet, (1 - theta) of it its own and theta of
/// the mean F, and K / 2 of the square of the mean dilatation.
struct Moduli {
    double mu, own, K, theta;  // Pa, Pa, Pa, 1
    bool cellDilation;

    Moduli(const Material& m, Elasticity elasticity, int tets)
        : mu(m.mu),
          own(elasticity.volumetric == Volumetric::cell ? -2. / 3. * m.mu : m.lambda),
          K(m.lambda + 2. / 3. * m.mu),
          theta(tets > 1 ? elasticity.meanStrain : 0),
          cellDilation(elasticity.volumetric == Volumetric::cell)
    {
    }
    double density(const Mat3& e) const { return mu * e.squaredNorm() + 0.5 * own * e.trace() * e.trace(); }
    Mat3 stress(const Mat3& e) const { return 2 * mu * e + own * e.trace() * Mat3::Identity(); }
};

/// h grad N_a of corner a of a tet, 1 to 3; that of corner 0 is minus their sum.
Eigen::Map<const Vec3> gradient(const ElementOf& e, std::size_t t, std::size_t a)
{
    const auto& own = e.element.shape == tetmesh::CellShape::tet ? (*e.gradients)[a - 1]
                                                                 : tetmesh::cellTets(e.element.shape).gradient[t][a];
    return Eigen::Map<const Vec3>(own.data());
}

}  // namespace

Mat3 deformationGradient(const ElementOf& e, std::size_t t, std::span<const Vec3> x)
{
    const tetmesh::CellTets& tets = tetmesh::cellTets(e.element.shape);
    const auto at = [&](std::size_t a) { return x[e.element.node[std::size_t(tets.corner[t][a])]]; };
    Mat3 F = Mat3::Zero();
    for (std::size_t a = 1; a < 4; ++a) F += (at(a) - at(0)) * gradient(e, t, a).transpose() / e.h;
    return e.inverseFlow ? Mat3(F * e.inverseFlow[t]) : F;
}

std::array<Mat3, tetmesh::kMaxTets> elementStress(const ElementOf& e, std::span<const Vec3> x, const Material& m,
                                                  Elasticity elasticity)
{
    const Strains strains(e, x, elasticity.strain);
    const Moduli moduli(m, elasticity, int(strains.mean));
    std::array<Mat3, tetmesh::kMaxTets> stress;
    for (std::size_t t = 0; t < strains.mean; ++t) {
        if (strains.V[t] == 0) continue;
        const Mat3 shear = (1 - moduli.theta) * strains.e[t] + moduli.theta * strains.e[strains.mean];
        const double bulk = moduli.cellDilation ? strains.dilation : strains.e[t].trace();
        stress[t] = (e.stiffness ? double(e.stiffness[t]) : 1.) *
                    (2 * m.mu * (shear - shear.trace() / 3 * Mat3::Identity()) + moduli.K * bulk * Mat3::Identity());
    }
    return stress;
}

tetmesh::ElementForces elementForces(const ElementOf& e, std::span<const Vec3> x, const Material& m,
                                     Elasticity elasticity)
{
    const Strains strains(e, x, elasticity.strain);
    const tetmesh::CellTets& tets = tetmesh::cellTets(e.element.shape);
    const Moduli moduli(m, elasticity, tets.count);
    tetmesh::ElementForces forces;
    if (strains.volume == 0) return forces;
    const Mat3 &mean = strains.e[strains.mean], &meanF = strains.F[strains.mean];
    const double dilation = strains.dilation, meanW = moduli.density(mean);
    const Mat3 meanP = strains.A[strains.mean] * moduli.stress(mean);
    for (std::size_t t = 0; t < strains.mean; ++t) {
        if (strains.V[t] == 0) continue;
        // What each tet adds to the energy of the means is that of the means, and what it moves them by.
        const Mat3 &F = strains.F[t], &own = strains.e[t];
        Mat3 stress = (1 - moduli.theta) * moduli.stress(own);
        double W =
            (1 - moduli.theta) * moduli.density(own) + moduli.theta * (meanW + meanP.cwiseProduct(F - meanF).sum());
        if (moduli.cellDilation) {
            stress += moduli.K * dilation * Mat3::Identity();
            W += moduli.K * dilation * (own.trace() - 0.5 * dilation);
        }
        Mat3 P = strains.A[t] * stress + moduli.theta * meanP, whole = F;
        if (e.inverseFlow) P = P * e.inverseFlow[t].transpose(), whole = F * e.inverseFlow[t].inverse();
        const Mat3 eshelby = W * Mat3::Identity() - whole.transpose() * P;
        const double V = strains.V[t], part = V / (e.stiffness ? double(e.stiffness[t]) : 1.) / 4;
        Vec3 first = Vec3::Zero();
        for (std::size_t a : {1, 2, 3, 0}) {
            const Vec3 slope = a > 0 ? Vec3(gradient(e, t, a) / e.h) : first;
            first -= slope;
            tetmesh::CornerForces& corner = forces[std::size_t(tets.corner[t][a])];
            corner.elastic += V * P * slope, corner.material += V * eshelby * slope;
            corner.F += part * whole, corner.volume += part;
        }
    }
    return forces;
}

double elasticEnergy(const ElementOf& e, std::span<const Vec3> x, const Material& m, Elasticity elasticity)
{
    const Strains strains(e, x, elasticity.strain);
    const Moduli moduli(m, elasticity, tetmesh::cellTets(e.element.shape).count);
    if (strains.volume == 0) return 0;
    double energy = 0, square = 0;
    const auto add = [&](std::size_t t, double V) {
        const double trace = strains.e[t].trace();
        energy += V * moduli.density(strains.e[t]);
        square += V / strains.volume * (strains.e[t].squaredNorm() - trace * trace / 3);
    };
    for (std::size_t t = 0; t < strains.mean; ++t)
        if (strains.V[t] > 0) add(t, (1 - moduli.theta) * strains.V[t]);
    if (moduli.theta > 0) add(strains.mean, moduli.theta * strains.volume);
    if (moduli.cellDilation) energy += 0.5 * moduli.K * strains.volume * strains.dilation * strains.dilation;
    const double n = std::sqrt(std::max(square, 0.)), beyond = n - e.yieldStrain;
    if (beyond > 0) energy -= m.mu * strains.volume * e.yieldShare * beyond * beyond;
    return energy;
}

}  // namespace vdbfrac::solver
