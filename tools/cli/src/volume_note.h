// How far the volume of a level set is from that of what it was made of.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <string>

namespace vdbfrac::cli {

/// More than voxels that are fit for a shape round off. Parts of it.
inline constexpr double kAnotherVolume = 0.03;

/// Relative; 0 where the input has no volume to compare with.
inline double volumeChange(double made, double input) { return input > 0 ? made / input - 1 : 0; }

/// What to say of it; empty when there is nothing to say.
inline std::string volumeNote(double made, double input, double voxelSize)
{
    const double change = volumeChange(made, input);
    if (std::abs(change) <= kAnotherVolume) return "";
    return fmt::format("the input encloses {:.4g} m^3, the level set {:.4g} m^3 ({:+.1f} %): {} for voxels of {:.4g} m",
                       input, made, 100 * change,
                       change < 0 ? "parts of it are too thin"
                                  : "hollows that are closed on all sides are filled, or gaps are too narrow",
                       voxelSize);
}

}  // namespace vdbfrac::cli
