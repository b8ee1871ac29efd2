#include <vdbfrac/tetmesh/tet_quality.h>

#include <vdbfrac/base/parallel.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace vdbfrac::tetmesh {

namespace {

constexpr double kDegrees = 180 / std::numbers::pi, kBinWidth = 180. / double(kDihedralBins);

/// 3 r / R of a tet of volume V with edges a, b, c from one corner and faces of area A: r = 3 V / A,
/// R = |a^2 (b x c) + b^2 (c x a) + c^2 (a x b)| / (12 V).
double radiusRatio(const Vec3& a, const Vec3& b, const Vec3& c, double volume, double area)
{
    const Vec3 toCenter = a.squaredNorm() * b.cross(c) + b.squaredNorm() * c.cross(a) + c.squaredNorm() * a.cross(b);
    const double product = toCenter.norm() * area;
    return volume > 0 && product > 0 ? 108 * volume * volume / product : 0;
}

void addTet(TetQuality& q, const TetMesh& mesh, std::size_t t)
{
    std::array<Vec3, 4> p, normal;
    for (std::size_t a = 0; a < 4; ++a) p[a] = mesh.points[mesh.tets[t][a]];
    double area = 0;
    for (std::size_t f = 0; f < 4; ++f) {
        const auto& corner = kTetFaces[f];
        normal[f] = (p[corner[1]] - p[corner[0]]).cross(p[corner[2]] - p[corner[0]]);
        area += 0.5 * normal[f].norm();
    }
    for (std::size_t f = 0; f < 4; ++f)
        for (std::size_t g = f + 1; g < 4; ++g) {
            const double angle = kDegrees * std::atan2(normal[f].cross(normal[g]).norm(), -normal[f].dot(normal[g]));
            q.smallestDihedral = std::min(q.smallestDihedral, angle);
            q.largestDihedral = std::max(q.largestDihedral, angle);
            ++q.dihedrals[std::min(kDihedralBins - 1, std::size_t(angle / kBinWidth))];
        }
    const double volume = tetVolume(mesh, t), ratio = radiusRatio(p[1] - p[0], p[2] - p[0], p[3] - p[0], volume, area);
    q.inverted += !(volume > 0);
    q.volume += volume;
    q.smallestVolume = std::min(q.smallestVolume, volume);
    q.smallestRadiusRatio = std::min(q.smallestRadiusRatio, ratio);
    q.meanRadiusRatio += ratio / double(mesh.tets.size());
}

void add(TetQuality& sum, const TetQuality& part)
{
    sum.inverted += part.inverted;
    sum.volume += part.volume;
    sum.smallestVolume = std::min(sum.smallestVolume, part.smallestVolume);
    sum.smallestDihedral = std::min(sum.smallestDihedral, part.smallestDihedral);
    sum.largestDihedral = std::max(sum.largestDihedral, part.largestDihedral);
    for (std::size_t b = 0; b < kDihedralBins; ++b) sum.dihedrals[b] += part.dihedrals[b];
    sum.smallestRadiusRatio = std::min(sum.smallestRadiusRatio, part.smallestRadiusRatio);
    sum.meanRadiusRatio += part.meanRadiusRatio;
}

}  // namespace

TetQuality qualityOf(const TetMesh& mesh)
{
    const std::size_t tets = mesh.tets.size();
    TetQuality none;
    none.smallestVolume = tets > 0 ? std::numeric_limits<double>::infinity() : 0;
    std::vector<TetQuality> parts((tets + kChunk - 1) / kChunk, none);
    parallelChunks(tets, kChunk, [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) addTet(parts[begin / kChunk], mesh, t);
    });
    TetQuality sum = none;
    for (const TetQuality& part : parts) add(sum, part);
    return sum;
}

}  // namespace vdbfrac::tetmesh
