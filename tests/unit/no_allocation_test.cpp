// Steps after the first allocate nothing. This program counts what is asked of operator new, and of malloc where that
// can be done in the program itself: Eigen's matrices and TBB's tasks come from there.
#include "scene_texts.h"

#include <vdbfrac/base/parallel.h>
#include <vdbfrac/lab/samples/loads.h>
#include <vdbfrac/lab/scenes/scene_run.h>
#include <vdbfrac/solver/backward_euler.h>

#include <gtest/gtest.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <new>

namespace {

std::atomic<std::int64_t> newCalls = 0, mallocCalls = 0, largest = 0;  // largest: bytes in one call of operator new

void* counted(std::size_t size, std::size_t alignment)
{
    ++newCalls;
    for (std::int64_t seen = largest;
         seen < std::int64_t(size) && !largest.compare_exchange_weak(seen, std::int64_t(size));) {}
    const std::size_t rounded = (size + alignment - 1) / alignment * alignment;
    void* const memory =
        alignment > alignof(std::max_align_t) ? std::aligned_alloc(alignment, rounded) : std::malloc(size ? size : 1);
    if (!memory) throw std::bad_alloc();
    return memory;
}

/// Not inlined, as gcc takes a free() of what is new for a mistake.
[[gnu::noinline]] void release(void* memory) noexcept { std::free(memory); }

}  // namespace

void* operator new(std::size_t size) { return counted(size, 1); }
void* operator new[](std::size_t size) { return counted(size, 1); }
void* operator new(std::size_t size, std::align_val_t alignment) { return counted(size, std::size_t(alignment)); }
void* operator new[](std::size_t size, std::align_val_t alignment) { return counted(size, std::size_t(alignment)); }
void operator delete(void* memory) noexcept { release(memory); }
void operator delete[](void* memory) noexcept { release(memory); }
void operator delete(void* memory, std::size_t) noexcept { release(memory); }
void operator delete[](void* memory, std::size_t) noexcept { release(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
constexpr bool kCountsMalloc = true;
// By the other names of glibc's functions; the program's definitions come before the library's. calloc belongs to them:
// the compiler makes one of a malloc whose memory is then zeroed.
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);

void* malloc(std::size_t size)
{
    mallocCalls.fetch_add(1, std::memory_order_relaxed);
    return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size)
{
    mallocCalls.fetch_add(1, std::memory_order_relaxed);
    return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size)
{
    mallocCalls.fetch_add(1, std::memory_order_relaxed);
    return __libc_realloc(memory, size);
}
}
#else
constexpr bool kCountsMalloc = false;  // what allocates belongs to the sanitizer
#endif

namespace {

using namespace vdbfrac;
using solver::LinearMethod;

struct Calls {
    std::int64_t newCalls = 0, mallocCalls = 0;
};

/// A bar that swings while its end is turned; Newton's method has work in each step.
struct Swing {
    lab::Block block{{20, 9, 10}, .1};
    solver::ElasticOperator elastic = lab::elasticOperator(block, solver::makeMaterial(1e5, .3, 1000));
    solver::Boundary boundary = lab::clamped(block, [](Coord c) { return c.x == 0; });
    solver::State state = lab::atRest(block);
    solver::BackwardEuler stepper;
    int iterations = 0;

