// Whole scenes: numbers that make no sense, forces beyond measure, materials that bear nothing or everything.
#include "cases.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/effects/effects.h>
#include <vdbfrac/lab/machine/scratch.h>
#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/scene/reader.h>
#include <vdbfrac/tetmesh/surface_input.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::lab::verify {

namespace {

struct Replacement {
    const char *from, *to;
};

constexpr const char* kBlock = R"(version = 1
name = "block"
[time]
frames = [1, 6]
fps = 24
substeps = 1
[grid]
voxel_size = 0.1
[[body]]
name = "block"
shape = { box = { size = [0.4, 0.6, 0.4] } }
velocity = [0, 0, 0]
angular_velocity = [0, 0, 0]
material = "m"
[material.m]
youngs_modulus = 1e5
poisson_ratio = 0.3
density = 1000
)";

constexpr const char* kGrips = R"([[grip]]
body = "block"
region = { halfspace = { normal = [0, 1, 0], offset = 0.2 } }
move = { velocity = [0, 0.2, 0] }
[[grip]]
body = "block"
region = { halfspace = { normal = [0, -1, 0], offset = 0.2 } }
move = { velocity = [0, -0.2, 0] }
)";

std::string changed(std::string text, const Replacement& r)
{
    return text.replace(text.find(r.from), std::string_view(r.from).size(), r.to);
}

std::string blockWith(double nu)
{
    return changed(kBlock, {"poisson_ratio = 0.3", ("poisson_ratio = " + std::to_string(nu)).c_str()});
}

/// Is the change refused with one error (exit code 2) that has the line, the key, the value and what is allowed?
bool isRefused(const Replacement& r)
{
    const std::string key = std::string(r.to, std::string_view(r.to).find(' '));
    const std::string text = changed(kBlock, r);
    const auto line = 1 + std::count(text.begin(), text.begin() + long(text.find(r.to)), '\n');
    try {
        (void)scene::parseScene(text, "case.toml", effects::vocabulary());
    } catch (const InputError& error) {
        const auto& d = error.details().front();
        return error.details().size() == 1 && d.place.find("case.toml:" + std::to_string(line) + ":") == 0 &&
               d.what.find(key) != std::string::npos && !d.allowed.empty();
    }
    return false;
}

double refused(std::span<const Replacement> all) { return double(std::count_if(all.begin(), all.end(), isRefused)); }

/// Is a surface with this text refused with an error that names the file?
bool surfaceIsRefused(const ScratchFolder& folder, const char* name, const std::string& text)
{
    const auto file = folder.path() / name;
    writeText(file, text);
    try {
        (void)tetmesh::readSurface(file);
    } catch (const InputError& error) {
        return error.details().front().place.find(name) != std::string::npos;
    }
    return false;
}

}  // namespace

Measurements badNumbers(Extent)
{
    constexpr Replacement kBad[] = {{"poisson_ratio = 0.3", "poisson_ratio = 0.5"},
                                    {"poisson_ratio = 0.3", "poisson_ratio = 0.7"},
                                    {"poisson_ratio = 0.3", "poisson_ratio = -1"},
                                    {"poisson_ratio = 0.3", "poisson_ratio = -1.5"},
                                    {"youngs_modulus = 1e5", "youngs_modulus = 0"},
                                    {"youngs_modulus = 1e5", "youngs_modulus = -1e5"},
                                    {"density = 1000", "density = 0"},
                                    {"density = 1000", "density = -1000"},
                                    {"fps = 24", "fps = 0"},
                                    {"fps = 24", "fps = -24"},
                                    {"substeps = 1", "substeps = 0"},
                                    {"voxel_size = 0.1", "voxel_size = 0"},
                                    {"voxel_size = 0.1", "voxel_size = -0.1"}};
    constexpr double kAll = std::size(kBad);
    return {atLeast("scenes of 13 refused, naming line, key and range", refused(kBad), kAll)};
}

