// Volume: material that is squeezed far keeps what is left of its volume. Corotational elasticity is linear in strain:
// it has a finite energy at no volume, and what is hit near the speed of sound is crushed.
//
//   U(x) = sum_e w V k/2 <j - a - J>^2,  J = det F,  <a> = max(a, 0)
//   F   of an element: the mean over its material, as in mean dilatation
//   j   share of its volume at rest below which it resists
//   k   stiffness, in Young's moduli of the material [Pa]
//   a   allowance: what a cut leaves of an element has another mean F. It may lack what it lacks then, beyond what it
//       did before; as far as it gets that back, it keeps it. So a cut gives no energy.
//
// Of the Hessian f''(J) (dJ/dF)^2 + f'(J) d2J/dF^2 the tangent has the first part, which is positive; the other is as
// large as what is missing of the volume, and as often negative as positive (Smith, de Goes, Kim 2018, section 4).
#include "all.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/tetmesh/cell.h>
#include <vdbfrac/tetmesh/tet_field.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace vdbfrac::effects {

namespace {

using scene::Key;
using scene::Type;

const Key kKeys[] = {
    {"least", Type::number, "", "Share of its volume at rest below which material resists.", "0.9", 0.3, 1},
    {"stiffness", Type::number, "", "How strongly it resists, in units of its Young's modulus.", "20", 0, 200},
};

using Corners = Eigen::Matrix<double, 3, tetmesh::kCorners>;

/// An element with less than the least volume.
struct Squeezed {
    std::uint32_t body, element;
    const std::uint32_t* node;  ///< of the body, of each corner
    std::uint32_t firstNode;    ///< of the system: node 0 of the body
    Corners gradN;              ///< 1/m, means over the material
    Mat3 F;
    double volume;   ///< m^3 of material, times the factor on its stiffness
    double k;        ///< Pa
    double missing;  ///< j - a - J
};

/// What an element lacks of the least volume: beyond what it is allowed, and that.
struct Lack {
    std::uint32_t element;  ///< of its body
    double missing, allowed;
};
using Lacks = std::vector<Lack>;  // of a body, by rising element

class Volume : public core::Effect,
               public solver::Potential,
               public core::Reporter,
               public core::RecutStage,
               public core::Persistent {
public:
    Volume(double least, double stiffness) : least_(least), stiffness_(stiffness) {}
    std::string name() const override { return "volume"; }
    void join(core::Stages& stages) override
    {
        stages.solve.push_back(this);
        stages.reporters.push_back(this);
        stages.recut.push_back(this);
        stages.persistent.push_back(this);
    }
    void start(const core::SolvedStep&, std::span<const core::Body> bodies, std::vector<std::string>&) override
    {
        bodies_ = bodies;
        lacks_.resize(bodies.size()), cut_.resize(bodies.size());
    }
    void begin(const solver::StepStart& start) override;

    double evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) const override;
    void linearizeScalars(std::span<const Vec3> x, const solver::ElasticOperator& elastic,
                          std::vector<solver::ScalarCoupling>& couplings) const override;
    void accept(std::span<const Vec3> x, double, double) override;
    void recut(const core::Body& body, const tetmesh::CutUpdate& update) override;
    void save(std::span<const core::Body> bodies, core::Archive& archive) const override;
    void restoreFrom(const core::Archive& archive, std::span<const core::Body> bodies) override;
    void refineFrom(const core::Refinement&, std::span<const core::Body>) override {}  // other elements
    std::size_t bytes() const override;
    /// Becomes the column volume_work_J.
    solver::EnergyFlow flow(const solver::Leg& leg) const override { return solver::storedFlow(*this, leg); }
    void report(Ledger& work, std::map<std::string, double>&) override { work.add(work_), work_.clear(); }

private:
    std::vector<Squeezed> squeezed(std::span<const Vec3> x, const solver::ElasticOperator& elastic) const;
    std::optional<Squeezed> squeezed(const solver::ElasticOperator& elastic, std::size_t body, std::size_t element,
                                     std::span<const Vec3> x, double allowed) const;
    void allow(const std::vector<Lacks>& lacks);

