// One linear system of the standard block, by any number of processes: does a matrix-free operator with multigrid fit
// PETSc, and does it need the same iterations, to the same result, for any number of them? docs/scaling.md has what
// for, tests/python/check_petsc.py builds and judges it. vdbfrac itself does not use it.
//
// A cube of `-cells`^3 cells of six tets (Kuhn), 1 m. The bottom is held, weight and a pull on the top act on it; from
// rest, one step of backward Euler with linear elasticity (corotational at rest): (M / dt^2 + K) u = f. All cells are
// alike, so one matrix of 24 x 24 stands for the elements of a level; no other matrix is kept, but for the coarsest
// level. Each process has a box of nodes and the rows of these. The halo, nodes beside the box, comes from the others;
// rows that do not need it are computed meanwhile.
#include "block_level.h"

#include <petscksp.h>

#include <cstdint>
#include <cstdio>
#include <list>
#include <vector>

using namespace standard_block;

namespace {

constexpr PetscInt kCoarsest = 4;        // cells along an edge: the same for any number of processes, so levels are
constexpr double kSmoothedPart = 0.125;  // of the spectrum, from above, is what a smoother deals with: 1 / 8 to 1
constexpr double kTolerance = 1e-13;     // of the residual: far below the 12 digits that are compared
constexpr PetscInt kMaxIterations = 200;

/// Nodes of a level, in boxes: a node is with the process that has it on the next finer level, so halos of one node do.
PetscErrorCode makeNodes(Level& level, DM finer)
{
    const DMBoundaryType ends = DM_BOUNDARY_NONE;
    Node processes{PETSC_DECIDE, PETSC_DECIDE, PETSC_DECIDE};
    std::array<std::vector<PetscInt>, 3> shares;
    PetscFunctionBeginUser;
    if (finer) {
        std::array<const PetscInt*, 3> finerShares;
        PetscCall(DMDAGetInfo(finer, nullptr, nullptr, nullptr, nullptr, &processes[0], &processes[1], &processes[2],
                              nullptr, nullptr, nullptr, nullptr, nullptr, nullptr));
        PetscCall(DMDAGetOwnershipRanges(finer, &finerShares[0], &finerShares[1], &finerShares[2]));
        for (int a = 0; a < 3; ++a)
            for (PetscInt p = 0, low = 0; p < processes[a]; low += finerShares[a][p++])
                shares[a].push_back((low + finerShares[a][p] + 1) / 2 - (low + 1) / 2);
    }
    const auto share = [&](int a) { return finer ? shares[a].data() : nullptr; };
    const PetscInt n = level.cells + 1;
    PetscCall(DMDACreate3d(PETSC_COMM_WORLD, ends, ends, ends, DMDA_STENCIL_BOX, n, n, n, processes[0], processes[1],
                           processes[2], 3, 1, share(0), share(1), share(2), &level.nodes));
    if (!finer) PetscCall(DMSetFromOptions(level.nodes));  // -da_processors_x and the like: other boxes
    PetscCall(DMSetUp(level.nodes));
    Node own, all;
    PetscCall(DMDAGetCorners(level.nodes, &level.own.low[0], &level.own.low[1], &level.own.low[2], &own[0], &own[1],
                             &own[2]));
    PetscCall(DMDAGetGhostCorners(level.nodes, &level.grown.low[0], &level.grown.low[1], &level.grown.low[2], &all[0],
                                  &all[1], &all[2]));
    level.block.high = {n, n, n};
    for (int a = 0; a < 3; ++a) {
        level.own.high[a] = level.own.low[a] + own[a], level.grown.high[a] = level.grown.low[a] + all[a];
        level.inside.low[a] = level.own.low[a] + (level.grown.low[a] < level.own.low[a]);
        level.inside.high[a] = level.own.high[a] - (level.grown.high[a] > level.own.high[a]);
    }
    PetscFunctionReturn(0);
}

PetscErrorCode makeLevel(Level& level, double dt, Level* finer)
{
    PetscFunctionBeginUser;
    level.cell = cellMatrix(level.h(), dt);
    PetscCall(makeNodes(level, finer ? finer->nodes : nullptr));
    PetscCall(DMCreateLocalVector(level.nodes, &level.withHalo));
    const PetscInt rows = 3 * level.own.count();
    const auto any = PETSC_DETERMINE;
    PetscCall(MatCreateShell(PETSC_COMM_WORLD, rows, rows, any, any, &level, &level.matrix));
    PetscCall(MatShellSetOperation(level.matrix, MATOP_MULT, reinterpret_cast<void (*)()>(multiplyShell)));
    PetscCall(MatShellSetOperation(level.matrix, MATOP_GET_DIAGONAL, reinterpret_cast<void (*)()>(getDiagonal)));
    if (!finer) PetscFunctionReturn(0);
    const PetscInt fineRows = 3 * finer->own.count();
    finer->coarser = &level;
    PetscCall(MatCreateShell(PETSC_COMM_WORLD, fineRows, rows, any, any, finer, &finer->fromCoarser));
    PetscCall(MatShellSetOperation(finer->fromCoarser, MATOP_MULT, reinterpret_cast<void (*)()>(prolong)));
    PetscCall(
        MatShellSetOperation(finer->fromCoarser, MATOP_MULT_TRANSPOSE, reinterpret_cast<void (*)()>(restrictShell)));
    PetscFunctionReturn(0);
}

/// The coarsest level is so small that each process solves all of it.
PetscErrorCode solveCoarsest(PC multigrid, Level& coarsest)
{
    KSP solver;
    PC preconditioner;
    Mat matrix;
    PetscFunctionBeginUser;
    PetscCall(MatComputeOperator(coarsest.matrix, MATAIJ, &matrix));
    PetscCall(PCMGGetCoarseSolve(multigrid, &solver));
    PetscCall(KSPSetOperators(solver, matrix, matrix));
    PetscCall(MatDestroy(&matrix));
    PetscCall(KSPSetType(solver, KSPPREONLY));
    PetscCall(KSPGetPC(solver, &preconditioner));
    PetscCall(PCSetType(preconditioner, PCREDUNDANT));
    PetscFunctionReturn(0);
}

/// Levels come finest first; PETSc counts them from the coarsest.
PetscErrorCode makeSolver(std::list<Level>& levels, KSP* solver)
{
    PC multigrid;
    PetscFunctionBeginUser;
    PetscCall(KSPCreate(PETSC_COMM_WORLD, solver));
    PetscCall(KSPSetType(*solver, KSPCG));
    PetscCall(KSPSetNormType(*solver, KSP_NORM_UNPRECONDITIONED));
    PetscCall(KSPSetTolerances(*solver, kTolerance, PETSC_DEFAULT, PETSC_DEFAULT, kMaxIterations));
    PetscCall(KSPSetResidualHistory(*solver, nullptr, kMaxIterations + 1, PETSC_TRUE));
    PetscCall(KSPSetOperators(*solver, levels.front().matrix, levels.front().matrix));
    PetscCall(KSPGetPC(*solver, &multigrid));
    PetscCall(PCSetType(multigrid, PCMG));
    PetscCall(PCMGSetLevels(multigrid, PetscInt(levels.size()), nullptr));
    PetscCall(PCMGSetCycleType(multigrid, PC_MG_CYCLE_W));
    PetscInt number = PetscInt(levels.size());
    for (Level& level : levels) {
        if (--number == 0) break;
        KSP smoother;
        PC jacobi;
        PetscCall(PCMGSetInterpolation(multigrid, number, level.fromCoarser));
        PetscCall(PCMGGetSmoother(multigrid, number, &smoother));
        PetscCall(KSPSetOperators(smoother, level.matrix, level.matrix));
        PetscCall(KSPSetType(smoother, KSPCHEBYSHEV));
        const double largest = largestEigenvalue(level.cell);
        PetscCall(KSPChebyshevSetEigenvalues(smoother, largest, kSmoothedPart * largest));
        PetscCall(KSPGetPC(smoother, &jacobi));
        PetscCall(PCSetType(jacobi, PCJACOBI));
    }
    PetscCall(PCMGSetNumberSmooth(multigrid, 2));
    PetscCall(solveCoarsest(multigrid, levels.back()));
    PetscFunctionReturn(0);
}

/// The levels of a block, finest first. They stay where they are: matrices point at them.
PetscErrorCode makeLevels(PetscInt cells, double dt, bool skipsExchange, std::list<Level>& levels)
{
    PetscFunctionBeginUser;
    for (Level* finer = nullptr; !finer || finer->cells > kCoarsest; finer = &levels.back()) {
        Level& level = levels.emplace_back();
        level.cells = finer ? finer->cells / 2 : cells;
        level.skipsExchange = skipsExchange;
        PetscCall(makeLevel(level, dt, finer));
    }
    PetscFunctionReturn(0);
}

double mass(const Level& level, const Node& n)
{
    double sum = 0;
    level.forEachCellAt(n, [&](int corner, const Node&) { sum += cornerMass(corner, level.h()); });
    return sum;
}

/// Weight, and a quarter of the pull on each cell's face at the top for each of its corners.
Vector3d load(const Level& level, const Node& n)
{
    Vector3d sum = mass(level, n) * kGravity;
    if (n[1] == level.cells)
        level.forEachCellAt(n, [&](int, const Node&) { sum += level.h() * level.h() / 4 * kPull; });
    return sum;
}

/// A vector of the finest level on the first process, in the order of the nodes: what is added up there does not know
/// how many processes there are. Empty on the others.
PetscErrorCode gather(const Level& level, Vec v, std::vector<double>& values)
{
    Vec natural, all;
    VecScatter scatter;
    PetscInt count;
    const double* from;
    PetscFunctionBeginUser;
    PetscCall(DMDACreateNaturalVector(level.nodes, &natural));
    PetscCall(DMDAGlobalToNaturalBegin(level.nodes, v, INSERT_VALUES, natural));
    PetscCall(DMDAGlobalToNaturalEnd(level.nodes, v, INSERT_VALUES, natural));
    PetscCall(VecScatterCreateToZero(natural, &scatter, &all));
    PetscCall(VecScatterBegin(scatter, natural, all, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecScatterEnd(scatter, natural, all, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecGetLocalSize(all, &count));
    PetscCall(VecGetArrayRead(all, &from));
    values.assign(from, from + count);
    PetscCall(VecRestoreArrayRead(all, &from));
    PetscCall(VecScatterDestroy(&scatter));
    PetscCall(VecDestroy(&all));
    PetscCall(VecDestroy(&natural));
    PetscFunctionReturn(0);
}

/// FNV-1a over the bits of a vector.
std::uint64_t hash(const std::vector<double>& values)
{
    std::uint64_t sum = 14695981039346656037u;
    const auto* bytes = reinterpret_cast<const unsigned char*>(values.data());
    for (std::size_t n = 0; n < values.size() * sizeof(double); ++n) sum = (sum ^ bytes[n]) * 1099511628211u;
    return sum;
}

/// Hash of the product with a vector that is the same for any number of processes.
PetscErrorCode productHash(Level& level, std::uint64_t& result)
{
    Vec x, y;
    std::vector<double> values;
    PetscFunctionBeginUser;
    PetscCall(DMCreateGlobalVector(level.nodes, &x));
    PetscCall(VecDuplicate(x, &y));
    PetscCall(fill(level, x, [](const Node& n) {
        const auto wave = [&](PetscInt shift) { return double((7 * n[0] + 13 * n[1] + 29 * n[2] + shift) % 31) / 7; };
        return Vector3d(wave(0), wave(11), wave(17));
    }));
    PetscCall(multiply(level, x, y, true));
    PetscCall(gather(level, y, values));
    result = hash(values);
    PetscCall(VecDestroy(&x));
    PetscCall(VecDestroy(&y));
    PetscFunctionReturn(0);
}

void print(const char* name, const Vector3d& v)
{
    std::printf("\"%s\": [%.15e, %.15e, %.15e],\n", name, v[0], v[1], v[2]);
}

/// The balance of the block, from outside: load + reaction = inertia. And where some nodes went.
void printSolution(const Level& level, double dt, const std::vector<double>& u, const std::vector<double>& forces)
{
    Vector3d loads = Vector3d::Zero(), reaction = Vector3d::Zero(), inertia = Vector3d::Zero();
    double work = 0;
    forEachNode(level.block, [&](const Node& n) {
        const std::size_t at = level.block.offset(n);
        const Vector3d given = load(level, n), moved = Vector3d::Map(&u[at]);
        loads += given, work += given.dot(moved), inertia += mass(level, n) / (dt * dt) * moved;
        if (isHeld(n)) reaction += Vector3d::Map(&forces[at]) - given;
    });
    print("load", loads), print("reaction", reaction), print("inertia", inertia);
    std::printf("\"work\": %.15e,\n\"probes\": [", work);
    const PetscInt n = level.cells;
    const char* between = "";
    for (const Node& probe : {Node{0, n, n}, Node{n / 2, 3 * n / 4, n / 2}, Node{n, n / 2, n / 4}}) {
        const double* p = &u[level.block.offset(probe)];
        std::printf("%s[%.15e, %.15e, %.15e]", between, p[0], p[1], p[2]), between = ", ";
    }
    std::printf("],\n");
}

/// The boxes of nodes of all processes, and what each has sent for products of the finest level.
PetscErrorCode printProcesses(const Level& level)
{
    PetscMPIInt processes, self;
    double sent = 0;
    const Box& own = level.own;
    const std::array<PetscInt, 7> mine{
        own.low[0], own.low[1], own.low[2], own.high[0], own.high[1], own.high[2], level.grown.count() - own.count()};
    PetscFunctionBeginUser;
    PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &processes));
    PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &self));
    std::vector<PetscInt> all(mine.size() * std::size_t(processes));
    PetscCallMPI(
        MPI_Gather(mine.data(), mine.size(), MPIU_INT, all.data(), mine.size(), MPIU_INT, 0, PETSC_COMM_WORLD));
    PetscCallMPI(MPI_Reduce(&level.sentBytes, &sent, 1, MPI_DOUBLE, MPI_SUM, 0, PETSC_COMM_WORLD));
    if (self != 0) PetscFunctionReturn(0);
    std::printf("\"products\": %d,\n\"bytes_a_product\": %.3f,\n\"processes\": [", int(level.products),
                sent / level.products);
    for (std::size_t p = 0; p < all.size(); p += mine.size()) {
        const PetscInt* at = &all[p];
        std::printf("%s\n{\"low\": [%d, %d, %d], \"high\": [%d, %d, %d], \"halo\": %d}", p ? "," : "", int(at[0]),
                    int(at[1]), int(at[2]), int(at[3]), int(at[4]), int(at[5]), int(at[6]));
    }
    std::printf("]");
    PetscFunctionReturn(0);
}

