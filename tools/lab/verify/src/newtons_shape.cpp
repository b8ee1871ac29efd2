// Solids at rest: how much material there is, and whether slits of meshes are open.
#include "newtons.h"

#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/lab/machine/scratch.h>
#include <vdbfrac/lab/samples/slit_block.h>
#include <vdbfrac/lab/scenes/rod.h>

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>

namespace vdbfrac::lab::verify {

namespace {

struct Solid {
    const char* name;
    const char* shape;  // key; its center is put in
    double volume;      // m^3
};
constexpr Solid kSolids[] = {{"cube", "box = { size = [1, 1, 1]", 1},
                             {"plate, half as thick", "box = { size = [2, 2, 0.5]", 2},
                             {"sphere", "sphere = { radius = 0.5", std::numbers::pi / 6},
                             {"cylinder", "cylinder = { axis = \"y\", radius = 0.5, height = 1", std::numbers::pi / 4}};

/// Of a solid 1 m wide, its center `shift` cells off a voxel; relative.
double volumeError(const Solid& solid, int cells, const Vec3& shift)
{
    Specimen s;
    s.h = 1. / cells;
    s.shape = format("shape = { %s, center = %s } }\n", solid.shape, list(s.h * shift));
    return SceneRun(s.text()).simulation.startVolume() / solid.volume - 1;
}

/// Voxels of the wrong sign; 0 too where the mesh is refused.
double wrongSigns(const SlitBlock& block, double dx)
{
    constexpr double kRounding = 1e-5;  // of a voxel
    const ScratchFolder folder;
    writeText(folder.path() / "slit.obj", objText(block.mesh()));
    Specimen s;
    s.h = dx;
    s.shape = "shape = { mesh = \"" + (folder.path() / "slit.obj").string() + "\" }\n";
    std::map<Coord, double> inside;
    try {
        inside = materialPhi(SceneRun(s.text()).simulation.bodies()[0]);
    } catch (const InputError&) {
        return 0;
    }
    const int reach = int(std::ceil(.5 * block.size.norm() / dx)) + 2;
    double wrong = 0;
    for (int z = -reach; z <= reach; ++z)
        for (int y = -reach; y <= reach; ++y)
            for (int x = -reach; x <= reach; ++x) {
                const double exact = block.phi(dx * Vec3(x, y, z)) / dx;
                wrong += std::abs(exact) > kRounding && inside.contains(Coord{x, y, z}) != (exact < 0);
            }
    return wrong;
}

}  // namespace

Measurements restVolume(Extent extent)
{
    constexpr double kLimit = .5;  // %
    Measurements all;
    for (int cells : {8, 16}) {
        if (cells > 8 && extent == Extent::quick) break;
        for (const Solid& solid : kSolids)
            for (const auto& [shift, place] : {std::pair{Vec3(0, 0, 0), "on"}, {Vec3(.3, .2, .45), "off"}})
                all.push_back(
                    within(format("%s %s voxel planes, %d cells: error of the volume, %%", solid.name, place, cells),
                           100 * volumeError(solid, cells, shift), 0, kLimit));
    }
    return all;
}

Measurements slits(Extent extent)
{
    constexpr double kDx = .05;  // m
    const std::pair<double, Vec3> turns[] = {{0, Vec3::UnitZ()},
                                             {.3, Vec3::UnitZ()},
                                             {.7854, Vec3::UnitZ()},
                                             {.9553, Vec3(1, -1, 0)},
                                             {1.1, Vec3(.3, .5, .8)}};
    Measurements all;
    for (double width : {1., 1.5, 2., 3., 4.}) {
        if (width > 1.5 && extent == Extent::quick) break;
        double wrong = 0;
        for (const auto& [angle, axis] : turns) {
            SlitBlock block;
            block.width = width * kDx;
            block.turn = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
            wrong += wrongSigns(block, kDx);
        }
        all.push_back(atMost(format("voxels of the wrong sign, slit of %g voxels, five turns", width), wrong, 0));
    }
    return all;
}

}  // namespace vdbfrac::lab::verify
