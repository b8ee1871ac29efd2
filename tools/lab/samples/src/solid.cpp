#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/lab/samples/solid.h>

#include <Eigen/Geometry>

#include <cmath>
#include <utility>

namespace vdbfrac::lab {

tetmesh::CutMesh cutBall(const tetmesh::Lattice& lattice, double r)
{
    const int reach = int(r) + 1;
    const double radius = r * lattice.voxelSize;
    return {lattice, sample({-reach, -reach, -reach}, {reach, reach, reach}, lattice.voxelSize,
                            [radius](Vec3 p) { return p.norm() - radius; })};
}

namespace {

std::size_t countNodes(const std::vector<Solid::Body>& bodies)
{
    std::size_t count = 0;
    for (const Solid::Body& body : bodies) count += body.block.nodes.size();
    return count;
}

std::vector<solver::ElementSet> setsOf(const std::vector<Solid::Body>& bodies)
{
    std::vector<solver::ElementSet> sets;
    std::uint32_t first = 0;
    for (const Solid::Body& body : bodies) {
        sets.push_back({body.block.elements, body.block.nodes, first, body.material});
        first += std::uint32_t(body.block.nodes.size());
    }
    return sets;
}

}  // namespace

Solid::Solid(std::vector<Body> bodies, const Conditions& conditions)
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
            x_.push_back(body.block.h * (conditions.stretch * turn * c.toVec() + randomVec(random, conditions.shake)));
        }
    elastic_.evaluate(x_, {}, &tangent_, conditions.share);
}

std::vector<Vec3> Solid::product(std::span<const Vec3> u) const
{
    std::vector<Vec3> Au(u.size(), Vec3::Zero());
    elastic_.addProduct(tangent_, u, Au);
    for (std::size_t i = 0; i < u.size(); ++i)
        Au[i] = fixed_[i] ? Vec3::Zero().eval() : Vec3(Au[i] + massFactor_ * elastic_.mass()[i] * u[i]);
    return Au;
}

std::vector<Vec3> Solid::randomForces(unsigned seed) const
{
    std::mt19937 random(seed);
    std::vector<Vec3> f;
    for (std::size_t i = 0; i < nodeCount(); ++i) {
        const Vec3 v = randomVec(random, elastic_.stiffness()[i]);
        f.push_back(fixed_[i] ? Vec3::Zero().eval() : v);
    }
    return f;
}

std::unique_ptr<Solid> makeSolid(Block block, const Solid::Conditions& conditions, const solver::Material& material)
{
    return std::make_unique<Solid>(std::vector<Solid::Body>{{std::move(block), material}}, conditions);
}

std::vector<Vec3> difference(std::span<const Vec3> a, std::span<const Vec3> b)
{
    std::vector<Vec3> d;
    for (std::size_t i = 0; i < a.size(); ++i) d.push_back(a[i] - b[i]);
    return d;
}

double norm(std::span<const Vec3> a) { return std::sqrt(solver::dot(a, a)); }

}  // namespace vdbfrac::lab
