#include <vdbfrac/scene/notes.h>

#include <vdbfrac/base/number_text.h>

namespace vdbfrac::scene {

namespace {

/// Of the keys of one motion; `end`: s, of the last frame.
void noteKeys(const std::string& whose, const Keys& move, double end, std::vector<std::string>& notes)
{
    constexpr double kMuch = 5, kRounding = 1e-9;  // times the run
    const double first = move.keys.front().time, last = move.keys.back().time, late = end * (1 + kRounding);
    if (first <= late && last <= kMuch * late) return;
    notes.push_back(whose + ": its keys " + (first > late ? "begin at " : "go on to ") +
                    shortNumber(first > late ? first : last, 4) + " s, the last frame is at " + shortNumber(end, 4) +
                    " s: times are in seconds, not in frames");
}

}  // namespace

std::vector<std::string> notesOf(const Scene& scene)
{
    const double end = (scene.time.lastFrame - scene.time.firstFrame) / scene.time.fps;
    std::vector<std::string> notes;
    if (end == 0) return notes;
    for (const Grip& grip : scene.grips)
        if (const Keys* keys = std::get_if<Keys>(&grip.move)) noteKeys("grip '" + grip.name + "'", *keys, end, notes);
    for (const Collider& collider : scene.colliders)
        if (const Keys* keys = std::get_if<Keys>(&collider.move))
            noteKeys("collider '" + collider.name + "'", *keys, end, notes);
    return notes;
}

}  // namespace vdbfrac::scene
