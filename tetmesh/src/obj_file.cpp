#include <vdbfrac/tetmesh/obj_file.h>

#include "text_reader.h"
#include "text_writer.h"

#include <vdbfrac/base/atomic_file.h>

#include <algorithm>
#include <cassert>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

namespace vdbfrac::tetmesh {

namespace {

constexpr int kDigits = 9;  // of a coordinate: more than a float holds, which is what programs make of it
constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
constexpr std::string_view kObject = "fragment_";

std::string objectName(std::uint32_t fragment)
{
    const std::string digits = std::to_string(fragment);
    return std::string(kObject) + std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits;
}

/// Writes one fragment after the other, with the numbers of the points that are already there.
class ObjWriter {
public:
    explicit ObjWriter(const Surface& surface) : surface_(surface), number_(surface.points.size(), kUnused) {}

    void addFragment(std::span<const std::uint32_t> triangles)
    {
        const std::string name = objectName(surface_.fragment[triangles[0]]);
        text_ << "o " << name << "\n";
        addPoints(triangles);
        addFaces(triangles, 0, name + "_outside\nusemtl outside\n");
        addFaces(triangles, 1, name + "_inside\nusemtl inside\n");
    }
    TextWriter& text() { return text_; }

private:
    void addPoints(std::span<const std::uint32_t> triangles)
    {
        used_.clear();
        for (std::uint32_t t : triangles)
            used_.insert(used_.end(), surface_.triangles[t].begin(), surface_.triangles[t].end());
        std::sort(used_.begin(), used_.end());
        used_.erase(std::unique(used_.begin(), used_.end()), used_.end());
        for (std::uint32_t p : used_) {
            number_[p] = ++written_;
            const Vec3& x = surface_.points[p];
            text_.line("v", x.x(), x.y(), x.z());
        }
    }
    void addFaces(std::span<const std::uint32_t> triangles, int torn, const std::string& head)
    {
        bool begun = false;
        for (std::uint32_t t : triangles) {
            if ((surface_.torn[t] != 0) != (torn != 0)) continue;
            if (!begun) text_ << "g " << head;
            begun = true;
            const auto& corner = surface_.triangles[t];
            text_.line("f", number_[corner[0]], number_[corner[1]], number_[corner[2]]);
        }
    }

    const Surface& surface_;
    std::vector<std::uint32_t> number_;  // in the file, of the fragment being written
    std::vector<std::uint32_t> used_;
    std::uint32_t written_ = 0;
    TextWriter text_{kDigits};
};

std::uint32_t fragmentOf(TextReader& in)
{
    const std::string_view name = in.word();
    if (name.starts_with(kObject))
        if (const auto id = TextReader::parse<std::uint32_t>(name.substr(kObject.size()))) return *id;
    in.fail("object '" + TextReader::shown(name) + "'", "fragment_ and a number");
}

std::array<std::uint32_t, 3> triangle(TextReader& in, std::size_t points)
{
    std::array<std::uint32_t, 3> corners{};
    for (std::uint32_t& c : corners) {
        const std::size_t number = in.index(points + 1, "face corner");
        if (number == 0) in.fail("face corner 0", "1 to " + std::to_string(points));
        c = std::uint32_t(number - 1);
    }
    if (!in.word().empty()) in.fail("a face with more than three corners", "triangles");
    return corners;
}

}  // namespace

void writeObj(const std::filesystem::path& file, const Surface& surface, const std::string& mtlName)
{
    assert(surface.fragment.size() == surface.triangles.size() && surface.torn.size() == surface.triangles.size());
    std::vector<std::uint32_t> order(surface.triangles.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto fragment = [&](std::uint32_t t) { return surface.fragment[t]; };
    std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return fragment(a) < fragment(b); });
    ObjWriter writer(surface);
    if (!mtlName.empty()) writer.text() << "mtllib " << mtlName << "\n";
    for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
        while (end < order.size() && fragment(order[end]) == fragment(order[begin])) ++end;
        writer.addFragment(std::span(order).subspan(begin, end - begin));
    }
    writeText(file, writer.text().text());
}

void writeMtl(const std::filesystem::path& file)
{
    writeText(file,
              "newmtl outside\nKa 0 0 0\nKd 0.72 0.71 0.68\nKs 0.04 0.04 0.04\nNs 20\nillum 2\n\n"
              "newmtl inside\nKa 0 0 0\nKd 0.80 0.10 0.07\nKs 0.10 0.10 0.10\nNs 60\nillum 2\n");
}

Surface readObjFrame(const std::filesystem::path& file)
{
    const std::string text = readText(file);
    Surface surface;
    std::uint32_t fragment = 0;
    std::uint8_t torn = 0;
    for (TextReader in(text, file.string()); in.nextLine();) {
        const std::string_view key = in.word();
        if (key == "v") {
            surface.points.push_back(in.point());
        } else if (key == "f") {
            surface.triangles.push_back(triangle(in, surface.points.size()));
            surface.fragment.push_back(fragment);
            surface.torn.push_back(torn);
        } else if (key == "o") {
            fragment = fragmentOf(in);
            torn = 0;
        } else if (key == "usemtl") {
            torn = in.word() == "inside";
        }
    }
    return surface;
}

}  // namespace vdbfrac::tetmesh
