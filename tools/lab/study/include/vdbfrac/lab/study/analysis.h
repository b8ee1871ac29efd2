// From the runs of a study to errors, costs and advice.
#pragma once

#include <vdbfrac/lab/study/references.h>
#include <vdbfrac/lab/study/study.h>

#include <algorithm>

namespace vdbfrac::lab::study {

/// What the errors of a measure are taken from.
struct Reference {
    enum class Kind { none, exact, extrapolated, finest } kind = Kind::none;
    Value value;
    double uncertainty = 0;                ///< of the value, in its unit
    double order = 0;                      ///< observed, where it was extrapolated
    std::vector<std::size_t> series = {};  ///< it was extrapolated from; the order is that of the first
    std::optional<std::size_t> run = {};   ///< that it is, where it is a run
};

/// Relative error of a setting in a measure.
struct Error {
    std::optional<double> value;  ///< none: of the reference itself, of a run that is not sound, of what is missing
    bool weak = false;            ///< not much larger than what is uncertain of the reference
    double atMost = 0;            ///< value, with what is uncertain of the reference
    bool byChance = false;        ///< a finer setting of its series is much farther off
    double ofFiner = 0;           ///< the largest value of those
    double trusted() const { return value ? std::max(*value, ofFiner) : 0; }
};

/// Order of convergence of a series in a measure.
struct Order {
    std::optional<double> fit;   ///< least squares over all levels whose error is not weak
    std::optional<double> last;  ///< of the two finest of them
    std::optional<double> expected;
    /// Of the differences of the three finest values: needs no reference, so other errors do not count.
    std::optional<double> own;
};

struct Analysis {
    std::vector<Reference> references;       ///< of each measure
    std::vector<std::vector<Error>> errors;  ///< [setting][measure]
    std::vector<std::vector<Order>> orders;  ///< [series][measure]
    /// Of each setting: time relative to that of the base; none when not timed.
    std::vector<std::optional<Interval>> cost;
    /// Resolution of each setting, as Level has it; none without an order of values.
    std::vector<std::optional<double>> h;
    std::size_t by = 0;              ///< the measure that settings are chosen by
    std::vector<std::size_t> front;  ///< settings that are best by it, by rising cost
    std::vector<bool> sound;         ///< of each setting
    std::size_t base = 0;            ///< the first setting that is sound, if any is: what costs are relative to

    /// Time relative to the base, or where nothing was timed, work; none for runs that are not sound.
    std::optional<double> costOf(const Study& study, std::size_t setting) const;
};

/// `by`: the measure that settings are chosen by.
Analysis analyse(const Study& study, std::size_t by);

/// The cheapest setting whose error in a measure is at most this for sure, and that of all finer ones of its series.
/// Where fragments are counted, those with
/// another number of them are no answer: a body that stays whole is near by chance.
std::optional<std::size_t> cheapestFor(const Study& study, const Analysis& analysis, std::size_t measure, double error);

/// What the next finer level of a series does to the error of the base setting.
struct Refinement {
    std::size_t series = 0;
    std::size_t finer = 0;  ///< setting
    double before = 0, after = 0;
};
/// For each series of one key that the base run is part of, the largest change first.
std::vector<Refinement> refinementsOfBase(const Study& study, const Analysis& analysis);

/// Why a setting is not compared, on one line: its failure, or steps that did not converge; empty when it is sound.
std::string reasonOf(const Study& study, std::size_t setting);

/// "exact 0.3017 (elastica)", "extrapolated from 'time step' to 12.3 +- 0.1", ...
std::string referenceText(const Study& study, const Analysis& analysis, std::size_t measure);

}  // namespace vdbfrac::lab::study
