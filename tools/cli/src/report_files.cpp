#include "report_files.h"

#include "run_pictures.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/farm/wedge.h>
#include <vdbfrac/pictures/png_file.h>
#include <vdbfrac/report/page.h>
#include <vdbfrac/report/plots.h>

#include <algorithm>
#include <optional>

namespace vdbfrac::cli {

namespace fs = std::filesystem;

namespace {

/// A sheet of the run's frames, where it has any.
std::optional<pictures::Image> drawnFrames(const report::Record& record, int pictures)
{
    const std::vector<report::RunFrame> frames = report::framesOf(record.manifest, record.folder).frames;
    const bool drawn = std::ranges::any_of(frames, [](const report::RunFrame& f) { return !f.obj.empty(); });
    if (!drawn || pictures == 0) return std::nullopt;
    return sheetOf(record.folder, pictures);
}

/// A row a run: its values, its status, its numbers. A column for every number that any of them has.
std::string tableText(const farm::Wedge& wedge, const std::vector<report::Compared>& runs)
{
    std::vector<std::string> numbers;
    for (const report::Compared& r : runs)
        for (const auto& [name, value] : r.numbers.items())
            if (std::find(numbers.begin(), numbers.end(), name) == numbers.end()) numbers.push_back(name);
    std::string text = "run";
    for (const std::string& key : wedge.keys) text += "," + csvCell(key);
    text += ",status";
    for (const std::string& name : numbers) text += "," + csvCell(name);
    text += "\n";
    for (const report::Compared& r : runs) {
        text += r.name;
        for (const std::string& value : r.values) text += "," + csvCell(value);
        text += "," + csvCell(r.status);
        for (const std::string& name : numbers) text += "," + (r.numbers.contains(name) ? r.numbers[name].dump() : "");
        text += "\n";
    }
    return text;
}

/// What a picture of a run is told apart by.
std::string labelOf(const farm::Wedge& wedge, const report::Compared& run)
{
    std::string label = run.name;
    for (std::size_t k = 0; k < run.values.size(); ++k)
        label += " " + wedge.keys[k].substr(wedge.keys[k].rfind('.') + 1) + "=" + run.values[k];
    return label;
}

std::string wedgeReport(const fs::path& folder)
{
    constexpr int kColumns = 4, kGap = 4;
    const farm::Wedge wedge = farm::readWedge(folder);
    std::vector<report::Compared> runs;
    std::vector<pictures::Image> last;  // frames of the runs, in their order
    std::vector<report::Record> records;
    std::vector<std::string> names;
    for (const farm::WedgeRun& run : wedge.runs) {
        const fs::path own = folder / run.name;
        report::Compared& c = runs.emplace_back();
        c.name = run.name, c.values = run.values, c.status = farm::statusOf(folder, run);
        c.numbers = report::Json::object();
        if (!fs::exists(own / "run.json")) continue;
        if (fs::exists(own / "report.html")) c.report = run.name + "/report.html";
        // A run that is damaged is no reason to lose the page of the others.
        try {
            report::Record record = report::readRecord(own);
            c.numbers = report::numbersOf(record);
            records.push_back(std::move(record)), names.push_back(run.name);
            if (auto picture = drawnFrames(records.back(), 1)) {
                c.picture = pictures::pngOf(*picture);
                pictures::drawLabel(last.emplace_back(std::move(*picture)), labelOf(wedge, c));
            }
        } catch (const std::exception& e) {
            c.status += std::string("; cannot be read: ") + e.what();
        }
    }
    writeText(folder / "table.csv", tableText(wedge, runs));
    if (!last.empty()) pictures::writePng(folder / "contact_sheet.png", pictures::contactSheet(last, kColumns, kGap));
    return report::wedgePage(wedge.name, wedge.keys, runs, report::comparedPlots(records, names));
}

}  // namespace

fs::path writeReport(const fs::path& folder, const ReportOptions& options, fs::path file)
{
    constexpr double kMega = 1e6;
    if (file.empty()) file = folder / "report.html";
    if (fs::exists(folder / "wedge.json")) {
        writeText(file, wedgeReport(folder));
        return file;
    }
    const report::Record record = report::readRecord(folder);
    const std::optional<pictures::Image> sheet = drawnFrames(record, options.pictures);
    writeText(file,
              report::runPage(record, sheet ? pictures::pngOf(*sheet) : "", std::uint64_t(options.megabytes * kMega)));
    return file;
}

std::string LiveReport::update() { return Clock::now() < next_ ? "" : finish(); }

/// A page is no reason to lose a run.
std::string LiveReport::finish()
{
    constexpr int kShare = 20;
    const Clock::time_point start = Clock::now();
    std::string wrong;
    try {
        writeReport(folder_);
    } catch (const std::exception& e) {
        wrong = e.what();
    }
    next_ = Clock::now() + kShare * (Clock::now() - start);
    return wrong;
}

}  // namespace vdbfrac::cli
