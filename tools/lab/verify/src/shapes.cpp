// Shapes that a level set gives and a mesh is loath to take.
#include "cases.h"

#include <vdbfrac/lab/samples/cantilever.h>
#include <vdbfrac/lab/samples/surface_measures.h>
#include <vdbfrac/lab/scenes/notched_plate.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/solver/linear_solver.h>
#include <vdbfrac/tetmesh/fragments.h>

#include <algorithm>
#include <cmath>

namespace vdbfrac::lab::verify {

namespace {

constexpr double dx = .1;

tetmesh::CutMesh cut(tetmesh::Lattice::Kind kind, int reach, const std::function<double(Vec3)>& phi)
{
    return {tetmesh::Lattice{kind, 1, dx}, sample({-reach, -reach, -reach}, {reach, reach, reach}, dx, phi)};
}

struct Flaws {
    double badEdges = 0;  ///< of all surfaces
    double volume = 0;    ///< worst difference between the surface's and the mesh's, relative
};

/// Half of a cube, cut by planes whose phi is 0 at nodes, or nearly so.
Flaws flawsOfHalves(tetmesh::Lattice::Kind kind)
{
    Flaws flaws;
    // Planes through faces, edges and nodes of cells, and their diagonals.
    for (const Vec3& n : {Vec3(1, 0, 0), Vec3(0, 1, 1), Vec3(1, -1, 0), Vec3(1, 1, 1), Vec3(2, -1, 0), Vec3(1, 2, -3)})
        for (double shift : {0., 1e-9, -1e-9, 1e-7, -1e-7}) {
            const tetmesh::CutMesh mesh = cut(kind, 8, [&](Vec3 p) {
                const double plane = std::round(n.dot(p) / dx) * dx / n.norm() + shift * dx;
                return std::max(plane, p.cwiseAbs().maxCoeff() - .5);
            });
            const BadEdges bad = badEdges(mesh.surface());
            flaws.badEdges += double(bad.open + bad.crowded);
            flaws.volume = std::max(flaws.volume, std::abs(enclosedVolume(mesh) / mesh.volume() - 1));
        }
    return flaws;
}

/// Volume of a column without ends from z = -.2 to .3, both through nodes, over the exact one. Linear interpolation
/// rounds off edges, alike in boxes whose lengths differ by two voxels: the mixed difference of four boxes has none.
double columnVolume(tetmesh::Lattice::Kind kind)
{
    constexpr double kExact = .4 * .4 * .5;
    const auto volumeOf = [&](double x, double y) {
        return cut(kind, 10,
                   [&](Vec3 p) {
                       return std::max({-.2 - p.z(), p.z() - .3, std::abs(p.x()) - x, std::abs(p.y()) - y});
                   })
            .volume();
    };
    return (volumeOf(.83, .79) - volumeOf(.63, .79) - volumeOf(.83, .59) + volumeOf(.63, .59)) / kExact;
}

/// Single voxel nodes of material, far apart and 1 to 1e-4 voxels deep: every fragment is the corners of some tets.
double dustAt(const Vec3& p)
{
    const Coord c{int(std::lround(p.x() / dx)), int(std::lround(p.y() / dx)), int(std::lround(p.z() / dx))};
    if (c.x % 4 != 0 || c.y % 4 != 0 || c.z % 4 != 0 || p.cwiseAbs().maxCoeff() > .9) return dx;
    return -dx * std::pow(10., -((c.x + c.y + c.z) / 4 + 6) / 3.);
}

/// The dust as elements, and one tet alone with hardly any material in it.
struct Dust {
    static constexpr double kRho = 1000, kFraction = 1e-15;
    Block block{{1, 1, 1}, dx};
    solver::Boundary boundary;
    std::size_t fragments = 0;  ///< without the lone tet
    double mass = 0;            ///< kg, from the volumes

