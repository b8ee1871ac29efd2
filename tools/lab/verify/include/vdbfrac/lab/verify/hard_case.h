// The hard cases of the simulation: what usually breaks such programs, each measured against a limit. Tests and
// 'vdbfrac verify --hard', '--torture' run the same functions.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace vdbfrac::lab::verify {

enum class Bound { atMost, atLeast };

/// One number of a case, in the unit that `what` says.
struct Measurement {
    std::string what;
    double value = 0;
    Bound bound = Bound::atMost;
    double limit = 0;

    bool holds() const { return bound == Bound::atMost ? value <= limit : value >= limit; }  // NaN never does
};

/// How much of the cases that can be made longer.
enum class Extent { quick, full };

/// A row of the table in docs/hard_cases.md.
struct HardCase {
    int row;            ///< of the table, from 1
    const char* id;     ///< for commands and tests
    const char* title;  ///< for people
    const char* usual;  ///< what goes wrong elsewhere
    /// Null: the program cannot do that yet. Throws only what is an error of the program.
    std::vector<Measurement> (*measure)(Extent);
};

/// All rows, in the order of the table.
std::span<const HardCase> hardCases();

/// Hard cases while something tears, rows of a table of their own.
std::span<const HardCase> tortureCases();

}  // namespace vdbfrac::lab::verify
