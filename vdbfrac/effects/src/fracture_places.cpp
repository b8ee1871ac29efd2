#include "fracture_places.h"

#include <vdbfrac/base/infinity.h>
#include <vdbfrac/base/number_text.h>
#include <vdbfrac/tetmesh/noise.h>
#include <vdbfrac/tetmesh/nodes_where.h>

#include <algorithm>

namespace vdbfrac::effects {

namespace {

using scene::Key;
using scene::Type;

constexpr double kCells = 6;  // size of the scatter where the scene gives none

const Key kSpotKeys[] = {
    {"center", Type::vector, "m", "Center of the spot, at rest.", scene::kRequired},
    {"radius", Type::number, "m", "Radius of the spot; the factor falls to 1 there.", scene::kRequired, 0, kInfinity,
     true},
    {"factor", Type::number, "", "Factor on the resistance in its middle; below 1: weaker.", scene::kRequired, 1e-3,
     1e3},
};
const scene::TableSpec kSpotSpec = {
    .name = "fracture.spots", .doc = "A ball that is weaker or stronger than what is round it.", .keys = kSpotKeys};

const Key kPlaceKeys[] = {
    {"scatter", Type::number, "",
     "How much the resistance varies from place to place: by up to this share, smoothly; bodies without a notch then "
     "tear where they are weakest, not everywhere at once.",
     "0", 0, .9},
    {"scatter_size", Type::number, "m", "Size of the weaker and stronger places; default: six lattice cells.", "", 0,
     kInfinity, true},
    {"scatter_seed", Type::integer, "", "Another number gives another pattern.", "0", 0, 1e9},
    {.name = "spots",
     .member = Type::entries,
     .doc = "Balls that are weaker or stronger.",
     .defaultText = scene::kOptional,
     .table = &kSpotSpec},
};

}  // namespace

std::span<const Key> fracturePlaceKeys() { return kPlaceKeys; }

FracturePlaces::FracturePlaces(const scene::Values& values, double h)
    : scatter_(values.number("scatter")),
      isSizeGiven_(values.has("scatter_size")),
      size_(isSizeGiven_ ? values.number("scatter_size") : kCells * h),
      cell_(h),
      seed_(std::uint64_t(values.integer("scatter_seed")))
{
    if (!values.has("spots")) return;
    for (const scene::Values& spot : values.tables("spots"))
        spots_.push_back({spot.vector("center"), spot.number("radius"), spot.number("factor")});
}

double FracturePlaces::factor(const Vec3& X) const
{
    double factor = scatter_ > 0 ? 1 + scatter_ * tetmesh::noise(X / std::max(size_, cell_), seed_) : 1;
    for (const Spot& spot : spots_) {
        const double inside = std::max(0., 1 - (X - spot.center).squaredNorm() / (spot.radius * spot.radius));
        factor *= 1 + (spot.factor - 1) * inside * inside;
    }
    return factor;
}

double FracturePlaces::leastOf(const tetmesh::BodyMesh& body, double dx) const
{
    if (isAlike()) return 1;
    double least = 1;
    for (const Coord& c : tetmesh::nodesWhere(body.restPhi(), [&](Coord n) { return body.restPhi()(n) < 2 * dx; }))
        least = std::min(least, factor(dx * c.toVec()));
    return least;
}

void FracturePlaces::note(std::span<const core::Body> bodies, double dx, std::vector<std::string>& notes) const
{
    if (scatter_ > 0 && !isSizeGiven_)
        notes.push_back("fracture.scatter_size is " + shortNumber(size_, 3) +
                        " m here, six lattice cells; give it, or other voxels have their weak places elsewhere");
    if (scatter_ > 0 && size_ < cell_)
        notes.push_back("fracture.scatter_size = " + shortNumber(size_, 3) + " m counts as a lattice cell, " +
                        shortNumber(cell_, 3) + " m: nothing smaller can be told");
    const auto isFelt = [&](const Spot& spot) {
        return std::ranges::any_of(bodies, [&](const core::Body& body) {
            const auto& phi = body.mesh->restPhi();
            const auto isIn = [&](Coord c) {
                return phi(c) < 0 && (dx * c.toVec() - spot.center).norm() < spot.radius;
            };
            return !tetmesh::nodesWhere(phi, isIn).empty();
        });
    };
    for (std::size_t i = 0; i < spots_.size(); ++i)
        if (!isFelt(spots_[i]))
            notes.push_back("fracture.spots[" + std::to_string(i) +
                            "] is in no body, or smaller than a voxel: it does nothing");
}

std::function<double(Coord)> FracturePlaces::onVoxels(double dx) const
{
    if (isAlike()) return {};
    return [this, dx](Coord c) { return factor(dx * c.toVec()); };
}

}  // namespace vdbfrac::effects
