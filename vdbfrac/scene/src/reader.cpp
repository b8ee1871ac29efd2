#include "overrides.h"
#include "sections.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/scene/reader.h>

#include <algorithm>

namespace vdbfrac::scene {

namespace fs = std::filesystem;

namespace {

/// Absolute, so that a scene means the same when the working folder changes.
fs::path folderOf(const fs::path& file)
{
    std::error_code none;
    const fs::path absolute = fs::absolute(file, none);
    return none ? file.parent_path() : absolute.parent_path();
}

/// What helps with mistakes that are made often.
std::string hintOf(const SyntaxError& error)
{
    if (error.what.find("redefine") != std::string::npos) return "it is there twice; give each key and table once";
    if (error.what.find("inline table") != std::string::npos && error.what.find("'\\n'") != std::string::npos)
        return "a table in braces ends on the line it begins on; [name] begins one of several lines";
    return "";
}

Node parse(std::string_view text, const Complaints& complaints)
{
    try {
        return parseDocument(text);
    } catch (const SyntaxError& e) {
        throw InputError({complaints.placeText(e.place), "this is not TOML: " + e.what, "", hintOf(e)});
    }
}

}  // namespace

Scene parseScene(std::string_view text, const fs::path& file, const Vocabulary& vocabulary,
                 const std::vector<std::string>& overrides)
{
    Complaints complaints(file.string(), overrides);
    Node root = parse(text, complaints);
    applyOverrides(root, overrides, complaints);
    Context context{complaints, folderOf(file)};
    Scene scene = readSections(root, vocabulary, context);
    complaints.throwIfAny();
    scene.file = file;
    return scene;
}

Scene readScene(const fs::path& file, const Vocabulary& vocabulary, const std::vector<std::string>& overrides)
{
    constexpr std::uint64_t kMaxBytes = 16 << 20;  // thousands of keyed grips; what is larger is something else
    return parseScene(readText(file, kMaxBytes), file, vocabulary, overrides);
}

const Material& Scene::materialOf(const Body& body) const
{
    const auto it =
        std::find_if(materials.begin(), materials.end(), [&](const Material& m) { return m.name == body.material; });
    if (it == materials.end())
        throw InputError(
            {"body '" + body.name + "'", "its material '" + body.material + "' is not in the scene", "", ""});
    return *it;
}

const Values* Scene::table(std::string_view name) const
{
    const auto it = std::ranges::find(tables, name, &NamedValues::name);
    return it != tables.end() ? &it->values : nullptr;
}

}  // namespace vdbfrac::scene