    Dust()
    {
        const tetmesh::CutMesh mesh = cut(tetmesh::Lattice::Kind::six, 9, dustAt);
        std::uint32_t next = 0;
        const tetmesh::FragmentTracker tracker(mesh, next);
        block.elements = mesh.elements(), block.nodes = mesh.nodes();
        addTet();
        boundary = freeBoundary(block.nodes.size());
        boundary.part = tracker.ofNode();
        boundary.part.resize(block.nodes.size(), next);
        fragments = tracker.alive();
        mass = kRho * (mesh.volume() + kFraction * dx * dx * dx / 6);
    }

    void addTet()
    {
        const std::uint32_t first = std::uint32_t(block.nodes.size());
        tetmesh::CellElement alone;
        alone.patch = ~0u;
        alone.node.fill(first);
        alone.fraction[0] = kFraction;
        for (std::uint32_t k = 0; k < 4; ++k) {
            const int corner = tetmesh::cellTets(alone.shape).corner[0][k];
            alone.node[std::size_t(corner)] = first + k;
            block.nodes.push_back({20 + (corner & 1), corner >> 1 & 1, corner >> 2 & 1});
        }
        block.elements.push_back(alone);
    }
};

/// Root of the least eigenvalue of K u = w^2 M u for a cube of 1 m held at its bottom, by inverse iteration.
double firstFrequency(int cells, double nu)
{
    constexpr int kIterations = 8;  // the quotient's error falls by (w1 / w3)^4 with each
    const Block block({cells, cells, cells}, 1. / cells);
    const auto elastic = elasticOperator(block, solver::makeMaterial(1e5, nu, 1000));
    const std::vector<Vec3> x = block.restPositions();
    std::vector<std::uint8_t> fixed;
    for (Coord c : block.nodes) fixed.push_back(c.z == 0);
    solver::Tangent tangent;
    elastic.evaluate(x, {}, &tangent);
    solver::LinearSolver linear(elastic, solver::LinearMethod::multigrid);
    std::vector<Vec3> load(x.size()), u(x.size());
    for (std::size_t i = 0; i < x.size(); ++i)
        load[i] = fixed[i] ? Vec3::Zero().eval() : Vec3(elastic.mass()[i] * x[i].z() * Vec3(1, .5, 0));
    double quotient = 0;
    for (int n = 0; n < kIterations; ++n) {
        (void)linear.solve({elastic, tangent, 0, fixed}, load, u, {1e-6, 1000}, n > 0);
        double uMu = 0;
        for (std::size_t i = 0; i < x.size(); ++i) uMu += elastic.mass()[i] * u[i].squaredNorm();
        quotient = elastic.multiply<Vec3>(tangent, u).energy / uMu;
        for (std::size_t i = 0; i < x.size(); ++i) load[i] = quotient * elastic.mass()[i] * u[i];
    }
    return std::sqrt(quotient);
}

/// Largest over smallest, less 1.
template <class Value>
double spread(std::span<const int> cells, const Value& value)
{
    std::vector<double> values;
    for (int n : cells) values.push_back(value(n));
    return *std::max_element(values.begin(), values.end()) / *std::min_element(values.begin(), values.end()) - 1;
}

double ballVolume(int cells)
{
    const double h = 1. / cells;
    const int reach = cells / 2 + 1;
    return tetmesh::CutMesh(
               tetmesh::Lattice{tetmesh::Lattice::Kind::six, 1, h},
               sample({-reach, -reach, -reach}, {reach, reach, reach}, h, [](Vec3 p) { return p.norm() - .5; }))
        .volume();
}

}  // namespace

Measurements phiZeroAtNodes(Extent)
{
    constexpr double kVolume = 1e-6;
    Measurements all;
    for (auto [kind, name] : {std::pair{tetmesh::Lattice::Kind::six, "six tets a cell: "},
                              std::pair{tetmesh::Lattice::Kind::five, "five: "}}) {
        const Flaws flaws = flawsOfHalves(kind);
        all.push_back(
            atMost(std::string(name) + "edges at which the surface is not a closed 2-manifold", flaws.badEdges, 0));
        all.push_back(atMost(std::string(name) + "volume of the surface against that of the pieces, relative",
                             flaws.volume, kVolume));
        all.push_back(atMost(std::string(name) + "volume between planes of nodes, relative error",
                             std::abs(columnVolume(kind) - 1), kVolume));
    }
    return all;
}

Measurements thinSheet(Extent)
{
    Measurements all;
    for (double nu : kPoissonRatios) {
        SceneRun run(
            "version = 1\nname = \"sheet\"\n[time]\nframes = [1, 12]\n[grid]\nvoxel_size = 0.1\n[[body]]\nname = "
            "\"sheet\"\n"
            "shape = { box = { size = [1, 0.1, 1], center = [0.02, 0.03, 0.01] } }\nmaterial = \"m\"\n[material]\nm = "
            "{ youngs_modulus = 1e5, "
            "density = 1000, poisson_ratio = " +
            std::to_string(nu) +
            " }\n[[grip]]\nbody = \"sheet\"\n"
            "region = { halfspace = { normal = \"x\", offset = 0.4 } }\nmove = { velocity = [0, 0, 0] }\n[gravity]\n");
        const auto& notes = run.simulation.stages().notes;
        const auto warned = std::count_if(notes.begin(), notes.end(),
                                          [](const std::string& n) { return n.find("lattice cells thick") != n.npos; });
        run.toEnd();
        all.push_back(atLeast(at(nu) + "warnings that name the thickness in cells", double(warned), 1));
        all.push_back(atMost(at(nu) + "nodes that are not finite", countNotFinite(run.simulation.x()), 0));
    }
    return all;
}

Measurements singleTets(Extent)
{
    constexpr double kMass = 1e-12;
    Measurements all;
    for (double nu : kPoissonRatios) {
        Dust dust;
        const auto elastic = elasticOperator(dust.block, solver::makeMaterial(1e5, nu, Dust::kRho));
        double mass = 0;
        for (double m : elastic.mass()) mass += m;
        for (std::size_t i = 0; i < dust.block.nodes.size(); ++i)
            dust.boundary.force[i] = Vec3(0, -9.81 * elastic.mass()[i], 0);
        solver::State state = shaken(dust.block, .1, 1, 3);
        int capped = 0;
        for (int n = 0; n < 20; ++n)
            capped += solver::stepBackwardEuler(elastic, state, 1. / 24, {{}, dust.boundary}, {}).status ==
                      solver::StepStatus::capped;
        all.push_back(atLeast(at(nu) + "fragments of dust, of 125", double(dust.fragments), 125));
        all.push_back(atMost(at(nu) + "mass lost, relative", std::abs(mass / dust.mass - 1), kMass));
        all.push_back(
            atMost(at(nu) + "nodes that are not finite", countNotFinite(state.x) + countNotFinite(state.v), 0));
        all.push_back(atMost(at(nu) + "steps of 20 that are capped", capped, 0));
    }
    return all;
}

Measurements resolutions(Extent extent)
{
    constexpr double kMass = .01, kFrequency = .05, kLoad = .1;
    constexpr int kCells[] = {16, 32, 64};
    const std::span<const int> cells = std::span(kCells).first(extent == Extent::full ? 3 : 2);
    Measurements all = {
        atMost("spread of the mass of a ball, 16 to 64 cells across", spread(kCells, ballVolume), kMass)};
    const std::string range = extent == Extent::full ? "16 to 64 cells" : "16 and 32 cells";
    for (double nu : kPoissonRatios)
        all.push_back(atMost(at(nu) + "spread of the first frequency of a cube on its base, " + range,
                             spread(cells, [nu](int n) { return firstFrequency(n, nu); }), kFrequency));
    all.push_back(atMost("spread of the load at which a notched plate of given toughness tears, " + range,
                         spread(cells, [](int n) { return notchedPlatePeak(n, "toughness = 400"); }), kLoad));
    return all;
}

}  // namespace vdbfrac::lab::verify
