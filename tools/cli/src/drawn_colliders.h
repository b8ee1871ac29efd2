// The colliders of a scene in the pictures of its run. Not installed.
#pragma once

#include <vdbfrac/pictures/render.h>
#include <vdbfrac/scene/scene.h>

#include <optional>
#include <span>
#include <vector>

namespace vdbfrac::cli {

class DrawnColliders {
public:
    explicit DrawnColliders(const scene::Scene& scene);

    /// Height [m] of a level floor, where one of them is a halfspace that stands still.
    std::optional<double> floor() const { return floor_; }
    /// Height [m] of the lowest point of the others at these times [s]; halfspaces and cylinders without ends have
    /// none.
    std::optional<double> lowest(std::span<const double> times) const;
    /// Adds those that can be seen at a time [s]; `origin` [m]: of the picture. Halfspaces that are not the floor are
    /// squares, as large as what is in the picture needs.
    void addTo(pictures::Subject& subject, double time, const Vec3& origin) const;

private:
    struct Drawn {
        const scene::Collider* collider;
        pictures::Subject surface;  // where it is at t = 0; empty: a halfspace
    };
    std::vector<Drawn> drawn_;
    std::optional<double> floor_;
};

}  // namespace vdbfrac::cli
