// Everything wrong with a scene, collected and then thrown at once.
#pragma once

#include "document.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/scene/review.h>

#include <string>
#include <string_view>
#include <vector>

namespace vdbfrac::scene {

class Complaints {
public:
    /// `overrides` are the "key.path=value" texts that Place::overrideIndex counts.
    Complaints(std::string file, std::vector<std::string> overrides);

    void add(const Place& place, Complaint complaint);
    std::size_t count() const { return count_; }

    /// "file:line:column" or "--set key.path".
    std::string placeText(const Place& place) const;

    /// Throws an InputError with all complaints in the order of the text, if there are any.
    void throwIfAny() const;

private:
    struct Entry {
        Place place;
        Complaint complaint;
    };

    std::string file_;
    std::vector<std::string> overrides_;
    std::vector<Entry> entries_;
    std::size_t count_ = 0;
};

/// "did you mean 'name'?" for the name that is nearest to `given`, or "" when none is near.
std::string didYouMean(std::string_view given, const std::vector<std::string>& names);

/// "a, b, c", or "a, b and c".
std::string joined(const std::vector<std::string>& names, const std::string& lastWord = "");

}  // namespace vdbfrac::scene
