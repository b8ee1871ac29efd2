#include <vdbfrac/grid/tension.h>

#include "front_values.h"
#include "nodal_stresses.h"
#include "passing.h"

#include <vdbfrac/base/infinity.h>
#include <vdbfrac/tetmesh/nodes_around.h>
#include <vdbfrac/tetmesh/nodes_where.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace vdbfrac::grid {

namespace {

using tetmesh::BodyMesh;
using tetmesh::NodeField;

/// Voxels from a node to those that are at the same tip as it.
constexpr int kNear = 3;
/// Radius of R over that of H.
constexpr double kNarrow = 2. / 3;
/// What H may be off its largest near by, for the front to move at all.
constexpr double kAside = .2;
/// Least and largest Psi of a G [R].
constexpr double kSmooth = 2. / 3, kSqueezed = 2.5;
/// Radius of G's ball over that of H.
constexpr double kRelease = 4. / 3;

/// C <s>^2 across d.
double across(const Mat3& S, const Vec3& d, double nu)
{
    const Vec3 Sd = S * d;
    const double along = d.dot(Sd), mean = .5 * (S.trace() - along);
    // The part of S in the plane has this sum of squares.
    const double squares = S.squaredNorm() - 2 * Sd.squaredNorm() + along * along;
    const double radius = std::sqrt(std::max(0., .5 * squares - mean * mean));
    const double s = mean + radius, t = mean - radius;
    if (s <= 0) return 0;
    const double inPlane = along + s;
    return s * s * (inPlane > 0 ? 1 - nu * std::clamp(t / inPlane, std::min(0., nu), std::max(0., nu)) : 1);
}

/// 2 E R [Pa^2].
double tensionAt(const NodalStresses& nodes, const std::vector<Neighbour>& neighbours, Coord voxel)
{
    double volume = nodes(voxel).volume, sum = volume * nodes(voxel).tension;
    for (const Neighbour& n : neighbours) {
        const NodalStress& node = nodes(voxel + n.offset);
        volume += n.weight * node.volume;
        sum += n.weight * node.volume * node.tension;
    }
    return volume > 0 ? sum / volume : 0;
}

struct Opening {
    double H = 0;                // Pa^2
    Vec3 across = Vec3::Zero();  // unit: way of the largest principal mean stress
};

Opening openingAt(const NodalStresses& nodes, const std::vector<Neighbour>& neighbours, Coord voxel, double nu)
{
    double volume = 0, sum = 0;
    Mat3 S = nodes(voxel).volume * nodes(voxel).S;
    for (const Neighbour& n : neighbours) {
        const NodalStress& node = nodes(voxel + n.offset);
        if (node.volume == 0) continue;
        volume += n.weight * node.volume;
        S += n.weight * node.volume * node.S;
        sum += n.weight * node.volume * across(node.S, n.direction, nu);
    }
    return {volume > 0 ? sum / volume : 0, Eigen::SelfAdjointEigenSolver<Mat3>(S).eigenvectors().col(2)};
}

/// function(voxel) of all, side by side.
template <class Function>
auto ofEach(const std::vector<Coord>& voxels, const Function& function)
{
    std::vector<decltype(function(voxels[0]))> values(voxels.size());
    parallelChunks(voxels.size(), 4, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) values[i] = function(voxels[i]);
    });
    return values;
}

/// Voxel nodes at the front, and in the gap beside it: material round those counts for how much, as a tip may lie just
/// before it.
std::vector<Coord> bandOf(const Loaded& body)
{
    const NodeField<float>& phi = body.mesh.phi();
    std::vector<Coord> band = nodesWhere(phi, [&](Coord c) { return phi(c) < 0 && body.isFront(c); });
    NodeField<bool> isFront(phi.lower(), phi.upper(), false, false);
    isFront.cover(band);
    for (const Coord& c : band) isFront.set(c, true);
    std::vector<Neighbour> beside = neighboursWithin(2);  // the weightiest are the likeliest
    std::sort(beside.begin(), beside.end(), [](const Neighbour& a, const Neighbour& b) { return a.weight > b.weight; });
    const std::vector<Coord> gap = nodesWhere(phi, [&](Coord c) {
        return phi(c) >= 0 && phi(c) < body.mesh.voxelSize() &&
               std::any_of(beside.begin(), beside.end(), [&](const Neighbour& n) { return isFront(c + n.offset); });
    });
    band.insert(band.end(), gap.begin(), gap.end());
    return band;
}

/// Most that Psi may be [R] where energy is `fall` times the least near by: a smooth face is no tip. Of some thousand
/// places at tips, at faces and beside grips Psi was a third less than this, and more only where this is kSqueezed.
double mostPsi(double fall) { return std::clamp(2 * fall - 1.5, kSmooth, kSqueezed); }

