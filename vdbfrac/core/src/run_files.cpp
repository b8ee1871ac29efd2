#include "run_files.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <set>

namespace vdbfrac::core {

namespace fs = std::filesystem;

namespace {

bool isDigit(char c) { return c >= '0' && c <= '9'; }

constexpr std::string_view kNumber = "####";

/// What stands for the number of a pattern in a path that it stands for: the last, as a name of a scene may have one of
/// its own.
std::string_view numberIn(std::string_view pattern, std::string_view path)
{
    const std::size_t at = pattern.rfind(kNumber);
    return path.substr(at, path.size() - (pattern.size() - kNumber.size()));
}

std::vector<fs::path> filesOf(const fs::path& folder, const std::string& pattern)
{
    const fs::path place = fs::path(pattern).parent_path();
    std::vector<fs::path> found;
    std::error_code error;
    for (fs::directory_iterator entry(folder / place, error), end; !error && entry != end; entry.increment(error))
        if (matches(pattern, (place / entry->path().filename()).generic_string()) &&
            !fs::is_directory(entry->symlink_status()))
            found.push_back(entry->path());
    return found;
}

/// Discarded where it cannot be read as JSON.
nlohmann::json manifestOf(const fs::path& folder)
{
    return nlohmann::json::parse(readText(folder / kManifest), nullptr, false);
}

/// What a run writes, as its manifest lists it.
std::vector<std::string> patternsOf(const nlohmann::json& manifest)
{
    std::vector<std::string> patterns;
    for (const auto& pattern : manifest.value("writes", nlohmann::json::array()))
        if (pattern.is_string() && liesBelow(pattern.get<std::string>())) patterns.push_back(pattern);
    return patterns;
}

}  // namespace

std::vector<std::string> runFiles(const std::string& name)
{
    const std::string ckpt = std::string(kCheckpointFolder) + "/" + name;
    return {ckpt + ".####" + kCheckpointExtension,
            ckpt + kRecordsExtension,
            "vdb/" + name + ".####.vdb",
            "obj/" + name + ".####.obj",
            "obj/" + name + ".mtl",
            "ply/" + name + ".####.ply",
            "motion/" + name + ".####.motion",
            "cache/" + name + ".obj",
            "cache/" + name + ".mtl",
            "cache/" + name + ".mdd",
            "cache/" + name + ".usda",
            "preview/" + name + ".####.png",
            "preview/" + name + ".turn.####.png",
            "preview/contact_sheet.png",
            "report.html",
            "stats.csv",
            "run.log",
            "scene.toml",
            kManifest};
}

bool matches(std::string_view pattern, std::string_view path)
{
    const std::size_t at = pattern.rfind(kNumber);
    if (at == std::string_view::npos) return pattern == path;
    const std::string_view before = pattern.substr(0, at), after = pattern.substr(at + kNumber.size());
    if (path.size() < pattern.size() || !path.starts_with(before) || !path.ends_with(after)) return false;
    const std::string_view number = numberIn(pattern, path);
    return std::all_of(number.begin(), number.end(), isDigit);
}

std::vector<std::string> filesOfEarlierRun(const fs::path& folder, const std::vector<std::string>& ifLost)
{
    const char* const kOther = "it is not empty, and no run of this program; use another folder";
    const bool isThere = fs::exists(folder / kManifest);
    if (!isThere && ifLost.empty()) throw FileError(folder.string(), std::string("holds no run.json: ") + kOther);
    const auto manifest = isThere ? manifestOf(folder) : nlohmann::json();
    if (!manifest.is_object() && !ifLost.empty()) return ifLost;
    const auto creator = manifest.is_object() ? manifest.value("creator", nlohmann::json()) : nlohmann::json();
    if (!creator.is_string() || !creator.get_ref<const std::string&>().starts_with("vdbfrac "))
        throw FileError((folder / kManifest).string(), std::string("is not the manifest of a run: ") + kOther);
    const std::vector<std::string> patterns = patternsOf(manifest);
    if (patterns.empty())
        throw FileError((folder / kManifest).string(),
                        "does not list what its run writes; use another folder, or remove this one");
    return patterns;
}

fs::path runOf(const fs::path& file)
{
    const fs::path whole = fs::weakly_canonical(file);
    const fs::path beside = whole.parent_path();
    for (const fs::path& folder : {beside, beside.parent_path()}) {
        if (!fs::exists(whole) || !fs::exists(folder / kManifest)) continue;
        const auto manifest = manifestOf(folder);
        if (!manifest.is_object()) continue;
        const std::string path = whole.lexically_relative(folder).generic_string();
        for (const std::string& pattern : patternsOf(manifest))
            if (matches(pattern, path)) return folder;
    }
    return {};
}

bool hasFrames(const fs::path& folder)
{
    const auto manifest = manifestOf(folder);
    return manifest.is_object() && !manifest.value("frames", nlohmann::json::array()).empty();
}

bool mayKeepCheckpoints(const fs::path& folder)
{
    const auto manifest = fs::exists(folder / kManifest) ? manifestOf(folder) : nlohmann::json();
    return !manifest.is_object() || manifest.value("keeps_checkpoints", nlohmann::json(false)) == true;
}

void requireApart(const fs::path& folder, const std::vector<std::string>& patterns, const std::vector<fs::path>& inputs,
                  const char* what)
{
    for (const fs::path& input : inputs) {
        const fs::path below = fs::weakly_canonical(input).lexically_relative(fs::weakly_canonical(folder));
        for (const std::string& pattern : patterns)
            if (matches(pattern, below.generic_string()))
                throw InputError({"--output", "the scene needs " + input.string() + ", which the run would " + what,
                                  "a folder that holds none of the scene's files", "use another folder"});
    }
}

void removeRunFiles(const fs::path& folder, const std::vector<std::string>& patterns)
{
    std::set<fs::path> places;
    for (const std::string& pattern : patterns) {
        for (const fs::path& file : filesOf(folder, pattern)) removeFile(file);
        if (const fs::path place = fs::path(pattern).parent_path(); !place.empty()) places.insert(place);
    }
    // A link to a folder, or a file of that name, is not the run's.
    std::error_code notEmpty;
    for (const fs::path& place : places)
        if (fs::symlink_status(folder / place, notEmpty).type() == fs::file_type::directory)
            fs::remove(folder / place, notEmpty);
}

void removeLaterFrames(const fs::path& folder, const std::string& sceneName, int last)
{
    constexpr std::size_t kDigits = 9;  // longer ones are no frame's
    bool isAnyGone = false;
    std::vector<fs::path> ofAll;
    for (const std::string& pattern : runFiles(sceneName)) {
        if (pattern.starts_with(kCheckpointFolder)) continue;
        const bool isOfOneFrame = pattern.find("/" + sceneName + ".####.") != std::string::npos;
        for (const fs::path& file : filesOf(folder, pattern)) {
            if (!isOfOneFrame && (pattern.starts_with("preview/") || pattern == "report.html")) ofAll.push_back(file);
            const std::string path = file.lexically_relative(folder).generic_string();
            const std::string number = isOfOneFrame ? std::string(numberIn(pattern, path)) : "";
            const bool isLater = isOfOneFrame && number.size() <= kDigits && std::stoi(number) > last;
            if (isLater || pattern.starts_with("cache/")) removeFile(file);
            isAnyGone = isAnyGone || isLater;
        }
    }
    if (!isAnyGone) return;
    for (const fs::path& file : ofAll) removeFile(file);
}

std::string lostFiles(const fs::path& folder, const std::vector<FrameRecord>& frames)
{
    std::string first;
    std::size_t count = 0;
    for (const FrameRecord& frame : frames)
        for (const WrittenFile& file : frame.files) {
            std::error_code error;
            if (fs::file_size(folder / file.path, error) == file.bytes && !error) continue;
            if (count++ == 0) first = file.path;
        }
    if (count == 0) return "";
    return std::to_string(count) + (count == 1 ? " file" : " files") +
           " of earlier frames are missing or damaged, the first " + first +
           "; 'vdbfrac info' lists them, and --resume=FRAME from a checkpoint before them, or --overwrite, makes them "
           "again";
}

}  // namespace vdbfrac::core
