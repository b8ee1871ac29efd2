#include <vdbfrac/base/ledger.h>

#include <algorithm>

namespace vdbfrac {

StageWork& Ledger::stage(const std::string& name)
{
    for (StageWork& s : stages_)
        if (s.name == name) return s;
    return stages_.emplace_back(StageWork{name, 0, {}});
}

const StageWork* Ledger::find(const std::string& name) const
{
    const auto it = std::find_if(stages_.begin(), stages_.end(), [&](const StageWork& s) { return s.name == name; });
    return it == stages_.end() ? nullptr : &*it;
}

void Ledger::count(const std::string& name, const std::string& what, std::int64_t amount)
{
    stage(name).counts[what] += amount;
}

void Ledger::addSeconds(const std::string& name, double seconds) { stage(name).seconds += seconds; }

std::int64_t Ledger::countOf(const std::string& name, const std::string& what) const
{
    const StageWork* s = find(name);
    if (!s) return 0;
    const auto it = s->counts.find(what);
    return it == s->counts.end() ? 0 : it->second;
}

double Ledger::secondsOf(const std::string& name) const
{
    const StageWork* s = find(name);
    return s ? s->seconds : 0;
}

void Ledger::add(const Ledger& other)
{
    for (const StageWork& s : other.stages_) {
        addSeconds(s.name, s.seconds);
        for (const auto& [what, amount] : s.counts) count(s.name, what, amount);
    }
}

}  // namespace vdbfrac