/// All that is judged, as JSON.
PetscErrorCode report(Level& level, double dt, KSP solver, Vec f, Vec u)
{
    const double* history;
    double norm, left;
    PetscInt iterations, entries;
    PetscMPIInt self;
    Vec forces;
    std::uint64_t product = 0;
    std::vector<double> uAll, forcesAll;
    PetscFunctionBeginUser;
    PetscCall(KSPGetIterationNumber(solver, &iterations));
    PetscCall(KSPGetResidualHistory(solver, &history, &entries));
    const auto toMillionth = std::find_if(history, history + entries, [&](double r) { return r <= 1e-6 * history[0]; });
    PetscCall(VecDuplicate(u, &forces));
    PetscCall(multiply(level, u, forces, true));
    PetscCall(gather(level, forces, forcesAll));
    PetscCall(gather(level, u, uAll));
    PetscCall(multiply(level, u, forces, false));
    PetscCall(VecAYPX(forces, -1, f));
    PetscCall(VecNorm(forces, NORM_2, &left));
    PetscCall(VecNorm(f, NORM_2, &norm));
    PetscCall(VecDestroy(&forces));
    PetscCall(productHash(level, product));
    PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &self));
    if (self == 0) {
        std::printf("{\"cells\": %d,\n\"iterations\": %d,\n\"iterations_1e6\": %d,\n\"residual\": %.3e,\n",
                    int(level.cells), int(iterations), int(toMillionth - history), left / norm);
        std::printf("\"product_hash\": \"%016llx\",\n", static_cast<unsigned long long>(product));
        printSolution(level, dt, uAll, forcesAll);
    }
    PetscCall(printProcesses(level));
    if (self == 0) std::printf("}\n");
    PetscFunctionReturn(0);
}

