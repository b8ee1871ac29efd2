// Volume: material that is squeezed far keeps what is left of its volume. Corotational elasticity is linear in strain:
// it has a finite energy at no volume, and what is hit near the speed of sound is crushed.
//
//   U(x) = sum_e w V k/2 <j - J>^2,  J = det F,  <a> = max(a, 0)
//   F   of an element: the mean over its material, as in mean dilatation
//   j   share of its volume at rest below which it resists
//   k   stiffness, in Young's moduli of the material [Pa]
//
// Of the Hessian f''(J) (dJ/dF)^2 + f'(J) d2J/dF^2 the tangent has the first part, which is positive; the other is as
// large as what is missing of the volume, and as often negative as positive (Smith, de Goes, Kim 2018, section 4).
#include "all.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/cell.h>
#include <vdbfrac/tetmesh/tet_field.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <array>
#include <cmath>

namespace vdbfrac::effects {

namespace {

using scene::Key;
using scene::Type;

const Key kKeys[] = {
    {"least", Type::number, "", "share of its volume at rest below which material resists", "0.9", 0.3, 1},
    {"stiffness", Type::number, "", "how much it resists, in its Young's moduli", "20", 0, 200},
};

using Corners = Eigen::Matrix<double, 3, tetmesh::kCorners>;

/// An element with less than the least volume.
struct Squeezed {
    const std::uint32_t* node;  ///< of the body, of each corner
    std::uint32_t firstNode;    ///< of the system: node 0 of the body
    Corners gradN;              ///< 1/m, means over the material
    Mat3 F;
    double volume;  ///< m^3 of material, times the factor on its stiffness
    double k;       ///< Pa
};

class Volume : public core::Effect, public solver::Potential, public core::Reporter {
public:
    Volume(double least, double stiffness) : least_(least), stiffness_(stiffness) {}
    std::string name() const override { return "volume"; }
    void join(core::Stages& stages) override
    {
        stages.solve.push_back(this);
        stages.reporters.push_back(this);
    }
    void begin(const solver::StepStart& start) override { elastic_ = &start.elastic; }

    double evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const override;
    void linearizeScalars(std::span<const Vec3> x, const solver::ElasticOperator& elastic,
                          std::vector<solver::ScalarCoupling>& couplings) const override;
    void accept(std::span<const Vec3> x, double, double) override
    {
        const StageTimer timer(work_, "volume");
        work_.count("volume", "squeezed", std::int64_t(squeezed(x, *elastic_).size()));
    }
    /// Becomes the column volume_work_J.
    solver::EnergyFlow flow(const solver::Leg& leg) const override { return solver::storedFlow(*this, leg); }
    void report(Ledger& work, std::map<std::string, double>&) override { work.add(work_), work_.clear(); }

private:
    std::vector<Squeezed> squeezed(std::span<const Vec3> x, const solver::ElasticOperator& elastic) const;