    double least_, stiffness_;
    const solver::ElasticOperator* elastic_ = nullptr;  // of the step at hand
    std::span<const core::Body> bodies_;
    // Of each body: elements that lack volume as a step has ended, and those that were cut since, with what they lacked
    // before.
    std::vector<Lacks> lacks_, cut_;
    std::vector<std::vector<double>> allowed_;  // of each element of a body; empty: nothing
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

/// Where it lacks more than it is allowed.
std::optional<Squeezed> Volume::squeezed(const solver::ElasticOperator& elastic, std::size_t body, std::size_t e,
                                         std::span<const Vec3> x, double allowed) const
{
    using Shape = tetmesh::CellShape;
    static const std::array<Means, 3> kWhole{meansOfWhole(Shape::six), meansOfWhole(Shape::fiveEven),
                                             meansOfWhole(Shape::fiveOdd)};
    const double h = elastic.h();
    const solver::ElementSet& set = elastic.sets()[body];
    const tetmesh::CellElement& element = set.elements[e];
    const Means means = isWhole(set, e) ? kWhole[std::size_t(element.shape)] : meansOf(set, e);
    Corners corners;
    for (std::size_t a = 0; a < element.node.size(); ++a) corners.col(int(a)) = x[set.firstNode + element.node[a]];
    const Mat3 F = corners * means.gradN.transpose() / h;
    const double missing = least_ - allowed - F.determinant();
    if (!(means.volume > 0 && missing > 0)) return std::nullopt;
    return Squeezed{std::uint32_t(body),
                    std::uint32_t(e),
                    element.node.data(),
                    set.firstNode,
                    means.gradN / h,
                    F,
                    h * h * h * means.volume,
                    stiffness_ * set.material.youngsModulus(),
                    missing};
}

std::vector<Squeezed> Volume::squeezed(std::span<const Vec3> x, const solver::ElasticOperator& elastic) const
{
    constexpr std::size_t kElements = 1024;
    std::vector<Squeezed> all;
    for (std::size_t b = 0; b < elastic.sets().size(); ++b) {
        const solver::ElementSet& set = elastic.sets()[b];
        const std::vector<double> none, &allowed = b < allowed_.size() ? allowed_[b] : none;
        const auto add = [&](std::size_t begin, std::size_t end, std::vector<Squeezed>& list) {
            for (std::size_t e = begin; e < end; ++e)
                if (const auto found = squeezed(elastic, b, e, x, allowed.empty() ? 0 : allowed[e]))
                    list.push_back(*found);
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
        energy += s.volume * s.k / 2 * s.missing * s.missing;
        const Corners forces = -s.volume * s.k * s.missing * cofactors(s.F) * s.gradN;
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

/// What was cut since the last step may lack what it lacks more than before.
void Volume::begin(const solver::StepStart& start)
{
    const StageTimer timer(work_, "volume");
    elastic_ = &start.elastic;
    if (!allowed_.empty()) return;
    std::vector<Lacks> lacks = lacks_;
    for (std::size_t b = 0; b < lacks.size(); ++b)
        for (const Lack& cut : std::exchange(cut_[b], {}))
            if (const auto now = squeezed(*elastic_, b, cut.element, start.x, 0))
                lacks[b].push_back({cut.element, 0, std::max(0., now->missing - cut.missing)});
    allow(lacks);
}

void Volume::allow(const std::vector<Lacks>& lacks)
{
    allowed_.assign(lacks.size(), {});
    for (std::size_t b = 0; b < lacks.size(); ++b)
        for (const Lack& lack : lacks[b])
            if (lack.allowed > 0) {
                allowed_[b].resize(bodies_[b].mesh->elements().size(), 0);
                allowed_[b][lack.element] = lack.allowed;
            }
}

void Volume::accept(std::span<const Vec3> x, double, double)
{
    const StageTimer timer(work_, "volume");
    const std::vector<std::vector<double>> allowed = std::exchange(allowed_, {});
    std::int64_t count = 0;
    for (Lacks& lacks : lacks_) lacks.clear();
    for (const Squeezed& s : squeezed(x, *elastic_)) {  // all, as nothing is allowed
        const double may = allowed[s.body].empty() ? 0 : std::min(allowed[s.body][s.element], s.missing);
        lacks_[s.body].push_back({s.element, s.missing - may, may});
        count += s.missing > may;
    }
    allow(lacks_);
    work_.count("volume", "squeezed", count);
}

/// Energy of what is left of elements is that of the same material before: by the mean square of what its tets lacked.
void Volume::recut(const core::Body& body, const tetmesh::CutUpdate& update)
{
    if (update.changedVoxels == 0) return;
    const auto b = std::size_t(&body - bodies_.data());
    const Lacks old = std::exchange(lacks_[b], {});
    const auto from = [&](std::uint32_t element) { return std::ranges::lower_bound(old, element, {}, &Lack::element); };
    for (const tetmesh::PreviousElements::Kept& run : update.previousElement.kept)
        for (auto lack = from(run.old); lack != old.end() && lack->element < run.old + run.count; ++lack)
            lacks_[b].push_back({lack->element - run.old + run.first, lack->missing, lack->allowed});
    for (const tetmesh::PreviousElements::Recut& r : update.previousElement.recut) {
        const tetmesh::CellElement& element = body.mesh->elements()[r.element];
        double volume = 0, squares = 0;
        for (std::size_t t = 0; t < tetmesh::kMaxTets; ++t) {
            if (!(element.fraction[t] > 0)) continue;
            const double V = tetmesh::cellTets(element.shape).volume[t] * element.fraction[t];
            const auto lack = from(r.old[t]);
            volume += V;
            if (lack != old.end() && lack->element == r.old[t]) squares += V * lack->missing * lack->missing;
        }
        cut_[b].push_back({r.element, volume > 0 ? std::sqrt(squares / volume) : 0, 0});
    }
    allowed_.clear();
}

std::size_t Volume::bytes() const
{
    std::size_t sum = 0;
    for (const std::vector<Lacks>* of : {&lacks_, &cut_})
        for (const Lacks& lacks : *of) sum += lacks.capacity() * sizeof(Lack);
    for (const std::vector<double>& allowed : allowed_) sum += allowed.capacity() * sizeof(double);
    return sum;
}

std::string keyOf(const char* kind, std::size_t body) { return std::string("volume.") + kind + std::to_string(body); }

void put(const char* kind, std::size_t body, const Lacks& lacks, core::Archive& archive)
{
    std::vector<std::uint32_t> element;
    std::vector<double> much;
    for (const Lack& lack : lacks)
        element.push_back(lack.element), much.insert(much.end(), {lack.missing, lack.allowed});
    archive.put(keyOf(kind, body), element), archive.put(keyOf(kind, body) + ".much", much);
}

Lacks restored(const char* kind, std::size_t body, std::size_t elements, const core::Archive& archive)
{
    const auto element = archive.get<std::uint32_t>(keyOf(kind, body));
    const auto much = archive.get<double>(keyOf(kind, body) + ".much", 2 * element.size());
    Lacks lacks;
    for (std::size_t i = 0; i < element.size(); ++i) {
        lacks.push_back({element[i], much[2 * i], much[2 * i + 1]});
        if (element[i] >= elements || !(much[2 * i] >= 0) || !(much[2 * i + 1] >= 0) ||
            (i > 0 && element[i] <= element[i - 1]))
            archive.complain("'" + keyOf(kind, body) + "' is out of range");
    }
    return lacks;
}

void Volume::save(std::span<const core::Body> bodies, core::Archive& archive) const
{
    for (std::size_t b = 0; b < bodies.size(); ++b)
        put("lacks", b, lacks_[b], archive), put("cut", b, cut_[b], archive);
    archive.putOne("volume.isCut", std::int64_t{allowed_.empty()});
}

void Volume::restoreFrom(const core::Archive& archive, std::span<const core::Body> bodies)
{
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const std::size_t elements = bodies[b].mesh->elements().size();
        lacks_[b] = restored("lacks", b, elements, archive), cut_[b] = restored("cut", b, elements, archive);
    }
    allowed_.clear();
    if (archive.getOne<std::int64_t>("volume.isCut") == 0) allow(lacks_);
}

std::unique_ptr<core::Effect> make(const scene::Values& values, const scene::Scene&)
{
    return std::make_unique<Volume>(values.number("least"), values.number("stiffness"));
}

}  // namespace

EffectInfo volume()
{
    return {{"volume", "Strongly squeezed material resists further loss of volume.", kKeys}, "solve", make};
}

}  // namespace vdbfrac::effects
