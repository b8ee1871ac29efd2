#include <vdbfrac/base/rotation.h>

#include <Eigen/Geometry>

#include <numbers>

namespace vdbfrac {

Mat3 rotationOf(const Vec3& angles)
{
    const Vec3 a = angles * (std::numbers::pi / 180);
    return (Eigen::AngleAxisd(a.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(a.y(), Vec3::UnitY()) *
            Eigen::AngleAxisd(a.x(), Vec3::UnitX()))
        .toRotationMatrix();
}

}  // namespace vdbfrac
