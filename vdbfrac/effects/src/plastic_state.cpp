#include "plastic_state.h"

#include "plastic_return.h"

#include <vdbfrac/base/parallel.h>

#include <Eigen/LU>

#include <algorithm>

namespace vdbfrac::effects {

namespace {

constexpr std::size_t kNumbers = 9;  // of a matrix

std::string keyOf(const core::Body& body, const char* field) { return "plasticity." + body.name + "." + field; }

/// At rest [m].
Vec3 middleOf(const tetmesh::BodyMesh& mesh, const tetmesh::CellElement& element, std::size_t t)
{
    Vec3 sum = Vec3::Zero();
    for (const int corner : tetmesh::cellTets(element.shape).corner[t])
        sum += mesh.restPosition(element.node[std::size_t(corner)]);
    return sum / 4;
}

}  // namespace

void PlasticState::begin(std::size_t elements)
{
    inverse = tetmesh::TetField<Mat3>(elements, Mat3::Identity());
    strain = tension = tetmesh::TetField<double>(elements);
}

void PlasticState::carry(const tetmesh::BodyMesh& mesh, const tetmesh::PreviousElements& previous)
{
    if (!any()) return;
    inverse.carry(mesh, previous), strain.carry(mesh, previous), tension.carry(mesh, previous);
}

void PlasticState::take(const tetmesh::BodyMesh& mesh, const PlasticState& from, const tetmesh::BodyMesh& fromMesh)
{
    if (!from.any()) return;
    begin(mesh.elements().size());
    parallelChunks(mesh.elements().size(), 64, [&](std::size_t first, std::size_t end) {
        for (std::size_t e = first; e < end; ++e)
            for (std::size_t t = 0; t < tetmesh::kMaxTets; ++t) {
                const tetmesh::CellElement& element = mesh.elements()[e];
                const auto in = element.fraction[t] > 0 ? fromMesh.locate(middleOf(mesh, element, t)) : std::nullopt;
                if (!in) continue;
                inverse(e, t) = from.inverse(in->element, in->tet);
                strain(e, t) = from.strain(in->element, in->tet), tension(e, t) = from.tension(in->element, in->tet);
            }
    });
}

std::vector<double> PlasticState::yieldStrains(const tetmesh::BodyMesh& mesh, const PlasticLaw& law) const
{
    const auto of = [&](std::size_t e) {
        const tetmesh::CellElement& element = mesh.elements()[e];
        const tetmesh::CellTets& tets = tetmesh::cellTets(element.shape);
        double sum = 0, volume = 0;
        for (std::size_t t = 0; t < std::size_t(tets.count); ++t) {
            const double V = tets.volume[t] * element.fraction[t];
            if (!(V > 0)) continue;
            if (strain(e, t) > 0 && isSpent(inverse(e, t), law.maxStretch)) return kInfinity;
            sum += V * strain(e, t), volume += V;
        }
        return law.yieldStrain(volume > 0 ? sum / volume : 0);
    };
    std::vector<double> yield(inverse.elements());
    parallelChunks(yield.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t e = begin; e < end; ++e) yield[e] = of(e);
    });
    return yield;
}

std::vector<core::DrivingWork> PlasticState::drivingWork(const PlasticLaw& law) const
{
    std::vector<core::DrivingWork> works;
    if (law.fractureShare == 0) return works;
    works.reserve(tension.values().size());
    for (std::size_t i = 0; i < tension.values().size(); ++i)
        works.push_back({float(law.fractureShare * tension.values()[i]), float(law.energyAtYield(strain.values()[i]))});
    return works;
}

void save(const PlasticState& state, const core::Body& body, core::Archive& archive)
{
    std::vector<double> numbers;
    for (const Mat3& A : state.inverse.values()) numbers.insert(numbers.end(), A.data(), A.data() + kNumbers);
    archive.put(keyOf(body, "inverse"), numbers);
    archive.put(keyOf(body, "strain"), state.strain.values());
    archive.put(keyOf(body, "tension"), state.tension.values());
}

PlasticState restoredPlasticState(const core::Archive& archive, const core::Body& body)
{
    PlasticState state;
    const std::vector<double> numbers = archive.get<double>(keyOf(body, "inverse"));
    const std::size_t elements = body.mesh->elements().size(),
                      tets = numbers.empty() ? 0 : tetmesh::tetEntry(elements, 0);
    const auto strain = archive.get<double>(keyOf(body, "strain"), tets),
               tension = archive.get<double>(keyOf(body, "tension"), tets);
    if (numbers.size() != kNumbers * tets)
        archive.complain("'" + keyOf(body, "inverse") + "' is not of as many tets as the body has");
    if (tets == 0) return state;
    state.begin(elements);
    for (std::size_t i = 0; i < tets; ++i) {
        const Mat3 A = Eigen::Map<const Mat3>(numbers.data() + kNumbers * i);
        if (!(A.determinant() > 0) || !A.allFinite() || !(strain[i] >= 0) || !(tension[i] >= 0))
            archive.complain("what body '" + body.name + "' has flowed is out of range");
        state.inverse.values()[i] = A, state.strain.values()[i] = strain[i], state.tension.values()[i] = tension[i];
    }
    return state;
}

}  // namespace vdbfrac::effects
