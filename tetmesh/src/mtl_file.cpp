#include <vdbfrac/tetmesh/mtl_file.h>

#include "text_reader.h"

#include <vdbfrac/base/atomic_file.h>

#include <algorithm>
#include <iterator>
#include <locale>
#include <sstream>
#include <system_error>

namespace vdbfrac::tetmesh {

namespace {

constexpr const char* kBlanks = " \t\r\v\f";

std::string_view withoutBlanks(std::string_view text)
{
    text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
    return text.substr(0, text.find_last_not_of(kBlanks) + 1);
}

/// Options of a texture, and how many words follow each.
struct MapOption {
    std::string_view name;
    int words;
};
constexpr MapOption kMapOptions[] = {{"-blendu", 1}, {"-blendv", 1}, {"-bm", 1},      {"-boost", 1},  {"-cc", 1},
                                     {"-clamp", 1},  {"-mm", 2},     {"-imfchan", 1}, {"-texres", 1}, {"-type", 1}};

/// One to three numbers, of which two count; one that is not there stays as it is.
void readPair(TextReader& in, Eigen::Array2d& pair)
{
    for (int k = 0; k < 3; ++k) {
        TextReader next = in;
        const auto value = TextReader::parse<double>(next.word());
        if (!value) return;
        if (k < 2 && *value - *value == 0) pair[k] = *value;
        in = next;
    }
}

/// What stands behind the key of a texture: options, and a file whose name may have blanks.
DiffuseMap mapOf(TextReader in)
{
    DiffuseMap map;
    Eigen::Array2d turbulence;  // is not drawn
    for (;;) {
        const std::string_view rest = withoutBlanks(in.restOfLine());
        TextReader after = in;
        const std::string_view word = after.word();
        const auto option = std::find_if(std::begin(kMapOptions), std::end(kMapOptions),
                                         [&](const MapOption& o) { return o.name == word; });
        if (word == "-s")
            readPair(after, map.scale);
        else if (word == "-o")
            readPair(after, map.offset);
        else if (word == "-t")
            readPair(after, turbulence);
        else if (option != std::end(kMapOptions))
            for (int k = 0; k < option->words; ++k) after.word();
        else {
            map.file = std::string(word.starts_with('-') ? rest.substr(rest.find_last_of(" \t") + 1) : rest);
            return map;
        }
        in = after;
    }
}

/// Red alone is a grey. None of a spectrum, of CIE XYZ, and of what is no colour: a material says how things look, and
/// a run does not end for that.
std::optional<Vec3> colourOf(TextReader& in)
{
    Vec3 colour;
    for (int k = 0; k < 3; ++k) {
        const std::string_view word = in.word();
        const std::optional<double> value = TextReader::parse<double>(word);
        if (word.empty() && k > 0)
            colour[k] = colour[0];
        else if (value && std::isfinite(*value))
            colour[k] = *value;
        else
            return std::nullopt;
    }
    return colour;
}

/// Calls visit(name of the material, key, what follows it) for each line of a material.
template <class Visit>
void visitMaterials(const std::string& mtl, const Visit& visit)
{
    std::string name;
    for (TextReader in(mtl, "material library"); in.nextLine();) {
        const std::string_view key = in.word();
        if (key == "newmtl")
            name = std::string(withoutBlanks(in.restOfLine()));
        else
            visit(name, key, in);
    }
}

}  // namespace

namespace {

constexpr std::string_view kTorn = "inside", kOfTorn = "inside_";
const Vec3 kTornColour(0.80, 0.10, 0.07);

struct Gloss {
    double specular, exponent;
};
constexpr Gloss kDull{.04, 20}, kWet{.1, 60};

std::string materialText(std::string_view name, const Vec3& colour, const Gloss& gloss)
{
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text << "newmtl " << name << "\nKa 0 0 0\nKd " << colour.x() << " " << colour.y() << " " << colour.z() << "\nKs "
         << gloss.specular << " " << gloss.specular << " " << gloss.specular << "\nNs " << gloss.exponent
         << "\nillum 2\n";
    return text.str();
}

}  // namespace

std::string mtlMaterial(const std::string& name, const Vec3& colour) { return materialText(name, colour, kDull); }

std::string tornMaterial(const std::string& of, const Vec3& colour)
{
    return materialText(std::string(kOfTorn) + of, colour, kWet);
}

bool isTornMaterial(std::string_view name) { return name == kTorn || name.starts_with(kOfTorn); }

std::string mtlText(std::string_view more)
{
    return mtlMaterial("outside", {0.72, 0.71, 0.68}) + "\n" + materialText(kTorn, kTornColour, kWet) +
           std::string(more);
}

void writeMtl(const std::filesystem::path& file, std::string_view more) { writeText(file, mtlText(more)); }

std::vector<std::filesystem::path> libraryFiles(std::span<const std::string> libraries,
                                                const std::filesystem::path& folder)
{
    std::vector<std::filesystem::path> files;
    for (const std::string& line : libraries) {
        std::vector<std::filesystem::path> several;
        std::istringstream words(line);
        for (std::string word; words >> word;) several.push_back(folder / word);
        std::error_code unused;  // as of a line that is too long for a name
        const bool isOne = several.size() < 2 || std::filesystem::is_regular_file(folder / line, unused);
        if (isOne) several = {folder / line};
        files.insert(files.end(), several.begin(), several.end());
    }
    return files;
}

std::string readMtl(const std::filesystem::path& file)
{
    const std::string text = readText(file);
    std::string result;
    for (TextReader in(text, file.string()); in.nextLine();) {
        const std::string line(in.restOfLine().substr(0, in.restOfLine().find_last_not_of(kBlanks) + 1));
        const std::string_view key = in.word();
        const bool isTexture =
            key.starts_with("map_") || key == "bump" || key == "disp" || key == "norm" || key == "refl";
        const std::string name = isTexture ? mapOf(in).file : "";
        result += line.substr(0, line.size() - name.size());
        if (!name.empty()) result += std::filesystem::absolute(file.parent_path() / name).string();
        result += '\n';
    }
    return result;
}

std::vector<MtlMaterial> materialsIn(const std::string& mtl)
{
    std::vector<MtlMaterial> materials;
    for (TextReader in(mtl, "material library"); in.nextLine();) {
        const std::string line(withoutBlanks(in.restOfLine()));
        if (in.word() == "newmtl")
            materials.push_back({std::string(withoutBlanks(in.restOfLine())), ""});
        else if (!materials.empty() && !line.empty() && line[0] != '#')
            materials.back().look += line + '\n';
    }
    return materials;
}

Vec3 lightOf(const Vec3& colour)
{
    constexpr double kGamma = 2.2;
    return colour.array().max(0.).pow(kGamma);
}

std::map<std::string, Vec3> diffuseColours(const std::string& mtl)
{
    std::map<std::string, Vec3> colours;
    visitMaterials(mtl, [&](const std::string& name, std::string_view key, TextReader& in) {
        if (key != "Kd") return;
        if (const std::optional<Vec3> colour = colourOf(in)) colours[name] = *colour;
    });
    return colours;
}

std::map<std::string, Light> lightsOf(const std::string& mtl)
{
    std::map<std::string, Light> lights;
    visitMaterials(mtl, [&](const std::string& name, std::string_view key, TextReader& in) {
        if (key != "Ke" && key != "d" && key != "Tr") return;
        const std::optional<Vec3> value = colourOf(in);
        if (!value) return;
        if (key == "Ke" && !value->isZero()) lights[name].emitted = *value;
        const double opacity = std::clamp(key == "d" ? value->x() : 1 - value->x(), 0., 1.);
        if (key != "Ke" && opacity < 1) lights[name].opacity = opacity;
    });
    return lights;
}

std::map<std::string, DiffuseMap> diffuseMaps(const std::string& mtl)
{
    std::map<std::string, DiffuseMap> maps;
    visitMaterials(mtl, [&](const std::string& name, std::string_view key, const TextReader& in) {
        if (key != "map_Kd") return;
        if (const DiffuseMap map = mapOf(in); !map.file.empty()) maps[name] = map;
    });
    return maps;
}

}  // namespace vdbfrac::tetmesh
