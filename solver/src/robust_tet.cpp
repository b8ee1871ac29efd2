#include "robust_tet.h"

#include <vdbfrac/solver/corotational.h>

#include <Eigen/Dense>

namespace vdbfrac::solver {

namespace {

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

}  // namespace

constexpr RobustTet kRobust = {robustPolar, robustTwist};

}  // namespace vdbfrac::solver