    explicit Swing(LinearMethod method, double tolerance = 1e-3, double linearTolerance = 1e-2)
        : stepper(elastic, settings(method, tolerance, linearTolerance))
    {
        for (std::size_t i = 0; i < state.x.size(); ++i) state.v[i] = Vec3(0, 0, state.x[i].x());
    }
    static solver::NewtonSettings settings(LinearMethod method, double tolerance, double linearTolerance)
    {
        solver::NewtonSettings s;
        s.linearMethod = method;
        s.tolerance = tolerance;
        s.linearTolerance = linearTolerance;
        return s;
    }
    Calls step()
    {
        const std::int64_t newBefore = newCalls, mallocBefore = mallocCalls;
        const auto& report = stepper.step(state, .02, {{}, boundary});
        const Calls calls{newCalls - newBefore, mallocCalls - mallocBefore};
        EXPECT_EQ(report.status, solver::StepStatus::converged);
        EXPECT_GT(report.linearIterations, 0);
        iterations = report.linearIterations;
        return calls;
    }
};

TEST(NoAllocation, CountersCount)
{
    const std::int64_t before = newCalls;
    const auto number = std::make_unique<std::vector<int>>(10);
    EXPECT_EQ(newCalls - before, 2);
    EXPECT_EQ(number->size(), 10u);
    const std::int64_t mallocBefore = mallocCalls;
    const Eigen::VectorXd vector = Eigen::VectorXd::Ones(Eigen::Index(number->size()) + 300);
    EXPECT_EQ(vector.sum(), 310);
    if (!kCountsMalloc) GTEST_SKIP() << "under a sanitizer malloc is not counted";
    EXPECT_GT(mallocCalls, mallocBefore);
}

TEST(NoAllocation, StepsAfterTheFirstAllocateNothingWithJacobi)
{
    for (int threads : {1, 2}) {
        const ThreadLimit limit(threads);
        Swing swing(LinearMethod::jacobi);
        EXPECT_GT(swing.step().newCalls, 0);
        for (int n = 2; n <= 6; ++n) {
            const Calls calls = swing.step();
            EXPECT_EQ(calls.newCalls, 0) << "step " << n << ", " << threads << " threads";
            if (threads == 1) {
                EXPECT_EQ(calls.mallocCalls, 0) << "step " << n;
            }  // TBB's workers come when they like
        }
    }
}

TEST(NoAllocation, CheckingAResidualAllocatesNothing)
{
    const ThreadLimit limit(1);
    Swing swing(LinearMethod::jacobi);
    (void)swing.step();
    const std::int64_t newBefore = newCalls, mallocBefore = mallocCalls;
    (void)swing.stepper.residual(swing.state, .02, {{}, swing.boundary}, swing.state.x);
    EXPECT_EQ(newCalls - newBefore, 0);
    EXPECT_EQ(mallocCalls - mallocBefore, 0);
}

/// The coarsest level is assembled and factored anew for each system.
TEST(NoAllocation, StepsAfterTheFirstAllocateNothingWithMultigrid)
{
    const ThreadLimit limit(1);
    Swing swing(LinearMethod::multigrid);
    (void)swing.step();
    for (int n = 2; n <= 6; ++n) {
        const Calls calls = swing.step();
        EXPECT_EQ(calls.newCalls, 0) << "step " << n;
        EXPECT_EQ(calls.mallocCalls, 0) << "step " << n;
    }
}

/// Steps of a whole simulation with grips, damping and a crack that waits. Some bytes of names and counts are asked for
/// in each step, but nothing that grows with the body: the largest of all is below a byte a node.
TEST(NoAllocation, StepsOfASimulationAfterTheFirstAllocateNoArrays)
{
    for (const char* integrator : {"backward_euler", "midpoint", "sdirk2", "symplectic_euler", "static"}) {
        const ThreadLimit limit(1);
        lab::SceneRun run(test::kGood + R"([[grip]]
body = "left"
region = { halfspace = { normal = [0, -1, 0], offset = 0.95 } }
move = { force = [0, -1, 0] }
[damping]
stiffness = 1e-4
[fracture]
toughness = 1e9
)",
                          {"solver.integrator=\"" + std::string(integrator) + "\""});
        for (int n = 0; n < 2; ++n) (void)run.step();
        run.steps.reserve(10);
        largest = 0;
        for (int n = 0; n < 5; ++n) EXPECT_EQ(run.step().outcome, core::Outcome::converged);
        const std::int64_t nodes = std::int64_t(run.simulation.x().size());
        std::printf("%s: %lld nodes, largest allocation %lld bytes\n", integrator, (long long)nodes,
                    (long long)largest.load());
        EXPECT_GT(largest, 0);
        EXPECT_LT(largest, nodes);
    }
}

struct MultigridCalls {
    Calls calls;
    int iterations = 0;
};

/// Of the second solve of one system.
MultigridCalls secondSolve(double tolerance)
{
    Swing swing(LinearMethod::multigrid);
    solver::Tangent tangent;
    std::vector<Vec3> b(swing.state.x.size(), Vec3(0, 0, 1)), u(b.size());
    swing.elastic.evaluate(swing.state.x, {}, &tangent);
    const solver::LinearSystem system{swing.elastic, tangent, 0, swing.boundary.fixed};
    solver::LinearSolver linear(swing.elastic, LinearMethod::multigrid);
    (void)linear.solve(system, b, u, {tolerance, 1000});
    const std::int64_t newBefore = newCalls, mallocBefore = mallocCalls;
    const auto report = linear.solve(system, b, u, {tolerance, 1000});
    return {{newCalls - newBefore, mallocCalls - mallocBefore}, report.iterations};
}

void expectSameForMoreIterations(std::int64_t Calls::*kind)
{
    const ThreadLimit limit(1);
    const MultigridCalls loose = secondSolve(1e-2), tight = secondSolve(1e-8);
    std::printf("%d iterations: %lld; %d iterations: %lld\n", loose.iterations, (long long)(loose.calls.*kind),
                tight.iterations, (long long)(tight.calls.*kind));
    ASSERT_GT(tight.iterations, loose.iterations);
    EXPECT_EQ(tight.calls.*kind, loose.calls.*kind);
}

TEST(NoAllocation, IterationsOfMultigridCallNoOperatorNew) { expectSameForMoreIterations(&Calls::newCalls); }

/// Eigen's solve in place keeps a mask for each of the two permutations.
TEST(NoAllocation, IterationsOfMultigridAllocateNothing) { expectSameForMoreIterations(&Calls::mallocCalls); }

}  // namespace
