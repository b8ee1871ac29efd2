// Solids of one or more bodies as linear systems: what they are made of, how they are held, at which x.
#pragma once

#include "crack.h"
#include "loads.h"

#include <vdbfrac/solver/linear_solver.h>
#include <vdbfrac/tetmesh/cut_mesh.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

namespace vdbfrac::test {

inline Block asBlock(const tetmesh::CutMesh& mesh)
{
    Block block({1, 1, 1}, mesh.lattice().spacing());
    block.elements = mesh.elements();
    block.nodes = mesh.nodes();
    return block;
}

/// A ball of radius `r` voxels cut by the lattice.
inline tetmesh::CutMesh cutBall(const tetmesh::Lattice& lattice, double r)
{
    const int reach = int(r) + 1;
    const double radius = r * lattice.voxelSize;
    return {lattice, sample({-reach, -reach, -reach}, {reach, reach, reach}, lattice.voxelSize,
                            [radius](Vec3 p) { return p.norm() - radius; })};
}

/// A linear system with all that it refers to. It is taken at a turned and stretched x, where tangents are definite,
/// shaken a little so that no two tets are alike.
class Solid {
public:
    struct Body {
        Block block;
        solver::Material material;
    };
    struct Conditions {
        std::function<bool(Coord)> held;  ///< by lattice coordinates
        double massFactor = 0;            ///< 1/s^2
        solver::Volumetric volumetric = solver::Volumetric::cell;
        double share = 0;  ///< of linear elasticity, as damping adds it
        double stretch = 1.05;
        double shake = .02;  ///< lattice spacings
    };

    Solid(std::vector<Body> bodies, const Conditions& conditions)
        : bodies_(std::move(bodies)),
          sets_(setsOf(bodies_)),
          massFactor_(conditions.massFactor),
          elastic_(sets_, countNodes(bodies_), bodies_[0].block.h, conditions.volumetric)
    {
        std::mt19937 random(1);
        const Mat3 turn = Eigen::AngleAxisd(.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
        for (const Body& body : bodies_)
            for (Coord c : body.block.nodes) {
                fixed_.push_back(conditions.held(c));
                x_.push_back(body.block.h *
                             (conditions.stretch * turn * c.toVec() + randomVec(random, conditions.shake)));
            }
        elastic_.evaluate(x_, {}, &tangent_, conditions.share);
    }
    Solid(const Solid&) = delete;  // the sets refer to the bodies

    const solver::ElasticOperator& elastic() const { return elastic_; }
    solver::Tangent& tangent() { return tangent_; }
    const std::vector<Vec3>& x() const { return x_; }
    const std::vector<std::uint8_t>& fixed() const { return fixed_; }
    std::size_t nodeCount() const { return x_.size(); }
    solver::LinearSystem system() const { return {elastic_, tangent_, massFactor_, fixed_}; }

    /// A u, 0 at fixed nodes; u must be 0 there.
    std::vector<Vec3> product(std::span<const Vec3> u) const
    {
        std::vector<Vec3> Au(u.size(), Vec3::Zero());
        elastic_.addProduct(tangent_, u, Au);
        for (std::size_t i = 0; i < u.size(); ++i)
            Au[i] = fixed_[i] ? Vec3::Zero().eval() : Vec3(Au[i] + massFactor_ * elastic_.mass()[i] * u[i]);
        return Au;
    }

    /// Random forces on the free nodes, in proportion to the stiffness there: slivers get little.
    std::vector<Vec3> randomForces(unsigned seed) const
    {
        std::mt19937 random(seed);
        std::vector<Vec3> f;
        for (std::size_t i = 0; i < nodeCount(); ++i) {
            const Vec3 v = randomVec(random, elastic_.stiffness()[i]);
            f.push_back(fixed_[i] ? Vec3::Zero().eval() : v);
        }
        return f;
    }

private:
    static std::size_t countNodes(const std::vector<Body>& bodies)
    {
        std::size_t count = 0;
        for (const Body& body : bodies) count += body.block.nodes.size();
        return count;
    }
    static std::vector<solver::ElementSet> setsOf(const std::vector<Body>& bodies)
    {
        std::vector<solver::ElementSet> sets;
        std::uint32_t first = 0;
        for (const Body& body : bodies) {
            sets.push_back({body.block.elements, body.block.nodes, first, body.material});
            first += std::uint32_t(body.block.nodes.size());
        }
        return sets;
    }

    std::vector<Body> bodies_;
    std::vector<solver::ElementSet> sets_;
    double massFactor_;
    solver::ElasticOperator elastic_;
    solver::Tangent tangent_;
    std::vector<Vec3> x_;
    std::vector<std::uint8_t> fixed_;
};

inline const solver::Material kGel = solver::makeMaterial(1e5, .3, 1000);

inline bool onFloor(Coord c) { return c.z == 0; }

inline std::unique_ptr<Solid> makeSolid(Block block, const Solid::Conditions& conditions,
                                        const solver::Material& material = kGel)
{
    return std::make_unique<Solid>(std::vector<Solid::Body>{{std::move(block), material}}, conditions);
}

/// Something to test, made when its test runs.
template <class T>
struct Case {
    const char* name;
    std::function<T()> make;
    friend void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }
};
template <class T>
std::string nameOf(const testing::TestParamInfo<Case<T>>& info)
{
    return info.param.name;
}

inline std::vector<Vec3> difference(std::span<const Vec3> a, std::span<const Vec3> b)
{
    std::vector<Vec3> d;
    for (std::size_t i = 0; i < a.size(); ++i) d.push_back(a[i] - b[i]);
    return d;
}

inline double norm(std::span<const Vec3> a) { return std::sqrt(solver::dot(a, a)); }

}  // namespace vdbfrac::test