/// f.
double factorAt(const TensionAverage& average, Coord voxel) { return average.factor ? average.factor(voxel) : 1; }

/// Voxel nodes of the band whose Psi / f may exceed `look`.
std::vector<Coord> whereItMayExceed(double look, const Loaded& body, const TensionAverage& average)
{
    constexpr double kRounding = 1e-9;
    const double enough = (1 - kRounding) * minEnergyUnder(look, average.poissonRatio);
    const double most = average.perRelease > 0 ? kSqueezed : 1;
    const double least = average.leastFactor * enough;
    if (std::none_of(body.energy.begin(), body.energy.end(), [&](double psi) { return most * psi >= least; }))
        return {};
    std::vector<Coord> voxels = bandOf(body);
    // Energy is convex in stress: its average is no less than that of an average of stresses.
    const auto energy = [&](std::uint32_t e, int t) { return body.energy[tetmesh::tetEntry(e, std::size_t(t))]; };
    const Sparse psi(body.mesh, voxels,
                     averagedEnergy(body.mesh, energy, voxels, kNarrow * average.radius, average.isCounted), kInfinity);
    // Tets of any shape have energies too rough to tell.
    const bool isTold = average.perRelease > 0 && !body.mesh.latticeCoords().empty();
    std::vector<Neighbour> far = neighboursWithin(kNear + .5);
    std::erase_if(far, [](const Neighbour& n) { return n.offset.toVec().norm() < kNear - .5; });
    keepIf(voxels, [&](const Coord& c) {
        const double own = psi(c), enoughHere = factorAt(average, c) * enough;
        if (!isTold || own == 0 || most * own < enoughHere) return most * own >= enoughHere;
        double least = own;
        for (const Neighbour& n : far) least = std::min(least, psi(c + n.offset));
        return mostPsi(own / least) * own >= enoughHere;
    });
    return voxels;
}

/// Those of the front that are at the same tip as some voxels; sorted.
std::vector<Coord> frontNear(const Loaded& body, const std::vector<Coord>& voxels)
{
    std::vector<Coord> near = tetmesh::nodesAround(voxels, kNear);
    keepIf(near, body.isFront);
    return near;
}

void keepAbove(double least, std::vector<Coord>& voxels, std::vector<double>& values)
{
    std::size_t count = 0;
    for (std::size_t i = 0; i < voxels.size(); ++i)
        if (values[i] > least) voxels[count] = voxels[i], values[count++] = values[i];
    voxels.resize(count), values.resize(count);
}

/// R / f of voxel nodes, from stresses round them that are computed where they are not known. `radius`: of the average
/// [voxels].
std::vector<double> tensions(NodalStresses& nodes, const std::vector<Coord>& voxels, double radius,
                             const TensionAverage& average)
{
    nodes.computeAround(voxels, reachWithin(kNarrow * radius));
    return ofEach(voxels, [&, neighbours = neighboursWithin(kNarrow * radius)](Coord c) {
        return tensionAt(nodes, neighbours, c) / (2 * average.youngsModulus * factorAt(average, c));
    });
}

/// R / f of the material, 0 in the gap.
Sparse ofMaterial(const BodyMesh& mesh, const std::vector<Coord>& voxels, std::vector<double> R)
{
    for (std::size_t i = 0; i < voxels.size(); ++i)
        if (mesh.phi()(voxels[i]) >= 0) R[i] = 0;
    return {mesh, voxels, R};
}

/// Psi / f of voxel nodes, and the fronts of the tips whose G it comes from.
struct Driving {
    std::vector<double> psi;
    std::vector<Coord> tips;
    std::vector<Vec3> along;
};

/// Where G is worth knowing: where R / f is near the largest round it, and enough for a Psi / f of kappa. Where none
/// is, a few of the largest say how far the load is.
std::vector<Coord> tipsAmong(const Sparse& R, const std::vector<Coord>& voxels, double kappa)
{
    constexpr double kTip = .85;
    constexpr std::size_t kFew = 64;
    double largest = 0;
    for (const Coord& c : voxels) largest = std::max(largest, R(c));
    const bool isEnough = kSqueezed * largest > kappa;
    std::vector<Coord> tips = voxels;
    keepIf(tips, [&, near = neighboursWithin(kNear + .5)](const Coord& c) {
        return R(c) > 0 && (!isEnough || kSqueezed * R(c) > kappa) && R(c) >= kTip * R.largestNear(c, near);
    });
    if (!isEnough && tips.size() > kFew) {
        std::sort(tips.begin(), tips.end(),
                  [&](const Coord& a, const Coord& b) { return R(a) > R(b) || (R(a) == R(b) && a < b); });
        tips.resize(kFew);
    }
    return tips;
}

