#include <vdbfrac/grid/render.h>

#include "surface_solid.h"

#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>

#include <openvdb/openvdb.h>
#include <openvdb/tools/RayIntersector.h>
#include <openvdb/tools/RayTracer.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <memory>

namespace vdbfrac::grid {

namespace {

using Rgb = Eigen::Array3f;
using openvdb::Vec3d;

constexpr double kFocal = 50, kAperture = 41.2136;  // mm, Houdini's default camera
const Rgb kNeutral(0.72f, 0.71f, 0.68f), kTorn(0.80f, 0.10f, 0.07f);
const Rgb kSkyTop(0.93f, 0.94f, 0.95f), kSkyBottom(0.76f, 0.78f, 0.80f);
const Rgb kKeyLight(0.78f, 0.77f, 0.74f), kFillLight(0.16f, 0.18f, 0.22f), kAmbient(0.20f, 0.20f, 0.20f);

Vec3d vdbPoint(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

struct Lights {
    Vec3d key, fill;  // towards the light
};

/// Key light from the upper left behind the camera, a weak fill from the lower right.
Lights lights(const View& view)
{
    const Vec3 ahead = view.direction.normalized();
    Vec3 right = ahead.cross(Vec3::UnitY());
    right = right.norm() > 1e-6 ? Vec3(right.normalized()) : Vec3(Vec3::UnitX());
    const Vec3 up = right.cross(ahead);
    return {vdbPoint((-right + 1.3 * up - 1.1 * ahead).normalized()),
            vdbPoint((right - 0.4 * up - 0.5 * ahead).normalized())};
}

/// Colours of the pixels of some rows. Each thread has its own: accessors are not shared.
class Tracer {
public:
    Tracer(const tetmesh::Surface& surface, const SurfaceSolid* solid, const View& view,
           const openvdb::tools::PerspectiveCamera& camera)
        : surface_(surface), view_(view), camera_(camera), lights_(lights(view))
    {
        if (!solid) return;
        ray_ = std::make_unique<Intersector>(*solid->phi);
        closest_ = std::make_unique<openvdb::Int32Grid::ConstAccessor>(solid->closest->getConstAccessor());
        voxelSize_ = solid->phi->voxelSize()[0];
    }

    Rgb pixel(int i, int j) const
    {
        // A fixed lattice of points in the pixel: the same picture for any number of threads.
        Rgb sum = Rgb::Zero();
        const int samples = std::max(1, view_.samples);
        for (int s = 0; s < samples; ++s) {
            const double a = (s + 0.5) / samples, b = std::fmod(0.5 + s * 0.6180339887498949, 1.);
            Vec3d hit, normal;
            if (ray_ && ray_->intersectsWS(camera_.getRay(std::size_t(i), std::size_t(j), a, b), hit, normal))
                sum += shade(hit, normal);
            else
                sum += background(j + b);
        }
        return sum / float(samples);
    }

private:
    using Intersector = openvdb::tools::LevelSetRayIntersector<openvdb::FloatGrid>;

    Rgb background(double row) const
    {
        const float t = float(row / view_.height);
        return (1 - t) * kSkyTop + t * kSkyBottom;
    }
    Rgb shade(const Vec3d& hit, const Vec3d& normal) const
    {
        const float key = float(std::max(0., normal.dot(lights_.key)));
        const float fill = float(std::max(0., normal.dot(lights_.fill)));
        return (isTorn(hit) ? kTorn : kNeutral) * (kAmbient + key * kKeyLight + fill * kFillLight);
    }
    bool isTorn(const Vec3d& hit) const
    {
        const openvdb::Coord ijk = openvdb::Coord::round(hit / voxelSize_);
        const std::size_t n = std::size_t(std::uint32_t(closest_->getValue(ijk)));
        return n < surface_.torn.size() && surface_.torn[n] != 0;
    }

    const tetmesh::Surface& surface_;
    const View& view_;
    const openvdb::tools::PerspectiveCamera& camera_;
    Lights lights_;
    std::unique_ptr<Intersector> ray_;
    std::unique_ptr<openvdb::Int32Grid::ConstAccessor> closest_;
    double voxelSize_ = 1;
};

/// Far enough that the ball of radius `extent` round the target fits into the narrower side of the picture.
openvdb::tools::PerspectiveCamera makeCamera(openvdb::tools::Film& film, const View& view)
{
    const double narrow = std::min(1., double(view.height) / view.width);
    const double halfAngle = std::atan(0.5 * kAperture / kFocal * narrow);
    const double distance = view.extent / std::sin(halfAngle);
    const Vec3 eye = view.target - distance * view.direction.normalized();
    openvdb::tools::PerspectiveCamera camera(film, Vec3d(0.), vdbPoint(eye), kFocal, kAperture, 1e-3 * distance,
                                             10 * distance);
    const bool upright = view.direction.cross(Vec3::UnitY()).norm() < 1e-6 * view.direction.norm();
    camera.lookAt(vdbPoint(view.target), upright ? Vec3d(0, 0, -1) : Vec3d(0, 1, 0));
    return camera;
}

/// The ray tracer refuses level sets without a band.
bool isVisible(const SurfaceSolid& solid) { return solid.phi->activeVoxelCount() > 0; }

}  // namespace

Image render(const tetmesh::Surface& surface, const View& view, double voxelSize)
{
    if (view.width < 1 || view.height < 1 || !(view.extent > 0) || !(view.direction.norm() > 0))
        throw Error("a picture needs a size, an extent and a direction");
    const SurfaceSolid solid = makeSurfaceSolid(surface, voxelSize);
    openvdb::tools::Film film(std::size_t(view.width), std::size_t(view.height));
    const openvdb::tools::PerspectiveCamera camera = makeCamera(film, view);
    Image image{view.width, view.height, std::vector<std::uint8_t>(3 * film.numPixels())};
    parallelChunks(std::size_t(view.height), 4, [&](std::size_t begin, std::size_t end) {
        const Tracer tracer(surface, isVisible(solid) ? &solid : nullptr, view, camera);
        for (std::size_t j = begin; j < end; ++j)
            for (int i = 0; i < view.width; ++i) {
                const Rgb color = tracer.pixel(i, int(j)).min(1.f).max(0.f) * 255.f + 0.5f;
                std::uint8_t* rgb = &image.rgb[3 * (j * std::size_t(view.width) + std::size_t(i))];
                for (int c = 0; c < 3; ++c) rgb[c] = std::uint8_t(color[c]);
            }
    });
    return image;
}

}  // namespace vdbfrac::grid
