// The standard block: n^3 nodes, unit cube, E = 1 MPa, nu = .3, rho = 1000 kg/m^3, dt = 1/240 s, bottom clamped, top moved
// up at .4 m/s; one Newton iteration a step, linear solve to 1e-6 of the preconditioned residual, plain tets.
// Prints seconds a step and the height change of a probe node, without which a timing counts for nothing.
#include "block.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/solver/backward_euler.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

using namespace vdbfrac;

int main(int argc, char** argv)
{
    const int n = argc > 1 ? std::atoi(argv[1]) : 20, steps = argc > 2 ? std::atoi(argv[2]) : 12;
    const int threads = argc > 3 ? std::atoi(argv[3]) : 2;
    const double dt = 1. / 240, speed = 0.4;
    const ThreadLimit limit(threads);
    const test::Block mesh({n - 1, n - 1, n - 1}, 1. / (n - 1));
    const auto elastic = test::elasticOperator(mesh, solver::makeMaterial(1e6, 0.3, 1000), solver::Volumetric::none);

    solver::State state;
    state.x = mesh.restPositions();
    solver::Boundary boundary;
    const std::size_t nodes = mesh.nodes.size();
    boundary.fixed.assign(nodes, 0);
    boundary.target.assign(nodes, Vec3::Zero());
    boundary.force.assign(nodes, Vec3::Zero());
    std::size_t probe = 0;
    for (std::size_t i = 0; i < nodes; ++i) {
        const Coord c = mesh.nodes[i];
        state.v.push_back(c.y == n - 1 ? Vec3(0, speed, 0) : Vec3::Zero());
        boundary.fixed[i] = c.y == 0 || c.y == n - 1;
        if (c == Coord{n / 2, int(0.75 * (n - 1)), n / 2}) probe = i;
    }
    solver::NewtonSettings settings;
    settings.iterations = 1;
    settings.linearTolerance = 1e-6;
    settings.linearIterations = 20000;
    settings.tolerance = 0;
    const char* const method = argc > 4 ? argv[4] : "jacobi";
    settings.linearMethod = method[0] == 'm' ? solver::LinearMethod::multigrid : method[0] == 'd' ? solver::LinearMethod::direct : solver::LinearMethod::jacobi;
    solver::BackwardEuler stepper(elastic, settings);
    double seconds = 0;
    int iterations = 0;
    for (int s = 0; s < steps; ++s) {
        for (std::size_t i = 0; i < nodes; ++i)
            if (boundary.fixed[i]) boundary.target[i] = state.x[i] + dt * state.v[i];
        const auto start = std::chrono::steady_clock::now();
        const auto& report = stepper.step(state, dt, {{}, boundary});
        seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        iterations += report.linearIterations;
    }
    std::printf("n=%d threads=%d s/step=%.4f cg/step=%.1f ns/node/iteration=%.1f uy=%.6e\n", n, threads, seconds / steps,
                double(iterations) / steps, 1e9 * seconds / iterations / double(nodes), state.x[probe].y() - mesh.h * mesh.nodes[probe].y);
}
