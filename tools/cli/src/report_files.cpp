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

namespace vdbfrac::cli {

namespace fs = std::filesystem;

namespace {

/// A sheet of the run's frames; empty where it has none.
fs::path sheetOf(const report::Record& record, int pictures, const std::string& name)
{
    const auto& frames = record.manifest["frames"];
    const bool drawn = std::any_of(frames.begin(), frames.end(), [](const report::Json& f) {
        const auto& files = f.at("files");
        return std::any_of(files.begin(), files.end(), [](const report::Json& file) {
            return file.at("path").get<std::string>().ends_with(".obj");
        });
    });
    return drawn && pictures > 0 ? writeSheet(record.folder, pictures, name) : fs::path();
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

/// The last frames side by side, in the order of the runs.
void writeContactSheet(const fs::path& folder, const std::vector<report::Compared>& runs)
{
    constexpr int kColumns = 4, kGap = 4;
    std::vector<pictures::Image> images;
    for (const report::Compared& r : runs)
        if (!r.picture.empty()) images.push_back(pictures::readPng(r.picture));
    if (!images.empty())
        pictures::writePng(folder / "contact_sheet.png", pictures::contactSheet(images, kColumns, kGap));
}

std::string wedgeReport(const fs::path& folder)
{
    const farm::Wedge wedge = farm::readWedge(folder);
    std::vector<report::Compared> runs;
    std::vector<report::Record> records;
    std::vector<std::string> names;
    for (const farm::WedgeRun& run : wedge.runs) {
        const fs::path own = folder / run.name;
        report::Compared& c = runs.emplace_back();
        c.name = run.name, c.values = run.values, c.status = farm::statusOf(folder, run);
        c.numbers = report::Json::object();
        if (!fs::exists(own / "run.json")) continue;
        records.push_back(report::readRecord(own));
        names.push_back(run.name);
        c.numbers = report::numbersOf(records.back());
        c.picture = sheetOf(records.back(), 1, "report_last.png");
        if (fs::exists(own / "report.html")) c.report = run.name + "/report.html";
    }
    writeText(folder / "table.csv", tableText(wedge, runs));
    writeContactSheet(folder, runs);
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
    const fs::path sheet = sheetOf(record, options.pictures, "report_sheet.png");
    writeText(file, report::runPage(record, sheet, std::uint64_t(options.megabytes * kMega)));
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
