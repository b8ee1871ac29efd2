#include <vdbfrac/lab/samples/loads.h>

#include <Eigen/Geometry>

namespace vdbfrac::lab {

solver::NewtonSettings tightSettings()
{
    solver::NewtonSettings settings;
    settings.tolerance = 1e-11;
    settings.iterations = 100;
    settings.linearTolerance = 1e-9;
    settings.linearIterations = 50000;
    return settings;
}

solver::Boundary freeBoundary(std::size_t nodes)
{
    return {std::vector<std::uint8_t>(nodes, 0),
            std::vector<Vec3>(nodes, Vec3::Zero()),
            std::vector<Vec3>(nodes, Vec3::Zero()),
            {}};
}

solver::Boundary clamped(const Block& block, const std::function<bool(Coord)>& held)
{
    solver::Boundary boundary = freeBoundary(block.nodes.size());
    for (std::size_t i = 0; i < block.nodes.size(); ++i) {
        boundary.fixed[i] = held(block.nodes[i]);
        boundary.target[i] = block.h * block.nodes[i].toVec();
    }
    return boundary;
}

std::vector<double> nodalAreas(const Block& block, const std::function<bool(Coord)>& on)
{
    std::vector<double> area(block.nodes.size(), 0);
    for (const auto& e : block.elements) {
        const auto& tets = tetmesh::cellTets(e.shape);
        for (int t = 0; t < tets.count; ++t) {
            std::vector<std::uint32_t> face;
            for (int c : tets.corner[std::size_t(t)])
                if (on(block.nodes[e.node[std::size_t(c)]])) face.push_back(e.node[std::size_t(c)]);
            if (face.size() != 3) continue;
            const Vec3 a = block.nodes[face[0]].toVec(), b = block.nodes[face[1]].toVec(),
                       c = block.nodes[face[2]].toVec();
            for (std::uint32_t i : face) area[i] += block.h * block.h * (b - a).cross(c - a).norm() / 6;
        }
    }
    return area;
}

double weightedMean(const std::vector<double>& weight, const std::function<double(std::size_t)>& value)
{
    double sum = 0, all = 0;
    for (std::size_t i = 0; i < weight.size(); ++i)
        if (weight[i] > 0) sum += weight[i] * value(i), all += weight[i];
    return sum / all;
}

solver::State atRest(const Block& block)
{
    return {block.restPositions(), std::vector<Vec3>(block.nodes.size(), Vec3::Zero())};
}

Vec3 randomVec(std::mt19937& random, double size)
{
    std::uniform_real_distribution<double> uniform(-size, size);
    const double x = uniform(random), y = uniform(random), z = uniform(random);
    return {x, y, z};
}

solver::State shaken(const Block& block, double size, double speed, unsigned seed)
{
    solver::State state = atRest(block);
    std::mt19937 random(seed);
    for (std::size_t i = 0; i < state.x.size(); ++i) {
        state.x[i] += randomVec(random, size * block.h);
        state.v[i] = randomVec(random, speed);
    }
    return state;
}

Momentum momentum(const solver::ElasticOperator& elastic, std::span<const Vec3> v)
{
    Momentum p;
    for (std::size_t i = 0; i < v.size(); ++i) {
        p.linear += elastic.mass()[i] * v[i];
        p.scale += elastic.mass()[i] * v[i].norm();
    }
    return p;
}

double kineticEnergy(const solver::ElasticOperator& elastic, std::span<const Vec3> v)
{
    double energy = 0;
    for (std::size_t i = 0; i < v.size(); ++i) energy += 0.5 * elastic.mass()[i] * v[i].squaredNorm();
    return energy;
}

}  // namespace vdbfrac::lab
