#include "all.h"

#include <vdbfrac/core/run_folder.h>

#include <algorithm>

namespace vdbfrac::effects {

std::span<const EffectInfo> effectList()
{
    static const std::vector<EffectInfo> kList = {
#define VDBFRAC_EFFECT(name) name(),
#include <effect_names.h>
#undef VDBFRAC_EFFECT
    };
    return kList;
}

scene::Vocabulary vocabulary()
{
    scene::Vocabulary all{.fields = core::outputFields()};
    for (const EffectInfo& e : effectList()) {
        all.tables.push_back(e.table);
        all.tables.back().kind = "Effect";
        all.fields.rest.insert(all.fields.rest.end(), e.fields.begin(), e.fields.end());
    }
    return all;
}

namespace {

/// The scene's table of an effect, or null.
const scene::NamedValues* tableOf(const EffectInfo& info, const scene::Scene& scene)
{
    const auto named = std::find_if(scene.tables.begin(), scene.tables.end(),
                                    [&](const scene::NamedValues& t) { return t.name == info.table.name; });
    return named != scene.tables.end() ? &*named : nullptr;
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
        if (const scene::NamedValues* table = tableOf(info, scene)) effects.push_back(info.make(table->values, scene));
    return effects;
}

}  // namespace vdbfrac::effects
