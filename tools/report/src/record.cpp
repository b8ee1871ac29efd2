#include <vdbfrac/report/record.h>

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>
#include <utility>

namespace vdbfrac::report {

namespace fs = std::filesystem;

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Numbers by column. Lines that are cut off, as by a copy that was, are left out.
std::map<std::string, std::vector<double>> readColumns(const fs::path& file)
{
    std::map<std::string, std::vector<double>> columns;
    if (!fs::exists(file)) return columns;
    std::istringstream text(readText(file));
    std::string line;
    std::getline(text, line);
    const std::vector<std::string> names = csvCells(line);
    while (std::getline(text, line)) {
        const std::vector<std::string> row = csvCells(line);
        if (row.size() != names.size()) continue;
        for (std::size_t k = 0; k < names.size(); ++k) columns[names[k]].push_back(numberFrom(row[k]).value_or(kNone));
    }
    return columns;
}

double largest(const std::vector<double>& values)
{
    double most = 0;
    for (double v : values)
        if (v > most) most = v;
    return most;
}

}  // namespace

double Record::sum(const std::string& column) const
{
    double sum = 0;
    if (const auto it = columns.find(column); it != columns.end())
        for (double v : it->second)
            if (std::isfinite(v)) sum += v;
    return sum;
}

std::vector<std::string> Record::named(const std::string& begin, const std::string& end) const
{
    std::vector<std::string> names;
    for (const auto& [name, values] : columns)
        if (name.size() >= begin.size() + end.size() && name.starts_with(begin) && name.ends_with(end))
            names.push_back(name);
    return names;
}

std::vector<std::string> Record::stages() const
{
    std::vector<std::string> columns = named("", "_s");
    std::erase_if(columns, [](const std::string& name) { return name == "time_s" || name == "dt_s"; });
    return columns;
}

fs::path manifestIn(const fs::path& folder)
{
    const char* const wrong = !fs::exists(folder)                ? "is not there"
                              : !fs::is_directory(folder)        ? "is no folder"
                              : !fs::exists(folder / "run.json") ? "holds no run: it has no run.json"
                                                                 : nullptr;
    if (wrong) throw FileError(folder.string(), std::string(wrong) + "; give the folder that 'vdbfrac sim -o' wrote");
    return folder / "run.json";
}

InputError badManifest(const fs::path& folder, const Json::exception& e)
{
    return InputError({(folder / "run.json").string(), std::string("is not the manifest of a run: ") + e.what(), "",
                       "give the folder that 'vdbfrac sim -o' wrote"});
}

Json readManifest(const fs::path& folder)
{
    const fs::path file = manifestIn(folder);
    try {
        Json manifest = Json::parse(readText(file));
        for (const char* key : {"creator", "scene", "status", "frame_range", "frames", "fragments", "fps"})
            manifest.at(key);
        return manifest;
    } catch (const Json::exception& e) {
        throw badManifest(folder, e);
    }
}

Record readRecord(const fs::path& folder)
{
    Record record{.folder = folder, .manifest = readManifest(folder), .scene = {}, .columns = {}};
    if (const fs::path scene = folder / "scene.toml"; fs::exists(scene)) record.scene = readText(scene);
    record.columns = readColumns(folder / "stats.csv");
    return record;
}

std::vector<Loaded> loadedOf(const Record& record)
{
    std::vector<Loaded> all;
    for (const auto& [prefix, kind] : {std::pair("load_", "grip"), {"collider_load_", "collider"}})
        for (const std::string& column : record.named(prefix, "_x_N")) {
            const std::string stem = column.substr(0, column.size() - 4);
            all.push_back({kind, stem.substr(std::strlen(prefix)), stem});
        }
    return all;
}

std::vector<double> loadOf(const Record& record, const Loaded& loaded)
{
    const std::string& name = loaded.columns;
    const auto &x = record[name + "_x_N"], &y = record[name + "_y_N"], &z = record[name + "_z_N"];
    std::vector<double> load(x.size());
    for (std::size_t i = 0; i < load.size(); ++i) load[i] = std::hypot(x[i], y[i], z[i]);
    return load;
}

Json numbersOf(const Record& record)
{
    const Json &manifest = record.manifest, &range = manifest["frame_range"];
    Json numbers;
    numbers["Frames"] = manifest["frames"].size();
    numbers["Frames asked for"] = range[1].get<int>() - range[0].get<int>() + 1;
    numbers["Steps"] = record.steps();
    if (record.steps() == 0) return numbers;
    double seconds = 0;
    for (const std::string& stage : record.stages()) seconds += record.sum(stage);
    numbers["Time in steps [s]"] = seconds;
    numbers["Nodes"] = record["nodes"].back();
    numbers["Fragments"] = record["fragments"].back();
    const double start = manifest.value("start_volume", 0.), now = manifest.value("volume", start);
    numbers["Material lost [%]"] = start > 0 ? 100 * (1 - now / start) : 0;
    for (const Loaded& loaded : loadedOf(record))
        numbers["Peak load on " + loaded.name + " [N]"] = largest(loadOf(record, loaded));
    numbers["Energy taken by cracks [J]"] = record.sum("removed_J");
    numbers["Energy without account [%]"] = 100 * record["unnamed_share"].back();
    numbers["Steps cut back"] =
        std::count_if(record["cutbacks"].begin(), record["cutbacks"].end(), [](double n) { return n > 0; });
    numbers["Newton iterations a step"] = record.sum("newton_iterations") / double(record.steps());
    return numbers;
}

}  // namespace vdbfrac::report
