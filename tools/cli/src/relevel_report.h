// What is said of a re-levelled surface or grid.
#pragma once

#include <vdbfrac/base/ledger.h>
#include <vdbfrac/grid/relevel.h>
#include <vdbfrac/repair/surface_repair.h>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace vdbfrac::cli {

/// What became of a grid.
struct GridChange {
    grid::LevelSetReport before;
    bool resampled = false;
    grid::Redistancing redistancing = grid::Redistancing::track;
};

struct RelevelReport {
    grid::LevelSet levelSet;
    grid::LevelSetReport after;
    std::optional<repair::Repaired> repair;  ///< of a surface
    std::optional<GridChange> grid;          ///< of a grid
    double inputVolume = 0;                  ///< m^3: of the repaired surface, or of the grid before
    std::int64_t gaps = 0;                   ///< of a surface: pairs of voxels with a gap between them, which is filled
    Ledger work;
};

std::string reportText(const RelevelReport& report);
/// What may not be as it was meant: each a line.
std::vector<std::string> notesOf(const RelevelReport& report);
nlohmann::ordered_json reportJson(const RelevelReport& report, const std::string& input, const std::string& output);

}  // namespace vdbfrac::cli
