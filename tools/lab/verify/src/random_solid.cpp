#include "random_solid.h"

#include "scene_text.h"

#include <algorithm>

namespace vdbfrac::lab::verify {

namespace {

constexpr char kAxes[] = "xyz";

}  // namespace

std::string randomSolid(Dice& dice, const SolidFrame& frame)
{
    const double L = frame.length, least = 1.1 * frame.cell;
    const auto radius = [&](double low, double high) { return std::max(least, dice.uniform(low, high) * L); };
    const std::string center = list(frame.center);
    switch (dice.below(L >= 8 * frame.cell ? 5 : 4)) {
    case 0: return format("sphere = { radius = %.6g, center = %s }", L / 2, center.c_str());
    case 1: {
        const double r = radius(.2, .5);
        return format("cylinder = { axis = \"%c\", radius = %.6g, height = %.6g, center = %s }", kAxes[frame.axis], r,
                      L, center.c_str());
    }
    case 2: {
        const double r = radius(.15, .3);
        return format("capsule = { axis = \"%c\", radius = %.6g, height = %.6g, center = %s }", kAxes[frame.axis], r,
                      std::max(0., L - 2 * r), center.c_str());
    }
    case 3: {
        Vec3 size;
        for (double& s : size) s = 2 * radius(.15, .5);
        size[frame.axis] = L;
        return format("box = { size = %s, center = %s }", list(size).c_str(), center.c_str());
    }
    default:  // the ring lies in the plane of frame.axis
        const double tube = radius(.1, .16);
        return format("torus = { axis = \"%c\", radius = %.6g, tube = %.6g, center = %s }", kAxes[(frame.axis + 1) % 3],
                      L / 2 - tube, tube, center.c_str());
    }
}

std::string randomCut(Dice& dice, const SolidFrame& frame)
{
    const double L = frame.length;
    Vec3 center = frame.center + dice.inBox(.5 * L);
    center[frame.axis] = frame.center[frame.axis] + dice.uniform(-.12, .12) * L;
    switch (dice.below(3)) {
    case 0:
        return format("{ sphere = { radius = %.6g, center = %s } }", dice.uniform(.05, .2) * L, list(center).c_str());
    case 1:
        return format("{ cylinder = { axis = \"%c\", radius = %.6g, center = %s } }", kAxes[(frame.axis + 1) % 3],
                      dice.uniform(.04, .15) * L, list(center).c_str());
    default:
        Vec3 size;
        for (double& s : size) s = dice.uniform(.2, .8) * L;
        size[frame.axis] = dice.uniform(.01, .15) * L;
        return format("{ box = { size = %s, center = %s } }", list(size).c_str(), list(center).c_str());
    }
}

}  // namespace vdbfrac::lab::verify
