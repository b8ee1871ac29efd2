// The hard cases of the simulation: what usually breaks such programs, each measured against a limit. And the cases in
// newtons, each measured against a reference. Tests and 'vdbfrac verify --hard', '--torture', '--newtons' run the same
// functions.
#pragma once

#include <cmath>
#include <span>
#include <string>
#include <vector>

namespace vdbfrac::lab::verify {

enum class Bound {
    atMost,
    atLeast,
    within,  ///< as far from the reference as the limit says, in the same unit
};

/// One number of a case, in the unit that `what` says.
struct Measurement {
    std::string what;
    double value = 0;
    Bound bound = Bound::atMost;
    double limit = 0;
    double reference = 0;  ///< of `within`

    bool holds() const  // NaN never does
    {
        if (bound == Bound::within) return std::abs(value - reference) <= limit;
        return bound == Bound::atMost ? value <= limit : value >= limit;
    }
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
    const char* reference = "";  ///< where the numbers come from that a case in newtons is held against
};

/// All rows, in the order of the table.
std::span<const HardCase> hardCases();

/// Hard cases while something tears, rows of a table of their own.
std::span<const HardCase> tortureCases();

/// Stiffness, loads, energies and cracks against closed forms and finite elements of another program.
std::span<const HardCase> newtonCases();

}  // namespace vdbfrac::lab::verify
