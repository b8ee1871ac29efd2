#include <vdbfrac/cli/frame_list.h>

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string_view>
#include <unordered_set>
#include <utility>

namespace vdbfrac::cli {

namespace {

constexpr std::size_t kMaxFrames = 100000;

/// Takes a number of digits off the front.
std::optional<int> takeNumber(std::string_view& text)
{
    int value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || text.front() == '-') return std::nullopt;
    text.remove_prefix(std::size_t(end - text.data()));
    return value;
}

bool take(std::string_view& text, char c)
{
    if (text.empty() || text.front() != c) return false;
    text.remove_prefix(1);
    return true;
}

/// Adds A, A-B or A-BxN. False for anything else.
bool addRange(std::string_view part, std::vector<int>& frames)
{
    const std::string whole(part);
    const auto first = takeNumber(part);
    if (!first) return false;
    std::optional<int> last = first, step = 1;
    if (take(part, '-')) {
        last = takeNumber(part);
        if (last && take(part, 'x')) step = takeNumber(part);
    }
    if (!part.empty() || !last || !step || *step < 1 || *last < *first) return false;
    const std::size_t count = std::size_t((std::int64_t(*last) - *first) / *step) + 1;
    if (count > kMaxFrames - std::min(frames.size(), kMaxFrames))
        throw InputError(
            {"--frames", "'" + whole + "' has too many frames", "up to " + std::to_string(kMaxFrames), ""});
    for (std::int64_t f = *first; f <= *last; f += *step) frames.push_back(int(f));
    return true;
}

/// A place for the frame: where, how long, how many digits.
struct Place {
    std::size_t begin = std::string::npos, length = 0;
    int digits = 1;
};

Place findPlace(const std::string& name, std::size_t from)
{
    constexpr int kMaxDigits = 9;
    // How many digits a number is to have, and behind it; 0: none is given.
    const auto widthAt = [&](std::size_t i) {
        const std::size_t end = std::min(name.find_first_not_of("0123456789", i), name.size());
        const std::string digits = name.substr(i, end - i);
        const int width = digits.empty() ? 0 : digits.size() > 1 ? kMaxDigits + 1 : digits[0] - '0';
        if (!digits.empty() && (width < 1 || width > kMaxDigits))
            throw InputError(
                {"'" + name + "'", "a frame of " + digits + " digits", "1 to " + std::to_string(kMaxDigits), ""});
        return std::pair(width, end);
    };
    for (std::size_t i = from; i < name.size(); ++i) {
        std::size_t end = i;
        if (name[i] == '#') {
            while (end < name.size() && name[end] == '#') ++end;
            return {i, end - i, int(end - i)};
        }
        if (name.compare(i, 2, "$F") == 0) {
            const auto [width, behind] = widthAt(i + 2);
            return {i, behind - i, std::max(1, width)};
        }
        if (name.compare(i, 2, "%d") == 0) return {i, 2, 1};
        if (name.compare(i, 2, "%0") == 0) {
            const auto [width, behind] = widthAt(i + 2);
            if (width > 0 && name.compare(behind, 1, "d") == 0) return {i, behind + 1 - i, width};
        }
    }
    return {};
}

}  // namespace

std::vector<int> parseFrames(const std::string& text)
{
    std::vector<int> frames;
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        const std::string_view part = std::string_view(text).substr(begin, end - begin);
        if (part.empty() || !addRange(part, frames))
            throw InputError(
                {"--frames", "'" + std::string(part) + "' is no list of frames", "1-96, 1-96x2, or 5,9,12", ""});
        begin = end + 1;
    }
    std::unordered_set<int> seen;
    std::erase_if(frames, [&](int frame) { return !seen.insert(frame).second; });
    return frames;
}

std::optional<int> parseFrame(std::string_view text)
{
    const std::optional<int> frame = takeNumber(text);
    return text.empty() ? frame : std::nullopt;
}

bool isSequence(const std::string& name) { return findPlace(name, 0).length > 0; }

std::string frameName(const std::string& name, int frame)
{
    std::string result = name;
    for (Place p = findPlace(result, 0); p.length > 0;) {
        std::string number = std::to_string(frame);
        if (int(number.size()) < p.digits) number.insert(0, std::size_t(p.digits) - number.size(), '0');
        result.replace(p.begin, p.length, number);
        p = findPlace(result, p.begin + number.size());
    }
    return result;
}

void makeFolderOf(const std::filesystem::path& file)
{
    if (file.has_parent_path()) makeFolder(file.parent_path());
}

}  // namespace vdbfrac::cli