Measurements notFinite(Extent)
{
    constexpr Replacement kBad[] = {{"poisson_ratio = 0.3", "poisson_ratio = nan"},
                                    {"youngs_modulus = 1e5", "youngs_modulus = inf"},
                                    {"youngs_modulus = 1e5", "youngs_modulus = nan"},
                                    {"density = 1000", "density = inf"},
                                    {"fps = 24", "fps = nan"},
                                    {"fps = 24", "fps = inf"},
                                    {"voxel_size = 0.1", "voxel_size = nan"},
                                    {"voxel_size = 0.1", "voxel_size = inf"},
                                    {"velocity = [0, 0, 0]", "velocity = [0, nan, 0]"},
                                    {"velocity = [0, 0, 0]", "velocity = [-inf, 0, 0]"}};
    constexpr double kScenes = std::size(kBad);
    const ScratchFolder folder;
    double surfaces = 0;
    for (const std::string bad : {"nan", "inf", "-inf", "1e999"}) {
        surfaces += surfaceIsRefused(folder, "case.obj", "v 0 0 0\nv 1 0 0\nv 0 " + bad + " 0\nf 1 2 3\n");
        surfaces += surfaceIsRefused(folder, "case.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 " + bad + " 0\n3 0 1 2\n");
        surfaces += surfaceIsRefused(
            folder, "case.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
            "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 " +
                bad + " 0\n3 0 1 2\n");
        surfaces +=
            surfaceIsRefused(folder, "case.stl",
                             "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 " + bad +
                                 " 0\n"
                                 "endloop\nendfacet\nendsolid s\n");
    }
    return {atLeast("scenes of 10 refused, naming line, key and range", refused(kBad), kScenes),
            atLeast("surfaces of 16 refused, naming the file", surfaces, 16)};
}

Measurements foam(Extent)
{
    constexpr double kMass = 1e-12;
    Measurements all;
    for (double nu : kPoissonRatios)
        for (const char* kappa : {"1", "1e-9"}) {
            SceneRun run(blockWith(nu) + kGrips + "[fracture]\nkappa = " + kappa + "\n");
            run.toEnd();
            const core::Simulation& simulation = run.simulation;
            double grown = 0, before = simulation.startVolume();
            for (const core::StepRecord& s : run.steps) grown += s.volume > before * (1 + kMass), before = s.volume;
            const std::string name = at(nu) + "kappa = " + kappa + ": ";
            all.push_back(atMost(name + "steps in which material grows", grown, 0));
            all.push_back(atLeast(name + "voxels at which material went",
                                  double(run.work.countOf("fracture", "moved_voxels")), 1));
            all.push_back(atMost(name + "material of no fragment, of that at the start",
                                 std::abs(fragmentVolume(simulation) - simulation.volume()) / simulation.startVolume(),
                                 kMass));
            all.push_back(atMost(name + "numbers that are not finite", notFiniteNodes(simulation), 0));
        }
    return all;
}

Measurements unbreakable(Extent)
{
    Measurements all;
    for (double nu : kPoissonRatios) {
        const auto hash = [nu](const std::string& effects) {
            SceneRun run(blockWith(nu) + kGrips + effects);
            run.toEnd();
            return run.simulation.stateHash();
        };
        const std::uint64_t without = hash("");
        const double differing = double(hash("[fracture]\nkappa = 1e300\n") != without) +
                                 double(hash("[fracture]\ntoughness = 1e300\n") != without);
        all.push_back(atMost(at(nu) + "state hashes of 2 that differ from that without fracture", differing, 0));
    }
    return all;
}

/// A free block of soft gel that flies and spins at 1000 times the speed of its waves, sqrt(E / rho) = 10 m/s.
Measurements thousandfoldSpeed(Extent)
{
    constexpr double kMomentum = 1e-8;
    constexpr int kSteps = 40;  // some ten turns
    Measurements all;
    for (double nu : kPoissonRatios) {
        std::string text = changed(blockWith(nu), {"velocity = [0, 0, 0]", "velocity = [1e4, 0, 0]"});
        text = changed(text, {"angular_velocity = [0, 0, 0]", "angular_velocity = [0, 0, 3e4]"});
        SceneRun run(text);
        const core::Simulation& simulation = run.simulation;
        const auto momentum = [&] { return lab::momentum(simulation.elastic(), simulation.v()); };
        const Momentum start = momentum();
        int cutBack = 0, capped = 0;
        for (int n = 0; n < kSteps; ++n) {
            const core::StepRecord record = run.simulation.step(1);
            cutBack += record.cutbacks > 0;
            capped += record.outcome == core::Outcome::capped;
        }
        all.push_back(atLeast(at(nu) + "steps of 40 for which dt was cut back", cutBack, 1));
        all.push_back(atMost(at(nu) + "steps of 40 that are capped", capped, 0));
        all.push_back(atMost(at(nu) + "nodes that are not finite", notFiniteNodes(simulation), 0));
        all.push_back(atMost(at(nu) + "drift of momentum, relative",
                             (momentum().linear - start.linear).norm() / start.scale, kMomentum));
    }
    return all;
}

}  // namespace vdbfrac::lab::verify
