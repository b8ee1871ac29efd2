// Reading numbers and words from the text of a file, with the line for complaints. Not installed.
#pragma once

#include <vdbfrac/base/error.h>
#include <vdbfrac/tetmesh/render_mesh.h>
#include <vdbfrac/tetmesh/surface.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace vdbfrac::tetmesh {

/// Walks over text line by line and word by word. Blanks, tabs and the \r of CRLF part words. Both the last line
/// without newline and an empty one at the end are fine.
class TextReader {
public:
    TextReader(std::string_view text, std::string file) : text_(text), file_(std::move(file)) {}

    /// Goes to the next line. False at the end of the text.
    bool nextLine()
    {
        if (next_ >= text_.size()) return false;
        const std::size_t end = std::min(text_.find('\n', next_), text_.size());
        rest_ = text_.substr(next_, end - next_);
        next_ = end + 1;
        ++line_;
        return true;
    }

    /// Goes to the next line that holds a word and is no comment. False at the end of the text.
    bool nextDataLine()
    {
        while (nextLine()) {
            const std::string_view kept = rest_;
            const std::string_view first = word();
            rest_ = kept;
            if (!first.empty() && first.front() != '#') return true;
        }
        return false;
    }

    /// Next word of the line; empty at its end.
    std::string_view word()
    {
        const std::size_t begin = std::min(rest_.find_first_not_of(" \t\r\v\f"), rest_.size());
        const std::size_t end = std::min(rest_.find_first_of(" \t\r\v\f", begin), rest_.size());
        const std::string_view found = rest_.substr(begin, end - begin);
        rest_.remove_prefix(end);
        return found;
    }

    std::string_view restOfLine() const { return rest_; }

    /// Of coordinates: volumes and moments of larger ones are beyond what a number can hold.
    static constexpr double kLargest = 1e30;
    /// A finite number from the next word. Throws InputError.
    double number()
    {
        const std::string_view w = word();
        const std::optional<double> value = realNumber(w);
        if (w.empty()) fail("a number is missing", "finite numbers");
        if (!value || !(*value - *value == 0)) fail("'" + shown(w) + "' is not a finite number", "finite numbers");
        if (*value > kLargest || *value < -kLargest)
            fail("'" + shown(w) + "' is too large", "numbers from -1e30 to 1e30");
        return *value;
    }

    /// A number from the next word, also one that is not finite. Throws InputError.
    double anyNumber()
    {
        const std::string_view w = word();
        const std::optional<double> value = realNumber(w);
        if (!value) fail("'" + shown(w) + "' is not a number", "numbers");
        return *value;
    }

    /// Three numbers.
    Vec3 point()
    {
        const double x = number(), y = number(), z = number();
        return {x, y, z};
    }

    /// A whole number in [0, below). Throws InputError.
    std::size_t index(std::size_t below, const char* what)
    {
        const std::string_view w = word();
        const std::optional<std::uint64_t> value = parse<std::uint64_t>(w);
        if (!value || *value >= below)
            fail(std::string(what) + " '" + shown(w) + "'", "0 to " + std::to_string(below - (below > 0)));
        return std::size_t(*value);
    }

    static std::optional<double> realNumber(std::string_view w)
    {
        return parse<double>(w.starts_with('+') ? w.substr(1) : w);
    }

    template <class T>
    static std::optional<T> parse(std::string_view w)
    {
        T value{};
        const auto [end, error] = std::from_chars(w.data(), w.data() + w.size(), value);
        if (error != std::errc{} || end != w.data() + w.size()) return std::nullopt;
        return value;
    }

    [[noreturn]] void fail(const std::string& what, const std::string& allowed = "") const
    {
        throw InputError({file_ + ":" + std::to_string(line_), what, allowed, ""});
    }

    /// A word as it can be shown: cut short, without control characters.
    static std::string shown(std::string_view w)
    {
        constexpr std::size_t kShown = 40;
        std::string s(w.substr(0, kShown));
        for (char& c : s)
            if (static_cast<unsigned char>(c) < 32) c = '?';
        return w.size() > kShown ? s + "..." : s;
    }

    std::size_t position() const { return next_; }
    std::size_t line() const { return line_; }

private:
    std::string_view text_;
    std::string file_;
    std::string_view rest_;
    std::size_t next_ = 0, line_ = 0;
};

/// The extension of a file in lower case, with its dot.
std::string extensionOf(const std::filesystem::path& file);

/// Adds a face of 3 corners or more, and drops others at once: a file of empty faces must not fill the memory.
inline void addPolygon(PolygonSoup& soup, std::vector<std::size_t> polygon)
{
    if (polygon.size() >= 3) soup.polygons.push_back(std::move(polygon));
}

/// readSurface from the whole content of a file called `name`; `extension` in lower case, with its dot.
PolygonSoup parseSurface(std::string_view bytes, const std::string& extension, const std::string& name);

/// The readers of it, for each format.
PolygonSoup readObj(std::string_view text, const std::string& file);
RenderMesh readObjMesh(std::string_view text, const std::string& file);

/// The faces of an .obj with the objects that they are of.
struct ObjObjects {
    RenderMesh mesh;
    std::vector<std::uint32_t> objectOfFace;  ///< which name, or RenderMesh::kNone
    std::vector<std::string> objects;
};
ObjObjects readObjObjects(std::string_view text, const std::string& file);
PolygonSoup readPly(std::string_view bytes, const std::string& file);
PolygonSoup readStl(std::string_view bytes, const std::string& file);
PolygonSoup readOff(std::string_view text, const std::string& file);

}  // namespace vdbfrac::tetmesh
