// The workloads of 'vdbfrac bench'. Each gives what it measured as JSON, work counts beside every time.
#pragma once

#include <vdbfrac/lab/bench/floors.h>

#include <nlohmann/json.hpp>

#include <functional>
#include <set>
#include <string>
#include <vector>

namespace vdbfrac::lab::bench {

using Json = nlohmann::ordered_json;
/// A line for people, on what was just measured.
using Say = std::function<void(const std::string& line)>;

/// Standard block: n^3 nodes.
struct BlockSize {
    int n = 20;
    int steps = 12;
};

/// Notched block, from rest until this much has happened.
struct TearSize {
    int voxels = 20;     ///< along an edge
    int tornSteps = 0;   ///< stops after so many steps in which something tore
    int lastFrame = 96;  ///< stops here in any case
};

/// Two blocks of so many voxels along an edge, a quarter as high, that are pressed together.
struct TouchSize {
    int voxels = 16;
    int steps = 5;
};

/// What is measured in one run of the program.
struct Plan {
    std::vector<BlockSize> blocks;
    std::vector<TearSize> tears;
    std::vector<TouchSize> touches;
    int ballVoxels = 24;             ///< across the ball of the single stages and of the kernels
    std::vector<int> solverSizes;    ///< nodes a side of the block that linear solvers are compared on, 2^k + 1
    std::vector<int> residualSizes;  ///< nodes a side for the time to a residual
    int memoryNodes = 20;            ///< a side of the block whose memory is counted
    int memoryVoxels = 50;           ///< along an edge of the notched block whose memory is counted
    int threads = 1;                 ///< the most; single-threaded besides where a speed-up is of interest
};

Json describeMachine(int threads);
Json toJson(const Floors& floors);
Json benchBlock(const BlockSize& size, int threads, const Floors& floors, const Say& say);
Json benchTear(const TearSize& size, const Say& say);
Json benchTouch(const TouchSize& size, const Say& say);
Json benchStages(int voxels, const Floors& floors, const Say& say);
Json benchSolvers(const Plan& plan, const Say& say);
/// `ballVoxels` across the ball that is cut. The block has about as many cells.
Json benchKernels(int ballVoxels, int threads, const Say& say);
Json benchMemory(const Plan& plan, const Say& say);

/// Thread counts to measure: 1, and `threads` where that is more.
inline std::set<int> threadCounts(int threads) { return {1, threads}; }

}  // namespace vdbfrac::lab::bench
