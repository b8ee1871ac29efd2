#include <vdbfrac/lab/verify/random_scene.h>

#include "random_solid.h"
#include "scene_text.h"

#include <algorithm>
#include <cmath>

namespace vdbfrac::lab::verify {

namespace {

std::string velocity(const Vec3& v) { return "velocity = " + list(v); }

class Generator {
public:
    explicit Generator(std::uint64_t seed)
        : dice_(seed), touching_(seed ^ kTouching), squeezing_(seed ^ kSqueezing), flowing_(seed ^ kFlowing)
    {
        text_ = format("# Seed %llu of 'vdbfrac verify --random'.\n", static_cast<unsigned long long>(seed));
    }
    std::string scene();

private:
    /// One body while it is written. Lengths [m], speeds [m/s].
    struct Body {
        int number = 0;
        Vec3 center = Vec3::Zero();
        int axis = 1;             ///< along which it is `size_` long: grips hold its ends
        double E = 0, sound = 0;  ///< Pa; speed of waves along a thin bar
    };

    void drawSizes();
    void time();
    void grid();
    void body(Body& b);
    void material(Body& b);
    void motion(const Body& b);
    void grips(const Body& b);
    void hold(const Body& b);
    void push(const Body& b);
    void pull(const Body& b);
    void turn(const Body& b);
    void grip(const Body& b, int end, const std::string& move);
    double travel(const Body& b, double most);
    void effects(const Body& b);
    void fracture(const Body& b);
    void solver();
    void touch(const Body& b);
    void flow(const Body& b);
    double span() const { return steps_ * dt_; }

    static constexpr std::uint64_t kTouching = 0x746f756368, kSqueezing = 0x73717565657a65, kFlowing = 0x666c6f77;

