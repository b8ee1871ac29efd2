#include "all.h"

#include <vdbfrac/core/run_folder.h>
#include <vdbfrac/scene/notes.h>

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
        if (e.inScene) {
            all.colliders = true;
            continue;
        }
        all.tables.push_back(e.table);
        all.tables.back().kind = "Effect";
        all.fields.rest.insert(all.fields.rest.end(), e.fields.begin(), e.fields.end());
    }
    return all;
}

bool isNamed(const EffectInfo& effect, const scene::Scene& scene)
{
    return effect.inScene ? effect.inScene(scene) : scene.table(effect.table.name) != nullptr;
}

bool canTear(const scene::Scene& scene)
{
    const auto list = effectList();
    return std::any_of(list.begin(), list.end(),
                       [&](const EffectInfo& info) { return info.tears && isNamed(info, scene); });
}

double bytesPerTet(const scene::Scene& scene)
{
    double sum = 0;
    for (const EffectInfo& info : effectList())
        if (isNamed(info, scene)) sum += info.bytesPerTet;
    return sum;
}

std::vector<std::string> notesOf(const scene::Scene& scene)
{
    std::vector<std::string> notes = scene::notesOf(scene);
    for (const EffectInfo& info : effectList())
        if (info.bodiesWithout && scene.bodies.size() > 1 && !isNamed(info, scene)) notes.push_back(info.bodiesWithout);
    return notes;
}

std::vector<std::unique_ptr<core::Effect>> makeEffects(const scene::Scene& scene)
{
    std::vector<std::unique_ptr<core::Effect>> effects;
    std::vector<InputError::Detail> wrong;  // of all effects
    for (const EffectInfo& info : effectList()) {
        if (!isNamed(info, scene)) continue;
        const scene::Values* const values = scene.table(info.table.name);
        try {
            effects.push_back(info.make(values ? *values : scene::Values(), scene));
        } catch (const InputError& e) {
            wrong.insert(wrong.end(), e.details().begin(), e.details().end());
        }
    }
    if (!wrong.empty()) throw InputError(std::move(wrong));
    return effects;
}

}  // namespace vdbfrac::effects
