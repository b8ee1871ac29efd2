#include "complaints.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace vdbfrac::scene {

namespace {

// A text of a million wrong values should not make a message of a million parts.
constexpr std::size_t kMaxKept = 1000;
constexpr std::size_t kMaxName = 64;

std::string lowered(std::string_view text)
{
    std::string out(text);
    for (char& c : out)
        if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
    return out;
}

/// Levenshtein distance: insertions, deletions and replacements of bytes.
std::size_t editDistance(std::string_view a, std::string_view b)
{
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t(0));
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t replaced = diagonal + (a[i - 1] != b[j - 1]);
            diagonal = row[j];
            row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
        }
    }
    return row.back();
}

/// How far a name is from what was given, or npos when too far to be meant.
std::size_t farFrom(const std::string& given, const std::string& name)
{
    if (given.size() >= 3 && name.starts_with(given)) return 1;
    const std::size_t longest = std::max(given.size(), name.size());
    const std::size_t distance = editDistance(given, name);
    return distance <= (longest + 2) / 3 && distance < longest ? distance : std::string::npos;
}

}  // namespace

Complaints::Complaints(std::string file, std::vector<std::string> overrides)
    : file_(std::move(file)), overrides_(std::move(overrides))
{
}

void Complaints::add(const Place& place, Complaint complaint)
{
    ++count_;
    if (entries_.size() < kMaxKept) entries_.push_back({place, std::move(complaint)});
}

std::string Complaints::placeText(const Place& place) const
{
    if (place.overrideIndex >= 0) {
        const std::string& text = overrides_[std::size_t(place.overrideIndex)];
        return "--set " + text.substr(0, text.find('='));
    }
    return file_ + ":" + std::to_string(place.line) + ":" + std::to_string(place.column);
}

void Complaints::throwIfAny() const
{
    if (count_ == 0) return;
    std::vector<Entry> entries = entries_;
    std::stable_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
        return std::tie(a.place.overrideIndex, a.place.line, a.place.column) <
               std::tie(b.place.overrideIndex, b.place.line, b.place.column);
    });
    std::vector<InputError::Detail> details;
    for (Entry& e : entries)
        details.push_back({placeText(e.place), e.complaint.what, e.complaint.allowed, e.complaint.hint});
    if (count_ > entries.size())
        details.push_back({file_, "and " + std::to_string(count_ - entries.size()) + " more errors", "", ""});
    throw InputError(std::move(details));
}

std::string didYouMean(std::string_view given, const std::vector<std::string>& names)
{
    if (given.empty() || given.size() > kMaxName) return "";
    std::size_t min = std::string::npos;
    std::string nearest;
    for (const std::string& name : names) {
        const std::size_t distance = farFrom(lowered(given), lowered(name));
        if (distance >= min) continue;
        min = distance;
        nearest = name;
    }
    return nearest.empty() ? "" : "did you mean '" + nearest + "'?";
}

std::string joined(const std::vector<std::string>& names, const std::string& lastWord)
{
    std::string text;
    for (std::size_t i = 0; i < names.size(); ++i) {
        const bool isLast = i + 1 == names.size() && !lastWord.empty();
        if (i > 0) text += isLast ? " " + lastWord + " " : ", ";
        text += names[i];
    }
    return text;
}

}  // namespace vdbfrac::scene
