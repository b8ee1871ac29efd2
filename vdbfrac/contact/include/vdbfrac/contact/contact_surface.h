// The surfaces of all bodies as samples that can touch, and what each of them keeps from step to step.
#pragma once

#include <vdbfrac/base/grouping.h>
#include <vdbfrac/contact/samples.h>
#include <vdbfrac/core/archive.h>
#include <vdbfrac/core/body.h>
#include <vdbfrac/core/stages.h>
#include <vdbfrac/solver/coupling.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace vdbfrac::contact {

/// What a sample keeps from step to step.
struct SampleMemory {
    static constexpr double kUnseen = -1;
    static constexpr double kBuried = std::numeric_limits<double>::infinity();
    double allowance = kUnseen;   ///< how deep it may be without being pushed [m]; unseen: nobody has looked yet;
                                  ///< buried: too deep to be found, until it comes up
    Vec3 stretch = Vec3::Zero();  ///< elastic slip [m]
    double depth = 0;             ///< as it was last known [m]

    /// It is at this depth [m] when it is looked at, before it moves: what is new may be as deep as it is. Where it is
    /// deeper than it was left, by more than `jump` [m], it was cut or is in what nobody had looked at: its allowance
    /// grows by as much, so that only motion makes touches push.
    void see(double now, double jump = 0)
    {
        if (allowance == kUnseen)
            allowance = now;
        else if (now > depth + jump)
            allowance += now - depth;
        depth = std::max(depth, now);
    }
    /// A step has left it at this depth, with this slip if it still touches. `out`: m that it may be less deep then.
    void keep(double now, const Vec3& slip, double out)
    {
        if (allowance < kBuried || now > 0) allowance = std::max(0., std::min(allowance, now) - out);
        stretch = now > 0 ? slip : Vec3::Zero();
        depth = now;
    }
    /// Pushes as before where stiffness is `times` what it was.
    void stiffen(double times)
    {
        if (allowance >= 0 && depth > allowance) allowance = depth - (depth - allowance) / times;
        stretch /= times;
    }
};

/// A sample is a point of the cut surface with a reach: it touches what is that near. Forces act where the cut has its
/// point, as tractions on the material do: farther out, at nodes that thin cut tets hardly hold, they would crush
/// those. Surfaces that touch colliders have samples on sharp edges too, off the cut, so that bodies stand on all of
/// their base; between bodies those would crush thin tets at edges.
class ContactSurface {
public:
    /// `gap`: m. `closesLips`: those of cracks reach to each other. The bodies have to live as long.
    void start(std::span<const core::Body> bodies, double gap, bool closesLips = false);
    /// Samples that are deeper than `depth` [m] in other bodies at rest are buried.
    void bury(double depth);
    /// A body has been cut again. Samples where the surface was before keep their memory; nodes of the system are known
    /// again after settle().
    void recut(const core::Body& body);
    void settle();
    /// Nothing is near: there are no samples until settle() is called, and those that it makes keep nothing of before.
    void leave();