/// Psi / f of voxel nodes with these R / f; that of G at the tips.
Driving drivenBy(std::vector<Coord> tips, const Loaded& body, const TensionAverage& average,
                 const std::vector<Coord>& voxels, const std::vector<double>& R)
{
    Driving driving;
    std::vector<double> G;  // / f
    for (const Release& release :
         energyRelease(body.mesh, body.forces, tips, kRelease * average.radius, average.isCounted)) {
        G.push_back(release.G / factorAt(average, tips[G.size()]));
        driving.along.push_back(release.along);
    }
    const Sparse ofTips(body.mesh, tips, G);
    for (std::size_t i = 0; i < R.size(); ++i)
        driving.psi.push_back(std::clamp(average.perRelease * ofTips(voxels[i]), kSmooth * R[i], kSqueezed * R[i]));
    driving.tips = std::move(tips);
    return driving;
}

/// Leaves only voxel nodes with the gap beside them across the front of the tips near by: in a thin sheet all touch a
/// face, which the front only ends in.
void keepAcross(const BodyMesh& mesh, const Driving& driving, std::vector<Coord>& voxels)
{
    constexpr double kAcross = .5;  // cosine
    if (driving.tips.empty()) return;
    NodeField<std::int32_t> tipAt(mesh.phi().lower(), mesh.phi().upper(), -1, -1);
    for (std::size_t i = 0; i < driving.tips.size(); ++i) tipAt.set(driving.tips[i], std::int32_t(i));
    const auto alongAt = [&](const Coord& c) {  // of the last of several
        std::int32_t tip = -1;
        for (int z = -kNear; z <= kNear; ++z)
            for (int y = -kNear; y <= kNear; ++y)
                for (int x = -kNear; x <= kNear; ++x) tip = std::max(tip, tipAt(c + Coord{x, y, z}));
        return tip < 0 ? Vec3(Vec3::Zero()) : driving.along[std::size_t(tip)];
    };
    keepIf(voxels, [&, beside = neighboursWithin(2)](const Coord& c) {
        const Vec3 front = alongAt(c);
        return std::any_of(beside.begin(), beside.end(), [&](const Neighbour& n) {
            return mesh.phi()(c + n.offset) >= 0 && std::abs(n.direction.dot(front)) < kAcross;
        });
    });
}

/// Without an average: of the mean stress at each voxel node.
TensionAbove nodalTensionAbove(double kappa, const Loaded& body, const TensionAverage& average)
{
    TensionAbove above;
    above.voxels =
        body.mesh.voxelsAbove(body.energy, minEnergyUnder(average.leastFactor * kappa, average.poissonRatio));
    std::erase_if(above.voxels, [&](const Coord& c) { return !body.isFront(c); });
    if (above.voxels.empty()) return above;
    NodalStresses nodes(body.mesh, body.stress, average.isCounted);
    nodes.computeAround(above.voxels, 0);
    above.stresses = nodes.count();
    for (const Coord& c : above.voxels)
        above.psi.push_back(nodes(c).tension / (2 * average.youngsModulus * factorAt(average, c)));
    keepAbove(kappa, above.voxels, above.psi);
    above.share.assign(above.voxels.size(), 1);
    for (const Coord& c : above.voxels) above.points.push_back(c.toVec());
    return above;
}

/// Voxel nodes at the front, and in the gap beside it, with Psi / f; where it is that of G, R / f of the material too.
struct Candidates {
    std::vector<Coord> voxels;
    Driving driving;
    std::optional<Sparse> R;
};

/// All whose Psi / f may be above `look`.
Candidates findCandidates(double look, double kappa, const Loaded& body, const TensionAverage& average,
                          NodalStresses& nodes)
{
    const double least = average.perRelease > 0 ? look / kSqueezed : look;
    Candidates found;
    found.voxels = whereItMayExceed(look, body, average);
    std::vector<double> R = tensions(nodes, found.voxels, average.radius / body.mesh.voxelSize(), average);
    if (average.perRelease == 0) {
        found.driving.psi = std::move(R);
        return found;
    }
    keepAbove(least, found.voxels, R);
    found.R = ofMaterial(body.mesh, found.voxels, R);
    found.driving = drivenBy(tipsAmong(*found.R, found.voxels, kappa), body, average, found.voxels, R);
    return found;
}

/// The share of the speed at voxel nodes near which Psi exceeds kappa, else 0. `H`, and `R` where ligaments are found
/// by it: of all they are compared with.
std::vector<double> shareOfEach(const std::vector<Coord>& voxels, const Sparse& psi, const Sparse& H, const Sparse& R,
                                double kappa)
{
    constexpr double kLigament = 1.5, kMiddle = .9;
    return ofEach(voxels, [&, near = neighboursWithin(kNear + .5)](Coord c) {
        if (psi.largestNear(c, near) <= kappa) return 0.;
        if (R(c) > kLigament * kappa && R(c) >= kMiddle * R.largestNear(c, near)) return 1.;
        return H(c) > 0 ? 1 - (1 - H(c) / H.largestNear(c, near)) / kAside : 0;
    });
}

