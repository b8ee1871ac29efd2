// A run in this process, and what it leaves as JSON.
#pragma once

#include <vdbfrac/lab/study/study.h>

#include <cstdint>
#include <span>

namespace vdbfrac::lab::study {

/// Simulates a run in this process, without writing frames. Takes the measures unless they are left out, as for timing.
/// Throws what the simulation throws.
Result simulate(const scene::Scene& scene, std::span<const Spec::Measure> measures, std::uint64_t memoryLimit);

Json toJson(const Result& result);
/// Throws nlohmann's exceptions for what is no such result.
Result resultOf(const Json& json);

}  // namespace vdbfrac::lab::study
