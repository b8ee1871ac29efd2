// The energy that drives cracks in a body. Not installed.
#pragma once

#include <vdbfrac/core/stages.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace vdbfrac::effects {

/// Of the tets of a body: energy densities [J/m^3] and stresses [Pa] as they drive cracks. Where material has flowed
/// they are more than what is stored (core::DrivingWork).
class DrivingEnergy {
public:
    DrivingEnergy(const core::GridContext& context, const core::Body& body)
        : context_(context),
          body_(body),
          energy_(context.tetEnergy().subspan(tetmesh::tetEntry(body.firstElement, 0),
                                              tetmesh::tetEntry(body.mesh->elements().size(), 0)))
    {
        const std::span<const core::DrivingWork> works = context.drivingWork(body);
        if (works.empty()) return;
        factors_.reserve(energy_.size()), own_.reserve(energy_.size());
        for (std::size_t i = 0; i < energy_.size(); ++i) {
            const double most = std::max(double(works[i].atYield), energy_[i]);
            factors_.push_back(works[i].atYield > 0 ? 1 + double(works[i].work) / most : 1);
            own_.push_back(factors_[i] * energy_[i]);
        }
        energy_ = own_;
    }
    DrivingEnergy(const DrivingEnergy&) = delete;
    DrivingEnergy& operator=(const DrivingEnergy&) = delete;

    std::span<const double> energy() const { return energy_; }
    std::array<Mat3, tetmesh::kMaxTets> stress(std::uint32_t element) const
    {
        std::array<Mat3, tetmesh::kMaxTets> stress = context_.elementStress(body_, element);
        if (!factors_.empty())
            for (std::size_t t = 0; t < tetmesh::kMaxTets; ++t)
                if (body_.mesh->elements()[element].fraction[t] > 0)
                    stress[t] *= std::sqrt(factors_[tetmesh::tetEntry(element, t)]);
        return stress;
    }

private:
    const core::GridContext& context_;
    const core::Body& body_;
    std::span<const double> energy_;
    std::vector<double> factors_, own_;
};

}  // namespace vdbfrac::effects
