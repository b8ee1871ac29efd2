#include <vdbfrac/report/page.h>

#include "compressed.h"
#include "page_files.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/report/player.h>
#include <vdbfrac/report/plots.h>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>

namespace vdbfrac::report {

namespace fs = std::filesystem;

namespace {

std::string now()
{
    return fmt::format("{:%Y-%m-%d %H:%M:%S}",
                       fmt::localtime(std::chrono::system_clock::to_time_t(std::chrono::system_clock::now())));
}

Json pictureOf(const std::string& bytes)
{
    if (bytes.empty()) return nullptr;
    return "data:image/png;base64," + base64({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

std::string escaped(const std::string& text)
{
    std::string safe;
    for (const char c : text) safe += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
    return safe;
}

/// No text of a user can end the element that it stands in.
std::string scriptText(const Json& data)
{
    std::string text = data.dump(-1, ' ', false, Json::error_handler_t::replace), safe;
    safe.reserve(text.size());
    for (const char c : text) safe += c == '<' ? "\\u003c" : std::string(1, c);
    return safe;
}

/// The page with its parts in their places.
std::string assembled(const std::string& title, const Json& data)
{
    std::string page(pageHtml());
    const auto put = [&](const std::string& place, const std::string& what) {
        const std::size_t at = page.find(place);
        if (at == std::string::npos) throw Error("internal: the page has no place " + place);
        page.replace(at, place.size(), what);
    };
    put("<!--TITLE-->", escaped(title));
    put("<!--STYLE-->", "<style>" + std::string(pageStyle()) + "</style>");
    put("<!--THREE-->", "<script>" + std::string(threeScript()) + "</script>");
    put("<!--SCRIPT-->", "<script>" + pageScript() + "</script>");
    put("<!--DATA-->", "<script type=\"application/json\" id=\"data\">" + scriptText(data) + "</script>");
    return page;
}

std::string shownNumber(const Json& value)
{
    return value.is_number_float() ? fmt::format("{:.4g}", value.get<double>()) : value.dump();
}

Json summaryOf(const Record& record)
{
    Json summary = Json::array();
    const Json numbers = numbersOf(record);
    summary.push_back(
        {"Frames", fmt::format("{} of {}", numbers["Frames"].get<int>(), numbers["Frames asked for"].get<int>())});
    for (const auto& [name, value] : numbers.items())
        if (!name.starts_with("Frames")) summary.push_back({name, shownNumber(value)});
    if (const Json& frames = record.manifest["frames"]; !frames.empty())
        summary.push_back({"State", frames.back().value("state_hash", "")});
    return summary;
}

Json stagesOf(const Record& record)
{
    Json stages = Json::array();
    for (const std::string& name : record.stages())
        stages.push_back({{"name", name.substr(0, name.size() - 2)}, {"seconds", record.sum(name)}});
    std::stable_sort(stages.begin(), stages.end(),
                     [](const Json& a, const Json& b) { return a["seconds"] > b["seconds"]; });
    return stages;
}

Json fragmentsOf(const Record& record)
{
    Json all = Json::array();
    for (const Json& f : record.manifest["fragments"])
        all.push_back({{"id", f.at("id")},
                       {"body", f.at("body")},
                       {"parent", f.at("parent")},
                       {"birth", f.at("birth")},
                       {"volume", f.at("rest_volume")}});
    return all;
}

}  // namespace

std::string runPage(const Record& record, const std::string& sheet, std::uint64_t maxBytes)
{
    const std::string name = record.manifest["scene"].get<std::string>();
    const Json data = {{"kind", "run"},
                       {"name", name},
                       {"status", record.manifest["status"]},
                       {"program", record.manifest["creator"]},
                       {"updated", now()},
                       {"summary", summaryOf(record)},
                       {"scene", record.scene},
                       {"sheet", pictureOf(sheet)},
                       {"plots", plotsOf(record)},
                       {"stages", stagesOf(record)},
                       {"fragments", fragmentsOf(record)},
                       {"player", maxBytes > 0 ? playerOf(record, maxBytes) : Json(nullptr)}};
    return assembled(name, data);
}

std::string wedgePage(const std::string& name, const std::vector<std::string>& keys, const std::vector<Compared>& runs,
                      const Json& plots)
{
    Json list = Json::array();
    std::size_t done = 0;
    for (const Compared& r : runs) {
        done += r.status.starts_with("done");
        list.push_back({{"name", r.name},
                        {"values", r.values},
                        {"status", r.status},
                        {"picture", pictureOf(r.picture)},
                        {"report", r.report.empty() ? Json(nullptr) : Json(r.report)},
                        {"numbers", r.numbers}});
    }
    return assembled(name, {{"kind", "wedge"},
                            {"name", name},
                            {"updated", now()},
                            {"status", fmt::format("{} of {} done", done, runs.size())},
                            {"keys", keys},
                            {"runs", list},
                            {"plots", plots}});
}

}  // namespace vdbfrac::report