/// Which voxel nodes of the front move, and where the crack passes them.
void chooseAmong(const std::vector<Coord>& compared, const Candidates& found, const Sparse& psi, double kappa,
                 const Loaded& body, const TensionAverage& average, const NodalStresses& nodes, TensionAbove& above)
{
    const double radius = average.radius / body.mesh.voxelSize();
    // Cracks that part tets of any shape have to be wider than one way.
    const bool isOneWay = body.path && !body.mesh.latticeCoords().empty();
    struct Passed {
        double H, R;
        Vec3 point;
    };
    const auto passed = ofEach(
        compared, [&, neighbours = neighboursWithin(radius), near = neighboursWithin(kRelease * radius)](Coord c) {
            const Opening opening = openingAt(nodes, neighbours, c, average.poissonRatio);
            const Passing passing = isOneWay ? passingAt(c, opening.across, *body.path, found.R ? *found.R : psi, near)
                                             : Passing{c.toVec()};
            return Passed{opening.H * passing.weight / factorAt(average, c),
                          found.R ? passing.weight * (*found.R)(c) : 0, passing.point};
        });
    std::vector<double> H, R;
    for (const Passed& p : passed) H.push_back(p.H), R.push_back(p.R);
    above.share = shareOfEach(above.voxels, psi, {body.mesh, compared, H}, {body.mesh, compared, R}, kappa);
    keepAbove(0, above.voxels, above.share);
    for (const Coord& c : above.voxels) {
        const auto at = std::lower_bound(compared.begin(), compared.end(), c);  // sorted
        above.points.push_back(passed[std::size_t(at - compared.begin())].point);
    }
}

}  // namespace

TensionAbove tensionAbove(double kappa, const Loaded& body, const TensionAverage& average, double expected)
{
    const double radius = average.radius / body.mesh.voxelSize();
    if (radius <= 1) return nodalTensionAbove(kappa, body, average);  // no other voxel node is within it
    TensionAbove above;
    NodalStresses nodes(body.mesh, body.stress, average.isCounted);
    Candidates found;
    // Down to where the largest is, but not so far that bodies with little load are looked at as a whole.
    constexpr double kSteady = .8, kLower = .3, kFar = .1;
    double look = expected > 0 ? std::min(kappa, kSteady * expected) : kappa;
    for (;; look *= kLower) {
        found = findCandidates(look, kappa, body, average, nodes);
        for (std::size_t i = 0; i < found.voxels.size(); ++i)
            if (found.driving.psi[i] > above.largest)
                above.largest = found.driving.psi[i], above.where = found.voxels[i];
        if (above.largest >= look || kLower * look <= kFar * kappa) break;
    }
    keepAbove(kappa, found.voxels, found.driving.psi);
    above.stresses = nodes.count();
    if (found.voxels.empty()) return above;

    above.voxels = frontNear(body, found.voxels);
    std::vector<Coord> compared = frontNear(body, above.voxels);
    for (std::vector<Coord>* front : {&above.voxels, &compared}) keepAcross(body.mesh, found.driving, *front);
    nodes.computeAround(compared, reachWithin(radius));
    above.stresses = nodes.count();
    const Sparse largest(body.mesh, found.voxels, found.driving.psi);
    chooseAmong(compared, found, largest, kappa, body, average, nodes, above);
    above.psi = ofEach(above.voxels,
                       [&, near = neighboursWithin(kNear + .5)](Coord c) { return largest.largestNear(c, near); });
    return above;
}

VoxelValues tensionAtFront(const Loaded& body, const TensionAverage& average, double little)
{
    VoxelValues values;
    const double radius = average.radius / body.mesh.voxelSize();
    if (radius <= 1) {
        const TensionAbove above = nodalTensionAbove(little, body, average);
        values.coords = above.voxels, values.scalars.assign(above.psi.begin(), above.psi.end());
        return values;
    }
    values.coords = whereItMayExceed(little, body, average);
    std::erase_if(values.coords, [&](const Coord& c) { return !body.isFront(c); });
    NodalStresses nodes(body.mesh, body.stress, average.isCounted);
    const std::vector<double> R = tensions(nodes, values.coords, radius, average);
    const std::vector<double> psi =
        average.perRelease > 0 ? drivenBy(values.coords, body, average, values.coords, R).psi : R;
    values.scalars.assign(psi.begin(), psi.end());
    return values;
}

double minEnergyUnder(double tension, double nu)
{
    // Of all stresses with a largest principal one of s, that with the others at nu / (1 - nu) s has the least energy.
    return tension * (1 - 2 * nu * nu / (1 - nu));
}

}  // namespace vdbfrac::grid