PetscErrorCode run()
{
    PetscInt cells = 32;
    double dt = 1. / 240;
    PetscBool skipsExchange = PETSC_FALSE;
    std::list<Level> levels;
    KSP solver;
    Vec u, f;
    PetscFunctionBeginUser;
    PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-cells", &cells, nullptr));
    PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-dt", &dt, nullptr));
    PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-skip_exchange", &skipsExchange, nullptr));
    PetscInt coarsest = cells;
    while (coarsest > kCoarsest && coarsest % 2 == 0) coarsest /= 2;
    PetscCheck(coarsest == kCoarsest && cells > kCoarsest, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE,
               "-cells %d: only 8, 16, 32, ...", int(cells));
    PetscCall(makeLevels(cells, dt, skipsExchange, levels));
    Level& finest = levels.front();
    PetscCall(makeSolver(levels, &solver));
    PetscCall(DMCreateGlobalVector(finest.nodes, &u));
    PetscCall(VecDuplicate(u, &f));
    PetscCall(fill(finest, f, [&](const Node& n) -> Vector3d {
        return isHeld(n) ? Vector3d(Vector3d::Zero()) : load(finest, n);
    }));
    PetscCall(KSPSolve(solver, f, u));
    PetscCall(report(finest, dt, solver, f, u));
    PetscCall(KSPDestroy(&solver));
    PetscCall(VecDestroy(&u));
    PetscCall(VecDestroy(&f));
    for (Level& level : levels) {
        PetscCall(MatDestroy(&level.matrix));
        PetscCall(MatDestroy(&level.fromCoarser));
        PetscCall(VecDestroy(&level.withHalo));
        PetscCall(DMDestroy(&level.nodes));
    }
    PetscFunctionReturn(0);
}

}  // namespace

int main(int count, char** arguments)
{
    PetscCall(PetscInitialize(&count, &arguments, nullptr, nullptr));
    PetscCall(run());
    PetscCall(PetscFinalize());
    return 0;
}
