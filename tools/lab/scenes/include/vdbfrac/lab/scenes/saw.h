// A cut where one wants it: material is parted without a load.
#pragma once

#include <vdbfrac/core/stages.h>

namespace vdbfrac::lab {

/// Takes a slab |x - at| < halfWidth [m] away at the end of the first step that ends after `time` [s]. It joins where
/// fracture does.
class Saw : public core::Effect, public core::GridStage {
public:
    Saw(double at, double halfWidth, double time = 0) : at_(at), halfWidth_(halfWidth), time_(time) {}

    std::string name() const override { return "saw"; }
    void join(core::Stages& stages) override { stages.grid.push_back(this); }
    grid::PhiChanges update(const core::GridContext& context, const core::Body& body, grid::LevelSet& grid) override;

private:
    double at_, halfWidth_;  // m
    double time_;            // s
    bool done_ = false;
};

}  // namespace vdbfrac::lab