    double least_, stiffness_;
    const solver::ElasticOperator* elastic_ = nullptr;  // of the step at hand
    mutable Ledger work_;
};

/// Means over the material of an element.
struct Means {
    Corners gradN = Corners::Zero();  ///< 1/h; 0 for a corner that no tet of it has
    double volume = 0;                ///< h^3, times the factor on its stiffness
};

Means meansOf(const solver::ElementSet& set, std::size_t e)
{
    const tetmesh::CellElement& element = set.elements[e];
    const tetmesh::CellTets& tets = tetmesh::cellTets(element.shape);
    Means means;
    for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
        double V = tets.volume[t] * element.fraction[t];
        if (V == 0) continue;
        if (!set.stiffness.empty()) V *= double(set.stiffness[tetmesh::tetEntry(e, t)]);
        means.volume += V;
        for (std::size_t a = 1; a < 4; ++a) {
            const auto& own = set.gradients.empty() ? tets.gradient[t][a] : set.gradients[e][a - 1];
            const Vec3 part = V * Eigen::Map<const Vec3>(own.data());
            means.gradN.col(tets.corner[t][a]) += part, means.gradN.col(tets.corner[t][0]) -= part;
        }
    }
    if (means.volume > 0) means.gradN /= means.volume;
    return means;
}

/// Those of whole cells of a shape, which most elements of a lattice are.
Means meansOfWhole(tetmesh::CellShape shape)
{
    tetmesh::CellElement whole;
    whole.shape = shape;
    whole.fraction.fill(1);
    solver::ElementSet set;
    set.elements = std::span(&whole, 1);
    return meansOf(set, 0);
}

bool isWhole(const solver::ElementSet& set, std::size_t e)
{
    if (!set.gradients.empty()) return false;
    const tetmesh::CellElement& element = set.elements[e];
    for (std::size_t t = 0; t < std::size_t(tetmesh::cellTets(element.shape).count); ++t)
        if (element.fraction[t] != 1 || (!set.stiffness.empty() && set.stiffness[tetmesh::tetEntry(e, t)] != 1))
            return false;
    return true;
}

std::vector<Squeezed> Volume::squeezed(std::span<const Vec3> x, const solver::ElasticOperator& elastic) const
{
    constexpr std::size_t kElements = 1024;
    using Shape = tetmesh::CellShape;
    static const std::array<Means, 3> kWhole{meansOfWhole(Shape::six), meansOfWhole(Shape::fiveEven),
                                             meansOfWhole(Shape::fiveOdd)};
    const double h = elastic.h();
    std::vector<Squeezed> all;
    for (const solver::ElementSet& set : elastic.sets()) {
        const auto add = [&](std::size_t begin, std::size_t end, std::vector<Squeezed>& list) {
            for (std::size_t e = begin; e < end; ++e) {
                const tetmesh::CellElement& element = set.elements[e];
                const Means means = isWhole(set, e) ? kWhole[std::size_t(element.shape)] : meansOf(set, e);
                Corners corners;
                for (std::size_t a = 0; a < element.node.size(); ++a)
                    corners.col(int(a)) = x[set.firstNode + element.node[a]];
                const Mat3 F = corners * means.gradN.transpose() / h;
                if (means.volume > 0 && F.determinant() < least_)
                    list.push_back({element.node.data(), set.firstNode, means.gradN / h, F, h * h * h * means.volume,
                                    stiffness_ * set.material.youngsModulus()});
            }
        };
        const std::vector<Squeezed> own = gatherChunks<Squeezed>(set.elements.size(), kElements, add);
        all.insert(all.end(), own.begin(), own.end());
    }
    return all;
}

/// d det F / dF.
Mat3 cofactors(const Mat3& F)
{
    Mat3 C;
    for (int i = 0; i < 3; ++i) C.col(i) = F.col((i + 1) % 3).cross(F.col((i + 2) % 3));
    return C;
}

double Volume::evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const
{
    const StageTimer timer(work_, "volume");
    double energy = 0;
    for (const Squeezed& s : squeezed(x, *elastic_)) {
        const double missing = least_ - s.F.determinant();
        energy += s.volume * s.k / 2 * missing * missing;
        const Corners forces = -s.volume * s.k * missing * cofactors(s.F) * s.gradN;
        for (int a = 0; a < tetmesh::kCorners; ++a) gradient[s.firstNode + s.node[a]] += forces.col(a);
    }
    return energy;
}

void Volume::linearizeScalars(std::span<const Vec3> x, const solver::ElasticOperator& elastic,
                              std::vector<solver::ScalarCoupling>& couplings) const
{
    const StageTimer timer(work_, "volume");
    for (const Squeezed& s : squeezed(x, elastic)) {
        const Corners gradient = std::sqrt(s.volume * s.k) * cofactors(s.F) * s.gradN;
        solver::ScalarCoupling& c = couplings.emplace_back();
        for (std::size_t a = 0; a < solver::ScalarCoupling::kNodes; ++a)
            c.node[a] = s.firstNode + s.node[a], c.gradient[a] = gradient.col(int(a)).cast<float>();
    }
}

std::unique_ptr<core::Effect> make(const scene::Values& values, const scene::Scene&)
{
    return std::make_unique<Volume>(values.number("least"), values.number("stiffness"));
}

}  // namespace

EffectInfo volume()
{
    return {{"volume", "Material that is squeezed far keeps what is left of its volume.", kKeys}, "solve", make};
}

}  // namespace vdbfrac::effects
