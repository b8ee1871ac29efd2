// Wavefront .obj as users' programs write it.
#include "text_reader.h"

#include <map>

namespace vdbfrac::tetmesh {

namespace {

/// Some programs on Windows begin UTF-8 with a byte order mark. With it the first word would be unknown, and its point
/// skipped.
std::string_view withoutMark(std::string_view text)
{
    constexpr std::string_view kMark = "\xEF\xBB\xBF";
    return text.starts_with(kMark) ? text.substr(kMark.size()) : text;
}

class ObjReader {
public:
    ObjReader(std::string_view text, const std::string& file) : in_(withoutMark(text), file) {}

    ObjObjects run()
    {
        while (in_.nextLine()) {
            const std::string_view key = in_.word();
            if (key == "v")
                mesh_.points.push_back(in_.point());  // a weight or a colour may follow
            else if (key == "f")
                addFace();
            else if (key == "vt" || key == "vn")
                addAttribute(key == "vt" ? mesh_.uvs : mesh_.normals);
            else if (key == "g" || key == "o" || key == "usemtl" || key == "mtllib")
                addName(key);
            else if (key.find('\0') != std::string_view::npos)
                in_.fail("zero bytes in the text", "a text file");
            else
                skip();
        }
        return {std::move(mesh_), std::move(objectOfFace_), std::move(objects_)};
    }

private:
    /// "7", "-1", "7/1", "7//3", "7/1/3".
    RenderMesh::Corner corner(std::string_view word) const
    {
        const std::size_t first = word.find('/'), second = word.find('/', std::min(first, word.size() - 1) + 1);
        const auto part = [&](std::size_t begin, std::size_t end) {
            return begin < word.size() ? word.substr(begin, end - begin) : std::string_view{};
        };
        constexpr auto kEnd = std::string_view::npos;
        RenderMesh::Corner c;
        c.point = point(word);
        if (first == kEnd) return c;
        c.uv = attribute(part(first + 1, second), mesh_.uvs.size());
        if (second != kEnd) c.normal = attribute(part(second + 1, kEnd), mesh_.normals.size());
        return c;
    }
    std::uint32_t point(std::string_view word) const
    {
        const std::string_view digits = word.substr(0, word.find('/'));
        const auto value = TextReader::parse<std::int64_t>(digits.starts_with('+') ? digits.substr(1) : digits);
        const std::int64_t count = std::int64_t(mesh_.points.size());
        if (!value || *value == 0 || *value > count || *value < -count)
            in_.fail("face corner '" + TextReader::shown(word) + "'", "1 to " + std::to_string(count) + ", or -1 to -" +
                                                                          std::to_string(count) +
                                                                          ": the points defined above this line");
        return std::uint32_t(*value > 0 ? *value - 1 : count + *value);
    }
    /// A number of a texture coordinate or normal; none where there is no such.
    static std::uint32_t attribute(std::string_view digits, std::size_t defined)
    {
        const auto value = TextReader::parse<std::int64_t>(digits);
        const std::int64_t count = std::int64_t(defined);
        if (!value || *value == 0 || *value > count || *value < -count) return RenderMesh::kNone;
        return std::uint32_t(*value > 0 ? *value - 1 : count + *value);
    }
    void addFace()
    {
        corners_.clear();
        for (std::string_view w = in_.word(); !w.empty() && w.front() != '#'; w = in_.word()) {
            if (w == "\\")
                in_.nextLine();
            else
                corners_.push_back(corner(w));
        }
        if (corners_.size() < 3) return;
        mesh_.addFace(corners_, group_, material_);
        objectOfFace_.push_back(object_);
    }
    /// Two or three numbers. One that cannot be read counts as 0: nothing but looks depends on it.
    void addAttribute(std::vector<Vec3>& to)
    {
        Vec3 value = Vec3::Zero();
        for (int k = 0; k < 3; ++k) {
            const std::string_view w = in_.word();
            const auto number = TextReader::parse<double>(w.starts_with('+') ? w.substr(1) : w);
            if (number && *number - *number == 0) value[k] = *number;
        }
        to.push_back(value);
    }
    void addName(std::string_view key)
    {
        std::string name(in_.restOfLine());
        name.erase(0, std::min(name.find_first_not_of(" \t"), name.size()));
        name.erase(name.find_last_not_of(" \t\r") + 1);
        if (key == "mtllib")
            mesh_.libraries.push_back(name);
        else if (key == "o")
            // Where an object has no groups, it is one.
            object_ = numberOf(name, objects_, objectNumber_), group_ = numberOf(name, mesh_.groups, groupNumber_);
        else if (key == "g")
            group_ = numberOf(name, mesh_.groups, groupNumber_);
        else
            material_ = numberOf(name, mesh_.materials, materialNumber_);
    }
    static std::uint32_t numberOf(const std::string& name, std::vector<std::string>& names,
                                  std::map<std::string, std::uint32_t>& number)
    {
        if (name.empty()) return RenderMesh::kNone;
        const auto [it, isNew] = number.emplace(name, std::uint32_t(names.size()));
        if (isNew) names.push_back(name);
        return it->second;
    }
    /// What continues a line that is not read is not read either.
    void skip()
    {
        while (in_.restOfLine().ends_with('\\') || in_.restOfLine().ends_with("\\\r"))
            if (!in_.nextLine()) break;
    }

    TextReader in_;
    RenderMesh mesh_;
    std::vector<RenderMesh::Corner> corners_;
    std::uint32_t group_ = RenderMesh::kNone, material_ = RenderMesh::kNone, object_ = RenderMesh::kNone;
    std::vector<std::uint32_t> objectOfFace_;
    std::vector<std::string> objects_;
    std::map<std::string, std::uint32_t> groupNumber_, materialNumber_, objectNumber_;
};

}  // namespace

ObjObjects readObjObjects(std::string_view text, const std::string& file) { return ObjReader(text, file).run(); }

RenderMesh readObjMesh(std::string_view text, const std::string& file) { return readObjObjects(text, file).mesh; }

}  // namespace vdbfrac::tetmesh
