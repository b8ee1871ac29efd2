#include "all.h"

#include <algorithm>

namespace vdbfrac::effects {

std::span<const EffectInfo> effectList()
{
#ifdef VDBFRAC_NO_EFFECTS
    return {};
#else
    static const std::vector<EffectInfo> kList = {gravity(), damping(), fracture()};
    return kList;
#endif
}

std::vector<scene::TableSpec> effectTables()
{
    std::vector<scene::TableSpec> tables;
    for (const EffectInfo& e : effectList()) tables.push_back(e.table);
    return tables;
}

namespace {

/// The scene's table of an effect, or null.
const scene::EffectTable* tableOf(const EffectInfo& info, const scene::Scene& scene)
{
    const auto named = std::find_if(scene.effects.begin(), scene.effects.end(),
                                    [&](const scene::EffectTable& t) { return t.name == info.table.name; });
    return named != scene.effects.end() ? &*named : nullptr;
}

}  // namespace

bool canTear(const scene::Scene& scene)
{
    const auto list = effectList();
    return std::any_of(list.begin(), list.end(),
                       [&](const EffectInfo& info) { return info.tears && tableOf(info, scene); });
}

std::vector<std::unique_ptr<core::Effect>> makeEffects(const scene::Scene& scene)
{
    std::vector<std::unique_ptr<core::Effect>> effects;
    for (const EffectInfo& info : effectList())
        if (const scene::EffectTable* table = tableOf(info, scene)) effects.push_back(info.make(table->values, scene));
    return effects;
}

}  // namespace vdbfrac::effects
