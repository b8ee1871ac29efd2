#include <vdbfrac/core/branch.h>

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/number_text.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace vdbfrac::core {

namespace {

constexpr const char* kVoxelSize = "grid.voxel_size";

bool isHalved(const scene::Change& change)
{
    constexpr double kSame = 1e-9;
    const std::optional<double> before = numberFrom(change.before), after = numberFrom(change.after);
    return before && after && *after > 0 && std::abs(*before / *after - 2) < kSame;
}

/// Why a key has to stay; empty: it may change.
std::string reasonToStay(const scene::Change& change)
{
    const std::string& key = change.key;
    if (key.starts_with("body.")) return key.ends_with(".material") ? "" : "a branch keeps the bodies that there are";
    if (key.starts_with("grip."))
        return key.ends_with(".move") || key.ends_with(".until")
                   ? ""
                   : "a branch keeps the grips that there are; only their move and until may change";
    if (key == kVoxelSize) return isHalved(change) ? "" : "voxels may become half as wide, no other size";
    if (key.starts_with("grid.")) return "a branch keeps the lattice, or halves its voxel_size";
    if (key == "time.frames" || key == "time.fps") return "the first frame and the time of frames are those of the run";
    if (key == "output.motion" || key == "output.point_cache")
        return change.after.empty() || change.after == "false" || change.after == "[]"
                   ? ""
                   : "it follows nodes from the first frame on";
    if (key == "name" || key == "version") return "files bear the name of the scene";
    return "";
}

}  // namespace

Branch branchBetween(const std::string& before, const std::string& after)
{
    Branch branch{scene::changesBetween(before, after)};
    std::vector<InputError::Detail> refused;
    for (const scene::Change& change : branch.changes) {
        if (const std::string reason = reasonToStay(change); !reason.empty())
            refused.push_back({change.key, changeText(change) + " cannot change in a branch: " + reason, "", ""});
        branch.isFiner = branch.isFiner || change.key == kVoxelSize;
    }
    if (!refused.empty()) throw InputError(refused);
    return branch;
}

bool isDrawnOtherwiseOnly(const Branch& branch)
{
    return std::ranges::all_of(branch.changes, [](const scene::Change& c) {
        return c.key.starts_with("output.") || c.key.ends_with("colour") || c.key.ends_with(".drawn");
    });
}

bool hasOtherColliders(const Branch& branch)
{
    return std::ranges::any_of(branch.changes, [](const scene::Change& c) {
        return c.key.starts_with("collider") || c.key.ends_with("colliders");  // the hash of their files too
    });
}

std::string changeText(const scene::Change& change)
{
    constexpr std::size_t kLong = 100;  // a whole table, with all that it leaves out
    const auto value = [](const std::string& text) {
        if (text.empty()) return std::string("not there");
        return text.size() > kLong ? text.substr(0, kLong) + " ..." : text;
    };
    return change.key + " = " + value(change.after) + " (was " + value(change.before) + ")";
}

}  // namespace vdbfrac::core
