// A wedge: a scene that is simulated with many settings, each in a folder of its own.
//
//   DIR/wedge.json        what is varied, and the runs
//   DIR/scenes/NAME.toml  the scene of each run, as it was when the wedge was made: what a run reads
//   DIR/NAME/             the run
//   DIR/logs/NAME.log     what it said
#pragma once

#include <vdbfrac/scene/scene.h>

#include <filesystem>
#include <string>
#include <vector>

namespace vdbfrac::farm {

struct WedgeRun {
    std::string name;                 ///< "0000", "0001", ...
    std::vector<std::string> values;  ///< TOML texts, one for each key
};

struct Wedge {
    std::string name;  ///< of the scene
    std::vector<std::string> keys;
    std::vector<WedgeRun> runs;
};

/// What a wedge is made of.
struct WedgeInput {
    std::filesystem::path scene;
    std::vector<std::string> set;   ///< --set, in all runs
    std::vector<std::string> vary;  ///< "key=value,value": in place of the scene's own
    bool together = false;          ///< with `vary`: the first value of each key, then the second of each, ...
};

struct WedgePlan {
    Wedge wedge;
    std::vector<scene::Scene> scenes;  ///< of the runs
};

/// Reads the scene with the settings of each run. Throws InputError where nothing is varied, for values that do not
/// pair, and with all complaints of all runs for settings that are no valid scene.
WedgePlan planWedge(const WedgeInput& input);

/// Writes wedge.json and the scenes. What a folder holds of the same wedge is left as it is, and its runs keep their
/// names in the plan; one that holds another wedge, or anything else, is refused. Throws InputError, FileError.
void layOut(WedgePlan& plan, const std::filesystem::path& folder);

/// Throws InputError, FileError.
Wedge readWedge(const std::filesystem::path& folder);

std::filesystem::path sceneFile(const std::filesystem::path& folder, const WedgeRun& run);
std::filesystem::path logFile(const std::filesystem::path& folder, const WedgeRun& run);

/// Keeps the exit code of a run for `statusOf`, next to its log; 0: that it has not failed. Throws FileError.
void keepFailure(const std::filesystem::path& folder, const WedgeRun& run, int code);

/// "running", "done", ... as run.json says; "failed (CODE)" of one that has not all its frames and ended with an error,
/// whatever it could write, unless it got stuck; "waiting" of one that has not begun.
std::string statusOf(const std::filesystem::path& folder, const WedgeRun& run);
/// Has it all its frames?
bool isDone(const std::string& status);

}  // namespace vdbfrac::farm
