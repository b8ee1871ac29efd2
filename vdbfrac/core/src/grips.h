// Grips: what holds and moves the material. Not installed.
#pragma once

#include <vdbfrac/core/body.h>
#include <vdbfrac/core/simulation.h>
#include <vdbfrac/scene/scene.h>
#include <vdbfrac/solver/integrator.h>

#include <span>
#include <string>
#include <utility>
#include <vector>

namespace vdbfrac::core {

class Simulation::Grips {
public:
    /// Finds the body of each grip.
    Grips(const std::vector<scene::Grip>& grips, double fps, std::span<const Body> bodies);

    /// Finds the nodes of each grip again: after any change of the mesh. All copies of a lattice node in the region
    /// count.
    void rebuild(std::span<const Body> bodies, const solver::ElasticOperator& elastic);

    /// Throws InputError when a grip holds no node, or would jump with nodes that another lets go before `end` [s].
    void requireNodes(double end) const;

    /// Throws InputError for a grip that would jump: at a time hold a node more than half a cell from where it is.
    void requireNear(std::span<const Vec3> x, double time) const;

    /// Gives the nodes that are held the velocities [m/s] with which they set off at t = 0; otherwise the first step
    /// would have to accelerate them, with a load that grows as it gets shorter.
    void setStartVelocities(std::span<Vec3> v) const;

    /// Holds nodes where they are beside those of the grips, until the next rebuild().
    void hold(std::uint32_t node, const Vec3& x) { boundary_.fixed[node] = 1, boundary_.target[node] = x; }

    /// When a step from a time on has to end that would end at `until` [s]: where a grip lets go, if that is between.
    double endOfStep(double time, double until) const;
    /// Grips whose time has come hold nothing after the next rebuild(). Returns whether there are any that did before.
    bool letGo(double time);

    /// Does a grip hold or pull at a fragment, by its id?
    std::vector<std::uint8_t> heldFragments(std::size_t fragments) const;

    /// Prescribed positions at a time and forces until then. Holds until the next call.
    const solver::Boundary& boundary(double time);

    /// Total force [N] of each grip on the material, with the forces of the last boundary().
    std::vector<Vec3> loads(std::span<const Vec3> reaction, double time) const;

    /// A step from x0 at time t0 to x1 at t1 [m, s].
    struct Move {
        std::span<const Vec3> x0, x1;
        double t0, t1;
    };
    /// What the grips did over a step [J].
    struct Works {
        std::vector<std::pair<std::string, double>> ofGrips;  ///< by name
        double late = 0;  ///< what the forces of the end would have done beyond, all along the way
    };
    /// Along the legs of the step; where there are none with the mean of the forces at both ends.
    Works work(const Move& move, std::span<const Vec3> reaction, std::span<const solver::HeldLeg> legs);

    void save(Archive& archive) const;
    void restoreFrom(const Archive& archive);

    std::size_t count() const { return held_.size(); }
    std::span<const std::uint32_t> nodes(std::size_t grip) const { return held_[grip].nodes; }

    /// Distance [m] in rest space from X to the nearest grip on a body.
    double distance(const Body& body, const Vec3& X) const;

private:
    /// Forces f of a grip on nodes at x, as far as a rigid motion of all of them is concerned.
    struct Wrench {
        Vec3 force = Vec3::Zero();   // N, sum of f
        Mat3 moment = Mat3::Zero();  // N m, sum of f x^T
    };
    struct Held {
        const scene::Grip* grip;
        std::size_t body;
        std::vector<std::uint32_t> nodes;  // of the system
        std::vector<Vec3> rest;            // m
        // Of the grip's force, by mass; of what holds a node 1, or 0 where a later grip moves it.
        std::vector<double> share;
        Wrench before = {};   // at the end of the last step
        bool isGone = false;  // has it let go?
    };
    static Vec3 forceOn(const Held& held, std::size_t i, double time, std::span<const Vec3> reaction);
    static double workOf(const Wrench& wrench, const Held& held, const Move& move);
    static double workOf(const solver::HeldLeg& leg, const Held& held, const Move& move);

    bool isDue(const Held& held, double time) const;
    void requireHandOver(const Held& from, std::span<const Held> before) const;
    [[noreturn]] void refuseJump(const Held& held, double time, double jump, const Vec3& moved) const;

    std::vector<scene::Grip> grips_;
    double mostJump_;  // m
    double soon_;      // s: times nearer to each other are the same, as those in scenes are rounded
    std::vector<Held> held_;
    std::vector<std::string> bodyNames_;
    solver::Boundary boundary_;
};

}  // namespace vdbfrac::core
