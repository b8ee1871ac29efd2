// What the cases in newtons share: specimens as scene texts, and where a crack went.
#pragma once

#include "cases.h"
#include "scene_text.h"

#include <vdbfrac/lab/scenes/scene_run.h>

#include <map>
#include <span>
#include <string>
#include <vector>

namespace vdbfrac::lab::verify {

inline Measurement within(std::string what, double value, double reference, double limit)
{
    return {std::move(what), value, Bound::within, limit, reference};
}

inline constexpr double kYoungsModulus = 1e6, kToughness = 200;  ///< Pa, J/m^2, unless a case says otherwise

/// How a specimen is divided: lattice cells along its leading length.
struct Division {
    int cells = 10;
    const char* lattice = "six";
    int coarsening = 1;

    std::string name() const;  ///< "six, 10 cells"
};

/// A scene with one body, as text. Its loads are static unless said otherwise.
struct Specimen {
    double h = .1;  ///< m, of lattice cells
    Division division = {};
    double E = kYoungsModulus, nu = 0, rho = 1000;  ///< Pa, 1, kg/m^3
    std::string shape;                              ///< keys of the body
    int frames = 1;                                 ///< after the first
    double fps = 1;
    std::string substeps = "1";
    std::string solver = "integrator = \"static\"\nnewton_tolerance = 1e-4";
    std::string rest;  ///< grips and effects

    double dx() const { return h / division.coarsening; }
    std::string text() const;
};

/// [fracture] under toughness alone [J/m^2]: what else it needs is the program's to choose.
std::string toughness(double value = kToughness);
/// The same for loads that rise slowly: the front goes where it will before they rise further.
std::string slowToughness(double value = kToughness);
/// Keys of a box; with `cut` a box that is taken away.
std::string boxKeys(const Vec3& size, const Vec3& center);
std::string cutKeys(const Vec3& size, const Vec3& center);
/// All X with normal . X >= offset.
std::string halfspace(const Vec3& normal, double offset);
/// A grip on a region (TOML) with the value of `move`.
std::string grip(const char* name, const std::string& region, const std::string& move);

/// A load that rises to `knee` of all in the first second, where nothing tears yet, and to all in `seconds`.
struct Ramp {
    double knee = 1, seconds = 1;

    double share(double time) const;
    std::string keys(const Vec3& translate) const;  ///< poses, for all of it
};

/// Voxels that a crack took from the first body.
class Crack {
public:
    explicit Crack(const core::Simulation& simulation);

    /// m, at rest.
    std::vector<Vec3> voxels(const core::Simulation& simulation) const;
    /// Largest reach of them along a direction [m]; `none` where there is none.
    double tip(const core::Simulation& simulation, const Vec3& direction, double none) const;
    /// How far a crack in the plane y = 0 has gone along x [m], mean over the thickness: from the voxel columns along y
    /// that it has passed. What fails ahead of it counts for itself alone.
    double meanLength(const core::Simulation& simulation) const;

private:
    std::map<Coord, double> start_;
};

/// Of y over x, by least squares.
double slopeOf(std::span<const Eigen::Vector2d> points);

/// J, all that was put in by grips and effects in a step, and what the record calls `name`.
double workOf(const core::StepRecord& step);
double flowOf(const core::StepRecord& step, const std::string& name);

// newtons_strip.cpp
Measurements stripEnergy(Extent);
Measurements runningCrack(Extent);
Measurements crackSpeed(Extent);
// newtons_plate.cpp
Measurements turnedPlate(Extent);
Measurements shearKink(Extent);
Measurements symmetricBlock(Extent);
// newtons_beam.cpp
Measurements threePointBend(Extent);
Measurements doubleCantilever(Extent);
// newtons_stiffness.cpp
Measurements barStiffness(Extent);
Measurements freeBeam(Extent);
// newtons_shape.cpp
Measurements restVolume(Extent);
Measurements slits(Extent);
// newtons_law.cpp
Measurements smoothBar(Extent);
Measurements energyLedger(Extent);

}  // namespace vdbfrac::lab::verify
