// Bytes a node: of each structure of the standard block by what its bytes() says, and of a whole simulation at rest by
// what the system says. The page on performance names the source of each number.
#include "block_problem.h"
#include "notched_block.h"

#include <vdbfrac/lab/bench/bench.h>
#include <vdbfrac/lab/machine/memory.h>

#include <fmt/format.h>

namespace vdbfrac::lab::bench {

namespace {

class Table {
public:
    void add(const std::string& what, std::size_t bytes, std::size_t nodes)
    {
        rows_.push_back(
            {{"what", what}, {"bytes", bytes}, {"per", "node"}, {"bytes_each", double(bytes) / double(nodes)}});
    }
    const Json& rows() const { return rows_; }

private:
    Json rows_ = Json::array();
};

/// Bytes of a stepper after one step.
std::size_t steppedBytes(int n, solver::LinearMethod method)
{
    BlockProblem block(n);
    solver::NewtonSettings settings;
    settings.iterations = 1;
    settings.linearMethod = method;
    solver::BackwardEuler stepper(block.elastic, settings);
    block.moveTop(kBlockStep * kBlockSpeed);
    (void)stepper.step(block.state, kBlockStep, {{}, block.boundary});
    return stepper.bytes();
}

void addBlock(int n, Table& table)
{
    const BlockProblem block(n);
    const std::size_t nodes = block.elastic.nodeCount();
    solver::Tangent tangent;
    (void)block.elastic.evaluate(block.state.x, {}, &tangent);
    const std::size_t bare = solver::BackwardEuler(block.elastic, {}).bytes(), rest = bare + tangent.bytes();
    const std::string where = fmt::format("standard block, {} nodes a side: ", n);
    table.add(where + "positions and velocities", nodes * 2 * sizeof(Vec3), nodes);
    table.add(where + "elastic operator", block.elastic.bytes(), nodes);
    table.add(where + "tangent", tangent.bytes(), nodes);
    table.add(where + "vectors of the Newton iteration", bare, nodes);
    table.add(where + "linear solver, jacobi", steppedBytes(n, solver::LinearMethod::jacobi) - rest, nodes);
    table.add(where + "linear solver, multigrid with all levels",
              steppedBytes(n, solver::LinearMethod::multigrid) - rest, nodes);
}

/// What the mesh that is cut keeps; its indices are not public and are in the total only.
std::size_t cutBytes(const tetmesh::CutMesh& mesh)
{
    std::size_t bytes = mesh.nodes().capacity() * sizeof(Coord) +
                        mesh.elements().capacity() * sizeof(tetmesh::CellElement) +
                        mesh.cells().capacity() * sizeof(tetmesh::Cell);
    for (const tetmesh::Cell& cell : mesh.cells()) bytes += cell.pieces.capacity() * sizeof(tetmesh::Piece);
    return bytes;
}

/// After a first step: everything that the next one needs is there.
void addSimulation(int voxels, Table& table)
{
    {
        PreparedScene first = notchedBlock(8, 2);  // libraries and threads take their memory once, whatever the size
        (void)first.simulation.step(1);
    }
    const std::uint64_t before = resetPeakMemory();
    PreparedScene run = notchedBlock(voxels, 2);
    (void)run.simulation.step(1);
    const std::uint64_t peak = peakMemory();
    const std::uint64_t after = resetPeakMemory();
    const core::Simulation& simulation = run.simulation;
    const std::size_t nodes = simulation.x().size();
    std::size_t cut = 0, phi = 0, elements = 0;
    for (const core::Body& body : simulation.bodies()) {
        cut += cutBytes(dynamic_cast<const tetmesh::CutMesh&>(*body.mesh));  // it is on a lattice
        elements += body.mesh->elements().size();
        phi += 2 * body.mesh->phi().bytes();  // now and at rest
    }
    const std::string where = fmt::format("notched block, {} voxels an edge: ", voxels);
    std::size_t effects = 0;
    for (const solver::Potential* p : simulation.stages().solve) effects += p->bytes();
    table.add(where + "positions and velocities, now and at the start of the step", nodes * 4 * sizeof(Vec3), nodes);
    table.add(where + "elastic operator", simulation.elastic().bytes(), nodes);
    table.add(where + "Newton's vectors, tangent and linear solver", simulation.integrator().bytes(), nodes);
    table.add(where + "damping: a tangent of its own", effects, nodes);
    table.add(where + "energy densities of the tets", elements * tetmesh::kMaxTets * sizeof(double), nodes);
    table.add(where + "what grips hold: positions, forces", nodes * (2 * sizeof(Vec3) + sizeof(std::uint32_t) + 1),
              nodes);
    table.add(where + "cells, elements and pieces of the cut", cut, nodes);
    table.add(where + "phi at the nodes of the voxels, now and at rest", phi, nodes);
    table.add(where + "in all at rest", after > before ? after - before : 0, nodes);
    table.add(where + "in all at its peak", peak > before ? peak - before : 0, nodes);
}

}  // namespace

Json benchMemory(const Plan& plan, const Say& say)
{
    Table table;
    addSimulation(plan.memoryVoxels, table);  // first: what the system says counts only what was not there before
    addBlock(plan.memoryNodes, table);
    for (const Json& row : table.rows())
        say(fmt::format("memory: {}: {:.0f} bytes a node", row["what"].get<std::string>(),
                        row["bytes_each"].get<double>()));
    return table.rows();
}

}  // namespace vdbfrac::lab::bench
