// Curves over the time of a run.
#pragma once

#include <vdbfrac/report/record.h>

namespace vdbfrac::report {

/// Loads, energies, fragments and what the steps took, each with its curves, as pages draw them.
Json plotsOf(const Record& record);

/// One curve of each run, `names` in the same order: peak loads, elastic energy, fragments.
Json comparedPlots(const std::vector<Record>& records, const std::vector<std::string>& names);

}  // namespace vdbfrac::report
