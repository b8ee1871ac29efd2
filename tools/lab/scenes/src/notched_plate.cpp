#include <vdbfrac/lab/scenes/notched_plate.h>

#include <vdbfrac/lab/scenes/scene_run.h>

#include <sstream>
#include <utility>

namespace vdbfrac::lab {

std::string notchedPlate(int cells, const std::string& law)
{
    const double dx = 1. / cells, shift = -0.5 * dx;
    std::ostringstream s;
    s << "version = 1\nname = \"plate\"\n[time]\nframes = [1, 400]\nfps = 100\n[grid]\nvoxel_size = " << dx
      << "\n[[body]]\nname = \"plate\"\nshape = { box = { size = [1, 1, 0.4], center = [" << shift
      << ", 0, 0] } }\ncut = [{ box = { size = [1, " << 0.6 * dx << ", 1], center = [" << -0.7 + shift
      << ", 0, 0] } }]\nmaterial = \"m\"\n[material.m]\nyoungs_modulus = 1e6\npoisson_ratio = 0.0\ndensity = 1000\n";
    for (const auto& [normal, speed] : {std::pair{"1", "0.04"}, std::pair{"-1", "-0.04"}})
        s << "[[grip]]\nbody = \"plate\"\nregion = { halfspace = { normal = [0, " << normal
          << ", 0], offset = 0.5 } }\n"
          << "move = { velocity = [0, " << speed << ", 0] }\n";
    return s.str() + "[damping]\nstiffness = 0.002\n[fracture]\n" + law + "\n";
}

double notchedPlatePeak(int cells, const std::string& law)
{
    SceneRun run(notchedPlate(cells, law));
    for (int frame = 2; frame <= 400; ++frame) {
        run.toFrame(frame);
        const double peak = run.peakLoad(0, 1);
        if (run.work.countOf("fracture", "moved_voxels") > 0 && run.steps.back().gripLoad[0].y() < 0.97 * peak)
            return peak;
    }
    return 0;
}

}  // namespace vdbfrac::lab
