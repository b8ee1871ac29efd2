#include <vdbfrac/scene/curve.h>

#include <algorithm>

namespace vdbfrac::scene {

double Curve::at(double time) const
{
    if (keys.empty()) return 1;
    const auto after =
        std::upper_bound(keys.begin(), keys.end(), time, [](double t, const Key& k) { return t < k.time; });
    if (after == keys.begin()) return keys.front().scale;
    if (after == keys.end()) return keys.back().scale;
    const Key &a = after[-1], &b = after[0];
    const double s = (time - a.time) / (b.time - a.time);
    return (1 - s) * a.scale + s * b.scale;
}

}  // namespace vdbfrac::scene
