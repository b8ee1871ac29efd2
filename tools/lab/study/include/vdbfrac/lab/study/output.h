// What a study leaves: a table for the terminal, study.csv, study.json, study.svg.
#pragma once

#include <vdbfrac/lab/study/analysis.h>
#include <vdbfrac/lab/study/study.h>

#include <string>

namespace vdbfrac::lab::study {

/// Settings with errors and costs, references, orders and advice.
std::string tableText(const Study& study, const Analysis& analysis);

/// A row for each setting: values, errors, times and all counts.
std::string csvText(const Study& study, const Analysis& analysis);

/// Everything; `machine` says what it ran on.
Json jsonOf(const Study& study, const Analysis& analysis, const Json& machine);

/// Two panels: error of the measure analysis.by over time and over work, both axes logarithmic.
std::string svgText(const Study& study, const Analysis& analysis);

/// "12.3 M"
std::string amountText(std::int64_t n);

}  // namespace vdbfrac::lab::study
