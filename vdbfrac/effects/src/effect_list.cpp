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

std::vector<std::unique_ptr<core::Effect>> makeEffects(const scene::Scene& scene)
{
    std::vector<std::unique_ptr<core::Effect>> effects;
    for (const EffectInfo& info : effectList()) {
        const auto named = std::find_if(scene.effects.begin(), scene.effects.end(),
                                        [&](const scene::EffectTable& t) { return t.name == info.table.name; });
        if (named != scene.effects.end()) effects.push_back(info.make(named->values, scene));
    }
    return effects;
}

}  // namespace vdbfrac::effects
