#include "cases.h"

namespace vdbfrac::lab::verify {

namespace {

constexpr HardCase kCases[] = {
    {1, "mirrored", "inverted or mirrored start", "undefined energies, explosions", mirroredStart},
    {2, "scrambled", "scrambled start: random positions in the box", "stuck between inverted tets", scrambledStart},
    {3, "collapsed", "collapsed to a plane, a line, a point", "rotations undefined, division by zero", collapsedStart},
    {4, "stretched", "stretched to 10 times, squashed to 0.01", "strain measures that collapse", stretchAndSquash},
    {5, "locking", "nearly incompressible cantilever", "locking", locking},
    {6, "bad_numbers", "nu >= 0.5, nu <= -1, E <= 0, rho <= 0, dt <= 0", "division by zero", badNumbers},
    {7, "contrast", "stiffness contrast of 1e6", "conjugate gradients stall", stiffnessContrast},
    {8, "fractions", "cut cells with fractions of 1e-6 to 1e-18", "ten times the iterations, limits on dt",
     tinyFractions},
    {9, "phi_zero", "phi exactly 0 at nodes, edges, faces", "pieces without volume, doubled surface", phiZeroAtNodes},
    {10, "sheet", "sheet one cell thick", "wrong bending, and nobody says so", thinSheet},
    {11, "detached", "detached fragment, dynamic", "drift", detachedDynamic},
    {12, "detached_static", "detached fragment, static (singular system)", "conjugate gradients wander off",
     detachedStatic},
    {13, "single_tets", "fragments of one tet", "massless nodes, NaN", singleTets},
    {14, "long_steps", "time steps of 0.1, 1, 30 s", "never converges", longSteps},
    {15, "fast", "velocity 1000 times that of waves", "inversions, caps hit", thousandfoldSpeed},
    {16, "contact", "tangled contact", "ping-pong", tangledContact},
    {17, "foam", "kappa near 0: foam", "everything erodes at once, mass is lost track of", foam},
    {18, "unbreakable", "kappa = 1e300", "an effect that cannot act changes the result", unbreakable},
    {19, "not_finite", "NaN or infinity in the input", "silently wrong solid", notFinite},
    {20, "units", "lengths times 1e-6 and 1e6, E = 1e12", "absolute tolerances", unitsOfAnySize},
    {21, "resolutions", "the same body at 16, 32, 64 cells", "results that wander", resolutions},
    {22, "many_steps", "100 000 steps", "drift, leaks", manySteps},
    {23, "removed", "a tet removed elsewhere", "neighbours twist", tetRemovedElsewhere},
};

constexpr HardCase kTorture[] = {
    {1, "jerked", "grips at 100 wave speeds, reversed, stopped", "inversions, explosions", jerkedGrips},
    {2, "resistance_gone", "kappa, toughness dropped to 1e-6 in mid-run",
     "everything erodes at once, mass is lost track of", resistanceGone},
    {3, "coarsening", "coarsening 1, 2, 4", "material that hangs together through cells", coarseLattices},
    {4, "walls", "walls of 1, 2, 3 voxels torn", "shreds that lose their mass", thinWalls},
    {5, "moving_plane", "a plane that moves through nodes, edges, faces", "pieces without volume, holes in the surface",
     planeThroughNodes},
    {6, "spun_apart", "a body that spins itself apart", "momentum from nowhere", spunApart},
    {7, "touching", "shot, crushed, thrown together while it tears",
     "pieces in each other, steps that shrink to nothing", touchingWhileTorn},
};

}  // namespace

std::span<const HardCase> hardCases() { return kCases; }
std::span<const HardCase> tortureCases() { return kTorture; }

}  // namespace vdbfrac::lab::verify