    std::size_t size() const { return all_.point.size(); }
    const tetmesh::EmbeddedPoint& point(std::size_t i) const { return all_.point[i]; }  ///< in nodes of the system
    /// At rest [m^2]: a third of the triangles round it, added up as vectors, less those that have a sample on a sharp
    /// edge; of that, its triangle.
    double area(std::size_t i) const { return all_.area[i]; }
    /// m: the gap that touching surfaces keep, where there is as much room at rest, and what the cut is off the
    /// surface.
    double reach(std::size_t i) const { return all_.reach[i]; }
    std::span<const std::uint32_t> fragmentOfNode() const { return ofNode_; }  ///< of the system
    bool isOneFragment() const { return isOneFragment_; }
    std::size_t body(std::size_t i) const { return body_[i]; }
    std::uint32_t fragment(std::size_t i) const { return fragment_[i]; }
    const Vec3& restPosition(std::size_t i) const { return all_.rest[i].at; }  ///< m
    const Vec3& restNormal(std::size_t i) const { return all_.rest[i].normal; }
    bool isTorn(std::size_t i) const { return all_.isTorn[i] != 0; }  ///< on a face that a crack has made
    Vec3 at(std::size_t i, std::span<const Vec3> x) const { return all_.point[i].at(x); }
    /// How far it feels [m]: to the other lip.
    double lipGap(std::size_t i) const { return all_.lip.empty() ? 0 : all_.lip[i].gap; }
    double farthestProbe() const;  ///< the most of all
    /// Turns samples on lips to where the other lip was; until it is called again they feel in this direction.
    void aimProbes(std::span<const Vec3> x);
    /// Where it feels what is near: at itself, or where the other lip was.
    Vec3 probe(std::size_t i, std::span<const Vec3> x) const
    {
        return probe_.empty() ? at(i, x) : Vec3(at(i, x) + probe_[i]);
    }
    /// How far it moves where its nodes move by 1, at the most: above 1 where it lies outside of its tet.
    double stretch(std::size_t i) const
    {
        double sum = 0;
        for (double w : all_.point[i].weight) sum += std::abs(w);
        return sum;
    }
    /// Samples that lie near each other: most of those in a cell.
    std::size_t clusters() const { return cluster_.start.size() - 1; }
    std::span<const std::uint32_t> cluster(std::size_t c) const { return cluster_[c]; }
    /// Of the triangles between the samples, each once; none where they are not kept.
    std::span<const Samples::Edge> edges() const { return all_.edge; }
    SampleMemory& memory(std::size_t i) { return memory_[i]; }
    const SampleMemory& memory(std::size_t i) const { return memory_[i]; }

    /// gradient -= what a force [N] on a sample does at its nodes.
    void addForce(std::size_t i, const Vec3& force, std::span<Vec3> gradient) const
    {
        for (std::size_t a = 0; a < 4; ++a) gradient[all_.point[i].node[a]] -= all_.point[i].weight[a] * force;
    }
    /// Writes the nodes and weights of a sample into a coupling.
    void couple(std::size_t i, solver::Coupling& coupling) const
    {
        for (std::size_t a = 0; a < 4; ++a)
            coupling.node[a] = all_.point[i].node[a], coupling.weight[a] = float(all_.point[i].weight[a]);
    }

    /// Where a step begins: puts samples on sharp edges there, or, where their tet is so strained that it says nothing
    /// of what lies outside of it, on the cut. There they keep nothing from step to step.
    void placeOnEdges(std::span<const Vec3> x);
    void forgetStrained();

    void save(const std::string& name, core::Archive& archive) const;
    /// `keepsReaches`: of samples; else they are those of the gap and the lips as they are set now.
    void restoreFrom(const std::string& name, const core::Archive& archive, bool keepsReaches = true);
    /// Each sample keeps what the nearest one of the wide lattice did, where one is within two of its voxels.
    void refineFrom(const std::string& name, const core::Refinement& wide);
    std::size_t bytes() const;

protected:
    Sampling sampling_;

private:
    void findPlaces();
    void restorePlaces(const std::string& name, const core::Archive& archive);
    void takeSamples();
    /// Where the memory of a body's samples begins.
    std::size_t firstOf(std::size_t body) const;

    std::span<const core::Body> bodies_;
    std::vector<SharpPlaces> places_;   // of each body
    std::vector<Samples> own_;          // of each body; none where nothing is near
    std::vector<SampleMemory> memory_;  // of all
    bool isSettled_ = false;
    Samples all_;  // in nodes of the system, without keys; none until it is settled
    std::vector<std::uint16_t> body_;
    std::vector<std::uint32_t> fragment_, ofNode_;
    bool isOneFragment_ = false;
    std::vector<Vec3> probe_;  // m
    Groups cluster_{{0}, {}};
};

}  // namespace vdbfrac::contact