    Dice dice_, touching_, squeezing_,
        flowing_;  // one for each that was added: without that, scenes are what the first makes
    bool touches_ = touching_.chance(.4);
    std::string text_;
    double size_ = 1, dx_ = 1, h_ = 1, dt_ = 1;  // m, s
    int across_ = 8, coarsening_ = 1, steps_ = 60;
    std::string lattice_ = "six";
    double strain_ = 0;  // the largest that what was drawn so far may cause, roughly
};

/// How fine, and so how many steps: the work is about the same for all.
void Generator::drawSizes()
{
    constexpr double kCellSteps = 40000;
    constexpr int kMinSteps = 6, kMaxSteps = 60;
    size_ = dice_.decades(.01, 100);
    across_ = int(std::lround(dice_.decades(4, 24)));
    const int kind = dice_.below(12);
    lattice_ = kind < 7 ? "six" : kind < 11 ? "five" : "delaunay";
    if (lattice_ == "delaunay") across_ = std::min(across_, 10);
    if (lattice_ == "six" && across_ >= 16 && dice_.chance(.3))
        coarsening_ = 4;
    else if (lattice_ != "five" && across_ >= 8 && dice_.chance(.3))
        coarsening_ = 2;
    dx_ = size_ / across_, h_ = coarsening_ * dx_;
    steps_ = std::clamp(int(kCellSteps / std::pow(size_ / h_, 3)), kMinSteps, kMaxSteps);
}

void Generator::time()
{
    const int substeps = 1 + dice_.below(3);
    const int frames = (steps_ + substeps - 1) / substeps;
    steps_ = frames * substeps;
    text_ +=
        format("[time]\nframes = [1, %d]\nfps = %.6g\nsubsteps = %d\n", 1 + frames, 1 / (substeps * dt_), substeps);
}

void Generator::grid()
{
    text_ +=
        format("[grid]\nvoxel_size = %.6g\nlattice = \"%s\"\ncoarsening = %d\n", dx_, lattice_.c_str(), coarsening_);
    if (lattice_ == "delaunay" && dice_.chance(.3)) text_ += "grading = 2\n";
}

void Generator::body(Body& b)
{
    b.center[0] = (touches_ ? 1.2 : 3) * size_ * b.number;
    if (dice_.chance(.7)) b.center += dice_.inBox(.5 * dx_);  // else faces lie on nodes
    b.axis = dice_.below(3);
    const SolidFrame frame{b.center, b.axis, size_, h_};
    text_ += format("[[body]]\nname = \"b%d\"\nmaterial = \"m%d\"\nshape = { ", b.number, b.number) +
             randomSolid(dice_, frame) + " }\n";
    std::string cuts;
    for (int n = dice_.chance(.6) ? 1 + dice_.below(2) : 0; n > 0; --n)
        cuts += (cuts.empty() ? "" : ", ") + randomCut(dice_, frame);
    if (!cuts.empty()) text_ += "cut = [" + cuts + "]\n";
    motion(b);
}

/// The time step is chosen with the first material: from a tenth to a thousand times what a wave takes for a cell.
void Generator::material(Body& b)
{
    const double rho = dice_.decades(1, 2e4);
    b.E = dice_.decades(1e2, 1e12);
    if (b.number > 0) b.E = std::clamp(rho * std::pow(h_ / dt_ * dice_.decades(.1, 1e3), 2), 1e2, 1e12);
    b.sound = std::sqrt(b.E / rho);
    if (b.number == 0) dt_ = h_ / b.sound * dice_.decades(.1, 1e3);
    text_ += format("[material.m%d]\nyoungs_modulus = %.6g\npoisson_ratio = %.4f\ndensity = %.6g\n", b.number, b.E,
                    dice_.uniform(-.5, .499), rho);
}

void Generator::motion(const Body& b)
{
    constexpr double kMaxTurn = 1;  // radians a step
    if (dice_.chance(.5)) {
        const double mach = dice_.decades(1e-3, 10);
        text_ += velocity(mach * b.sound * dice_.direction()) + "\n";
        strain_ = std::max(strain_, mach);
    }
    if (dice_.chance(.4)) {
        const double mach = dice_.decades(1e-3, 3), spin = std::min(2 * mach * b.sound / size_, kMaxTurn / dt_);
        text_ += "angular_velocity = " + list(spin * dice_.direction()) + "\n";
        strain_ = std::max(strain_, spin * size_ / (2 * b.sound));
    }
}

/// The end of a body at b.axis, upper (+1) or lower (-1), does as `move` says.
void Generator::grip(const Body& b, int end, const std::string& move)
{
    const double depth = std::max(dice_.uniform(.1, .2) * size_, 1.2 * h_);
    const Vec3 normal = end * Vec3::Unit(b.axis);
    text_ += format("[[grip]]\nbody = \"b%d\"\nregion = { halfspace = { normal = %s, offset = %.6g } }\nmove = { ",
                    b.number, list(normal).c_str(), normal.dot(b.center) + size_ / 2 - depth) +
             move + " }\n";
}

/// How far [m] a grip goes in all: as fast as ten times sound, no farther than `most` lengths.
double Generator::travel(const Body& b, double most)
{
    const double way = std::min(dice_.decades(1e-3, 10) * b.sound * span(), dice_.decades(.01, most) * size_);
    strain_ = std::max(strain_, way / size_);
    return way;
}

void Generator::hold(const Body& b) { grip(b, -1, velocity(Vec3::Zero())); }

void Generator::push(const Body& b)
{
    const double load = dice_.decades(1e-3, 1);  // over E times the size squared
    strain_ = std::max(strain_, load);
    // Ten times sound at the end.
    const double most = 10 * b.sound / span() * b.E / (b.sound * b.sound) * std::pow(size_, 3);
    const Vec3 force = std::min(load * b.E * size_ * size_, most) * dice_.direction();
    grip(b, 1, "force = " + list(force) + (dice_.chance(.5) ? format(", ramp = %.6g", span() / 2) : ""));
}

void Generator::pull(const Body& b)
{
    const Vec3 up = Vec3::Unit(b.axis);
    const bool apart = dice_.chance(.7);
    const Vec3 v = (apart ? travel(b, 2) * up : -travel(b, .45) * up) / span();
    grip(b, 1, velocity(v));
    grip(b, -1, velocity(dice_.chance(.5) ? Vec3(-v) : Vec3::Zero()));
}

void Generator::turn(const Body& b)
{
    constexpr double kMaxDegrees = 3;  // a step, about each axis
    std::string keys = "keys = [{ time = 0 }";
    for (int k = 1; k <= 2; ++k) {
        const double way = travel(b, 1);
        keys += format(", { time = %.6g, translate = ", k * span() / 2) + list(way * dice_.direction());
        keys += ", rotate = " + list(dice_.inBox(kMaxDegrees * steps_)) + " }";
    }
    grip(b, 1, keys + "], pivot = " + list(b.center + size_ / 2 * Vec3::Unit(b.axis)));
}

void Generator::grips(const Body& b)
{
    switch (dice_.below(6)) {
    case 0: break;
    case 1: hold(b); break;
    case 2: pull(b); break;
    case 3: turn(b), hold(b); break;
    case 4: hold(b), push(b); break;
    default: push(b);
    }
}

void Generator::effects(const Body& b)
{
    if (dice_.chance(.4)) {
        const double load = dice_.decades(1e-4, 1);
        const double g = std::min(load * b.sound * b.sound / size_, 10 * b.sound / span());
        strain_ = std::max(strain_, load);
        text_ += "[gravity]\nacceleration = " + list(g * dice_.direction()) + "\n";
    }
    if (dice_.chance(.3)) {
        text_ += "[damping]\n";
        if (dice_.chance(.5)) text_ += format("mass = %.6g\n", dice_.decades(.01, 10) / span());
        if (dice_.chance(.7)) text_ += format("stiffness = %.6g\n", dt_ * dice_.decades(.01, 10));
    }
    if (dice_.chance(.75)) fracture(b);
}

/// A resistance over six decades, round a tenth of the energy density that the scene may bring about.
void Generator::fracture(const Body& b)
{
    constexpr double kTipFactor = .36, kAverage = 3;  // A of docs/physics.md, about; lattice cells
    const double strain = std::clamp(strain_, 1e-4, 3.);
    const double kappa = .1 * .5 * b.E * strain * strain * dice_.decades(1e-3, 1e3);
    text_ += "[fracture]\n";
    switch (dice_.below(5)) {
    case 0:
    case 1: text_ += format("kappa = %.6g\n", kappa); break;
    case 2:
    case 3: text_ += format("toughness = %.6g\n", kappa * kAverage * h_ / kTipFactor); break;
    default:
        const double radius = kAverage * h_ * dice_.uniform(.7, 2.5);
        text_ += format("toughness = %.6g\nstrength = %.6g\n", kappa * radius / kTipFactor, std::sqrt(2 * kappa * b.E));
    }
    if (dice_.chance(.3)) text_ += "driver = \"full\"\n";
    if (dice_.chance(.2)) text_ += "average = 0\n";
    if (dice_.chance(.3)) text_ += format("front_speed = %.3g\n", dice_.decades(.1, 3));
    if (dice_.chance(.2)) text_ += "grip_margin = 0\n";
    if (dice_.chance(.2)) text_ += format("scatter = %.3g\n", dice_.uniform(.1, .9));
}

void Generator::solver()
{
    text_ += "[solver]\n";
    if (dice_.chance(.3)) text_ += "volumetric = \"none\"\n";
    const int methods = size_ <= 8 * h_ && !touches_ ? 3 : 2;  // direct is for the small and for few couplings
    const int method = dice_.below(10);
    if (method < methods)
        text_ += format("linear_solver = \"%s\"\n", method == 0 ? "jacobi" : method == 1 ? "multigrid" : "direct");
}

/// Bodies side by side that see each other and themselves, and a wall or a ball that comes from below; what is slow
/// for some steps falls asleep.
void Generator::touch(const Body& b)
{
    Dice& dice = touching_;
    const bool sees = dice.chance(.7), met = !sees || dice.chance(.5);
    if (sees) {
        text_ += format("[contact]\nfriction = %.4f\nstiffness = %.4g\n", dice.uniform(0, 1), dice.decades(1, 30));
        if (dice.chance(.4)) text_ += "lips = \"closed\"\n";
    }
    if (!met) return;
    const double gap = dice.uniform(.1, 2) * dx_, radius = size_ * dice.uniform(.1, 1);
    text_ += "[[collider]]\nshape = { ";
    if (dice.chance(.5))
        text_ += format("halfspace = { normal = [0, -1, 0], offset = %.6g } }\n", size_ / 2 + gap);
    else
        text_ += format("sphere = { radius = %.6g, center = ", radius) +
                 list(b.center - (size_ / 2 + gap + radius) * Vec3::UnitY()) + " } }\n";
    const double speed = std::min(dice.decades(1e-3, .3) * b.sound, size_ / span());
    text_ += format("friction = %.4f\nmove = { velocity = [0, %.6g, 0] }\n", dice.uniform(0, 1), speed);
    if (dice.chance(.5))
        text_ += format("[sleep]\nspeed = %.6g\nafter = %.6g\n", dice.decades(.1, 10) * speed,
                        dice.uniform(.05, .5) * span());
}

/// Yields at a strain from far below to beyond what the scene may bring about, some with time.
void Generator::flow(const Body& b)
{
    Dice& dice = flowing_;
    const double strain = std::clamp(strain_, 1e-4, 3.);
    const bool creeps = dice.chance(.1);
    text_ += format("[plasticity]\nyield_stress = %.6g\nfracture_share = %.3f\n",
                    creeps ? 0. : b.E * strain * dice.decades(1e-3, 3), dice.uniform(0, 1));
    if (dice.chance(.5)) text_ += format("hardening = %.6g\n", b.E * dice.decades(1e-4, 1));
    if (creeps || dice.chance(.3)) text_ += format("relaxation = %.6g\n", dt_ * dice.decades(.1, 100));
    if (dice.chance(.3)) text_ += format("max_stretch = %.4f\n", dice.uniform(1.05, 10));
}

std::string Generator::scene()
{
    drawSizes();
    const int bodies = dice_.chance(.25) ? 2 : 1;
    Body b[2];
    for (int n = 0; n < bodies; ++n) {
        b[n].number = n;
        material(b[n]);
    }
    time();
    grid();
    for (int n = 0; n < bodies; ++n) body(b[n]);
    for (int n = 0; n < bodies; ++n) grips(b[n]);
    effects(b[0]);
    solver();
    if (touches_) touch(b[0]);
    if (squeezing_.chance(.25))
        text_ +=
            format("[volume]\nleast = %.4f\nstiffness = %.4g\n", squeezing_.uniform(.3, 1), squeezing_.decades(.3, 30));
    if (flowing_.chance(.3)) flow(b[0]);
    return text_;
}

}  // namespace

std::string randomScene(std::uint64_t seed) { return Generator(seed).scene(); }

}  // namespace vdbfrac::lab::verify
