// Loops over chunks, sums in an order, and jobs in the background.
#include <vdbfrac/base/background.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/parallel.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <random>
#include <semaphore>
#include <stdexcept>
#include <vector>

using namespace vdbfrac;

namespace {

std::vector<double> awkwardNumbers(std::size_t count)
{
    std::mt19937 random(1);
    std::uniform_real_distribution<double> exponent(-12, 12), sign(-1, 1);
    std::vector<double> values(count);
    for (double& v : values) v = sign(random) * std::pow(10, exponent(random));
    return values;
}

TEST(Parallel, OrderedSumHasTheSameBitsForAnyNumberOfThreads)
{
    const auto values = awkwardNumbers(100003);
    const auto term = [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += values[i];
        return sum;
    };
    double expected = 0;  // chunk by chunk, in order
    for (std::size_t b = 0; b < values.size(); b += 100) expected += term(b, std::min(values.size(), b + 100));
    for (int threads : {1, 2, 3, 8}) {
        const ThreadLimit limit(threads);
        EXPECT_EQ(threadCount(), threads);
        for (int round = 0; round < 20; ++round) EXPECT_EQ(orderedSum(values.size(), 100, term), expected);
    }
}

TEST(Parallel, OrderedMaxFindsTheLargest)
{
    const auto values = awkwardNumbers(5000);
    const auto term = [&](std::size_t begin, std::size_t end) {
        return *std::max_element(values.begin() + std::ptrdiff_t(begin), values.begin() + std::ptrdiff_t(end));
    };
    EXPECT_EQ(orderedMax(values.size(), 7, 0, term), *std::max_element(values.begin(), values.end()));
    EXPECT_EQ(orderedMax(0, 7, -3, term), -3);
    EXPECT_EQ(orderedSum(0, 7, term), 0);
}

TEST(Parallel, ChunksCoverEverythingOnce)
{
    for (std::size_t count : {0u, 1u, 9u, 10u, 11u, 1000u}) {
        std::vector<std::atomic<int>> seen(count);
        parallelChunks(count, 10, [&](std::size_t begin, std::size_t end) {
            EXPECT_EQ(begin % 10, 0u);
            EXPECT_TRUE(end == count || end == begin + 10);
            for (std::size_t i = begin; i < end; ++i) ++seen[i];
        });
        for (const auto& n : seen) EXPECT_EQ(n, 1);
    }
}

TEST(Background, JobsAreDoneInTheirOrder)
{
    std::vector<int> done;
    BackgroundQueue queue(1);
    for (int i = 0; i < 100; ++i) queue.push([&done, i] { done.push_back(i); });
    queue.finish();
    ASSERT_EQ(done.size(), 100u);
    for (int i = 0; i < 100; ++i) EXPECT_EQ(done[std::size_t(i)], i);
    EXPECT_GT(queue.secondsWorked(), 0);
}

TEST(Background, NoMoreJobsLiveThanTheDepthAndTheOneAtWork)
{
    std::atomic<int> alive{0}, most{0};
    struct Alive {
        std::atomic<int>& count;
        explicit Alive(std::atomic<int>& c) : count(c) { ++count; }
        ~Alive() { --count; }
    };
    BackgroundQueue queue(1);
    for (int i = 0; i < 50; ++i) {
        queue.push(
            [&most, &alive, life = std::make_shared<Alive>(alive)] { most = std::max(most.load(), alive.load()); });
        most = std::max(most.load(), alive.load());
    }
    queue.finish();
    EXPECT_LE(most, 3);  // at work, waiting, and the one whose push waits
    EXPECT_EQ(alive, 0);
}

TEST(Background, AnErrorIsThrownToTheNextCallerAndWhatWaitsIsDropped)
{
    bool later = false;
    std::binary_semaphore go(0);
    BackgroundQueue queue(2);
    queue.push([&] {
        go.acquire();
        throw FileError("frame", "no space left");
    });
    queue.push([&] { later = true; });
    go.release();
    try {
        queue.finish();
        FAIL() << "nothing was thrown";
    } catch (const FileError& e) {
        EXPECT_STREQ(e.what(), "frame: no space left");
    }
    queue.finish();  // an error is heard of once
    EXPECT_FALSE(later);
}

TEST(Background, WhatWasHandedOverIsDoneEvenWhenTheCallerFails)
{
    int done = 0;
    try {
        BackgroundQueue queue(2);
        for (int i = 0; i < 5; ++i) queue.push([&] { ++done; });
        throw std::runtime_error("stop");
    } catch (const std::runtime_error&) {
    }
    EXPECT_EQ(done, 5);
}

}  // namespace
