#include "run_records.h"

#include "run_files.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/grouping.h>
#include <vdbfrac/base/hash.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>

namespace vdbfrac::core {

namespace {

using nlohmann::json;

/// What a step counts of a stage; an empty `what` stands for its seconds.
struct Column {
    std::string stage, what;
    friend bool operator==(const Column&, const Column&) = default;
};

constexpr std::int64_t kAbsent = std::numeric_limits<std::int64_t>::min();

/// Calls act(field) for the whole numbers of a step, and for the others, in a fixed order.
template <class Record, class Act>
void forWholeNumbers(Record& s, const Act& act)
{
    act(s.step), act(s.outcome), act(s.cutbacks), act(s.newtonIterations), act(s.linearIterations), act(s.projections),
        act(s.fragments), act(s.nodes), act(s.tets);
}
template <class Record, class Act>
void forRealNumbers(Record& s, const Act& act)
{
    act(s.time), act(s.dt), act(s.residual), act(s.minResidual), act(s.kineticEnergy), act(s.elasticEnergy),
        act(s.unnamedShare), act(s.volume);
    for (auto& load : s.gripLoad) act(load.x()), act(load.y()), act(load.z());
}
constexpr std::size_t kWholeNumbers = 9, kRealNumbers = 8;

/// Stages and counts in the order in which they first occur.
std::vector<Column> columnsOf(std::span<const StepRecord> steps)
{
    std::vector<Column> columns;
    const auto add = [&](const Column& c) {
        if (std::find(columns.begin(), columns.end(), c) == columns.end()) columns.push_back(c);
    };
    for (const StepRecord& s : steps)
        for (const StageWork& stage : s.work.stages()) {
            add({stage.name, ""});
            for (const auto& [what, amount] : stage.counts) add({stage.name, what});
        }
    return columns;
}

/// By its name in stats.csv.
using Named = std::map<std::string, double>;

/// Names that occur in one of the maps of steps, rising.
std::vector<std::string> namesOf(std::span<const StepRecord> steps, Named StepRecord::*map)
{
    std::vector<std::string> names;
    for (const StepRecord& s : steps)
        for (const auto& [name, amount] : s.*map) names.push_back(name);
    sortUnique(names);
    return names;
}

/// NaN where a step has no such number.
void appendNamed(const Named& map, const std::vector<std::string>& names, std::vector<double>& real)
{
    for (const std::string& name : names) {
        const auto it = map.find(name);
        real.push_back(it == map.end() ? NAN : it->second);
    }
}

/// What appendNamed() wrote; moves on `real`.
Named readNamed(const std::vector<std::string>& names, const double*& real)
{
    Named map;
    for (const std::string& name : names)
        if (const double amount = *real++; !std::isnan(amount)) map[name] = amount;
    return map;
}

const StageWork* stageOf(const Ledger& work, const std::string& name)
{
    for (const StageWork& stage : work.stages())
        if (stage.name == name) return &stage;
    return nullptr;
}

std::int64_t countOrAbsent(const Ledger& work, const Column& c)
{
    const StageWork* stage = stageOf(work, c.stage);
    if (!stage) return kAbsent;
    const auto it = stage->counts.find(c.what);
    return it == stage->counts.end() ? kAbsent : it->second;
}

/// At least 0, and so small that sums of many do not overflow; a step that is given up may count 1e12 tets.
void requireSummable(std::int64_t amount, const Archive& archive)
{
    constexpr std::int64_t kMax = std::int64_t{1} << 46;
    if (amount < 0 || amount > kMax)
        archive.complain("a count of work is " + std::to_string(amount) + ", which is out of range");
}

std::int64_t wholeNumber(const json& number, const Archive& archive)
{
    if (!number.is_number_integer())
        archive.complain("its list of frames has " + number.dump() + " instead of a whole number");
    requireSummable(number.get<std::int64_t>(), archive);
    return number.get<std::int64_t>();
}

int smallNumber(const json& number, int least, const Archive& archive)
{
    const double value = number.is_number_integer() ? number.get<double>() : NAN;  // which holds what is too large
    if (!(value >= least && value <= std::numeric_limits<int>::max()))
        archive.complain("it has " + number.dump() + " as the number of a frame or a step");
    return int(value);
}

/// Paths are bytes, JSON is Unicode: what is no UTF-8 is shown as its replacement character.
json inUtf8(const std::string& bytes)
{
    return json::parse(json(bytes).dump(-1, ' ', false, json::error_handler_t::replace));
}

}  // namespace

json filesJson(std::span<const WrittenFile> files)
{
    json list = json::array();
    for (const WrittenFile& w : files) list.push_back({{"path", w.path}, {"bytes", w.bytes}, {"xxh3", w.checksum}});
    return list;
}

json framesJson(std::span<const FrameRecord> frames)
{
    json list = json::array();
    for (const FrameRecord& f : frames) {
        list.push_back(
            {{"frame", f.frame}, {"time", f.time}, {"state_hash", f.stateHash}, {"files", filesJson(f.files)}});
        if (f.drawn.lower == f.drawn.upper) continue;
        list.back()["bounds"] = {{f.drawn.lower.x(), f.drawn.lower.y(), f.drawn.lower.z()},
                                 {f.drawn.upper.x(), f.drawn.upper.y(), f.drawn.upper.z()}};
        list.back()["squeeze"] = f.squeeze;
    }
    return list;
}

std::vector<FrameRecord> loadFrames(const Archive& archive)
{
    std::vector<FrameRecord> frames;
    try {
        for (const json& f : json::parse(archive.getText("frames"))) {
            FrameRecord record{smallNumber(f.at("frame"), 0, archive),
                               f.at("time").get<double>(),
                               f.at("state_hash").get<std::string>(),
                               {},
                               {Vec3::Zero(), Vec3::Zero()}};
            if (f.contains("bounds"))
                for (int k = 0; k < 3; ++k) {
                    record.drawn.lower[k] = f.at("bounds").at(0).at(std::size_t(k)).get<double>();
                    record.drawn.upper[k] = f.at("bounds").at(1).at(std::size_t(k)).get<double>();
                }
            record.squeeze = f.value("squeeze", 1.);
            for (const json& w : f.at("files"))
                record.files.push_back({w.at("path").get<std::string>(),
                                        std::uint64_t(wholeNumber(w.at("bytes"), archive)),
                                        w.at("xxh3").get<std::string>()});
            for (const WrittenFile& w : record.files)
                if (!liesBelow(w.path))
                    archive.complain("its list of frames has the file '" + w.path + "', outside of the run's folder");
            frames.push_back(std::move(record));
        }
    } catch (const json::exception& e) {
        archive.complain(std::string("its list of frames cannot be read: ") + e.what());
    }
    return frames;
}

json branchesJson(std::span<const BranchRecord> branches)
{
    json list = json::array();
    for (const BranchRecord& b : branches) {
        json changes = json::array();
        for (const scene::Change& c : b.changes)
            changes.push_back({{"key", c.key}, {"before", c.before}, {"after", c.after}});
        list.push_back({{"frame", b.frame}, {"step", b.step}, {"from", inUtf8(b.from)}, {"changes", changes}});
    }
    return list;
}

std::vector<BranchRecord> branchesOf(const Archive& archive)
{
    std::vector<BranchRecord> branches;
    try {
        for (const json& b : json::parse(archive.getText("branches"))) {
            branches.push_back({smallNumber(b.at("frame"), -1, archive),  // before the first
                                smallNumber(b.at("step"), 0, archive),
                                b.at("from"),
                                {}});
            for (const json& c : b.at("changes"))
                branches.back().changes.push_back({c.at("key"), c.at("before"), c.at("after")});
        }
    } catch (const json::exception& e) {
        archive.complain(std::string("its list of branches cannot be read: ") + e.what());
    }
    return branches;
}

void saveRecords(std::span<const StepRecord> steps, std::span<const FrameRecord> frames, Archive& archive)
{
    const std::vector<Column> columns = columnsOf(steps);
    const std::vector<std::string> flows = namesOf(steps, &StepRecord::energyFlow),
                                   measured = namesOf(steps, &StepRecord::measured);
    std::vector<std::int64_t> whole;
    std::vector<double> real;
    for (const StepRecord& s : steps) {
        forWholeNumbers(s, [&](const auto& field) { whole.push_back(std::int64_t(field)); });
        forRealNumbers(s, [&](const auto& field) { real.push_back(field); });
        appendNamed(s.energyFlow, flows, real);
        appendNamed(s.measured, measured, real);
        for (const Column& c : columns) {
            const StageWork* stage = stageOf(s.work, c.stage);
            if (c.what.empty())
                real.push_back(stage ? stage->seconds : NAN);
            else
                whole.push_back(countOrAbsent(s.work, c));
        }
    }
    json names = json::array();
    for (const Column& c : columns) names.push_back({c.stage, c.what});
    archive.putText("frames", framesJson(frames).dump());
    archive.putText("steps.columns", names.dump());
    archive.putText("steps.flows", json(flows).dump());
    archive.putText("steps.measured", json(measured).dump());
    archive.putOne<std::uint64_t>("steps.grips", steps.empty() ? 0 : steps[0].gripLoad.size());
    archive.putOne<std::uint64_t>("steps.count", steps.size());
    archive.put("steps.whole", whole);
    archive.put("steps.real", real);
}

std::vector<StepRecord> loadSteps(const Archive& archive)
{
    std::vector<Column> columns;
    std::vector<std::string> flows, measured;
    try {
        measured = json::parse(archive.getText("steps.measured")).get<std::vector<std::string>>();
        flows = json::parse(archive.getText("steps.flows")).get<std::vector<std::string>>();
        for (const json& c : json::parse(archive.getText("steps.columns")))
            columns.push_back({c.at(0).get<std::string>(), c.at(1).get<std::string>()});
    } catch (const json::exception& e) {
        archive.complain(std::string("the columns of its steps cannot be read: ") + e.what());
    }
    const std::vector<std::int64_t> whole = archive.get<std::int64_t>("steps.whole");
    const std::vector<double> real = archive.get<double>("steps.real");
    const std::uint64_t grips = archive.getOne<std::uint64_t>("steps.grips"),
                        count = archive.getOne<std::uint64_t>("steps.count");
    const std::size_t seconds =
        std::size_t(std::count_if(columns.begin(), columns.end(), [](const Column& c) { return c.what.empty(); }));
    const std::size_t wholes = kWholeNumbers + columns.size() - seconds;
    // Divided, not multiplied: the numbers may be anything.
    if (whole.size() % wholes != 0 || whole.size() / wholes != count || grips > real.size() ||
        (count == 0 && !real.empty()) ||
        (count > 0 && (real.size() % count != 0 ||
                       real.size() / count != kRealNumbers + 3 * grips + flows.size() + measured.size() + seconds)))
        archive.complain("its table of steps has the wrong size");
    std::vector<StepRecord> steps(count);
    const std::int64_t* w = whole.data();
    const double* r = real.data();
    for (StepRecord& s : steps) {
        s.gripLoad.resize(grips);
        if (w[1] < 0 || w[1] > std::int64_t(Outcome::capped)) archive.complain("a step has an unknown outcome");
        forWholeNumbers(s, [&](auto& field) { field = std::remove_reference_t<decltype(field)>(*w++); });
        forRealNumbers(s, [&](double& field) { field = *r++; });
        s.energyFlow = readNamed(flows, r);
        s.measured = readNamed(measured, r);
        for (const Column& c : columns) {
            if (!c.what.empty()) {
                if (const std::int64_t amount = *w++; amount != kAbsent) {
                    requireSummable(amount, archive);
                    s.work.count(c.stage, c.what, amount);
                }
            } else if (const double spent = *r++; !std::isnan(spent)) {
                s.work.addSeconds(c.stage, spent);
            }
        }
    }
    return steps;
}

RecordLog::Mark RecordLog::append(std::span<const StepRecord> steps, std::span<const FrameRecord> frames)
{
    if (steps.empty() && frames.empty()) return mark_;
    Archive archive;
    saveRecords(steps, frames, archive);
    const std::string bytes = archive.bytes();
    const std::uint64_t length = bytes.size();
    std::string block(reinterpret_cast<const char*>(&length), sizeof length);
    block += bytes;
    writeBehind(file_, mark_.bytes, block);
    mark_ = {mark_.bytes + block.size(), hashBytes(block.data(), block.size(), mark_.hash)};
    return mark_;
}

RecordLog::Records RecordLog::goOnFrom(const Mark& mark)
{
    Records records;
    const std::string text = mark.bytes > 0 ? readText(file_) : std::string();
    const auto damaged = [&] { return FileError(file_.string(), "is damaged: it is not what the checkpoint says"); };
    if (text.size() < mark.bytes) throw damaged();
    std::uint64_t hash = 0;
    for (std::string_view rest = std::string_view(text).substr(0, mark.bytes); !rest.empty();) {
        std::uint64_t length = 0;
        if (rest.size() < sizeof length) throw damaged();
        std::memcpy(&length, rest.data(), sizeof length);
        if (length > rest.size() - sizeof length) throw damaged();
        const std::string_view block = rest.substr(0, sizeof length + length);
        hash = hashBytes(block.data(), block.size(), hash);
        const Archive archive = Archive::parse(block.substr(sizeof length), file_.string());
        for (StepRecord& step : loadSteps(archive)) records.steps.push_back(std::move(step));
        for (FrameRecord& frame : loadFrames(archive)) records.frames.push_back(std::move(frame));
        rest.remove_prefix(block.size());
    }
    if (hash != mark.hash) throw damaged();
    mark_ = mark;
    return records;
}

RecordLog::Records recordsOf(const std::filesystem::path& checkpoint, const Archive& archive)
{
    const auto mark = archive.get<std::uint64_t>("records", 2);
    const std::string name = checkpoint.stem().stem();  // NAME.000120.ckpt
    return RecordLog(checkpoint.parent_path() / (name + kRecordsExtension)).goOnFrom({mark[0], mark[1]});
}

}  // namespace vdbfrac::core
