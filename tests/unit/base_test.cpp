// Ground floor: ordered sums, whole files, ledgers, analytic solids, fingerprints.
#include <vdbfrac/base/atomic_file.h>
#include <vdbfrac/base/background.h>
#include <vdbfrac/base/error.h>
#include <vdbfrac/base/hash.h>
#include <vdbfrac/base/ledger.h>
#include <vdbfrac/base/parallel.h>
#include <vdbfrac/base/primitive.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <semaphore>
#include <stdexcept>

using namespace vdbfrac;
namespace fs = std::filesystem;

namespace {

// --- parallel ------------------------------------------------------------------------------------------------------

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

// --- background ----------------------------------------------------------------------------------------------------

TEST(Background, JobsAreDoneInTheirOrder)
{
    std::vector<int> done;
    BackgroundQueue queue(1);
    for (int i = 0; i < 100; ++i) queue.push([&done, i] { done.push_back(i); });
    queue.finish();
    ASSERT_EQ(done.size(), 100u);
    for (int i = 0; i < 100; ++i) EXPECT_EQ(done[std::size_t(i)], i);
    EXPECT_GE(queue.secondsWorked(), 0);
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

// --- files ---------------------------------------------------------------------------------------------------------

class Files : public testing::Test {
protected:
    void SetUp() override
    {
        const auto* info = testing::UnitTest::GetInstance()->current_test_info();
        folder_ = fs::path(testing::TempDir()) / (std::string("vdbfrac_base_") + info->name());
        fs::remove_all(folder_);
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }
    std::size_t entries() const
    {
        return std::size_t(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
    }

    fs::path folder_;
};

TEST_F(Files, TextComesBackAsItWasWritten)
{
    std::string text = "line\r\nline\n";
    text.push_back('\0');
    text += "\xff end without newline";
    writeText(folder_ / "a.txt", text);
    EXPECT_EQ(readText(folder_ / "a.txt"), text);
    writeText(folder_ / "a.txt", "");
    EXPECT_EQ(readText(folder_ / "a.txt"), "");
    EXPECT_EQ(entries(), 1u);  // no temporary is left
}

TEST_F(Files, FailedWriteLeavesTheOldFile)
{
    const fs::path file = folder_ / "state.bin";
    writeText(file, "old");
    const auto halfWritten = [](const fs::path& temporary) {
        std::ofstream(temporary) << "ne";
        throw Error("disk full");
    };
    try {
        writeAtomically(file, halfWritten);
        FAIL() << "no error";
    } catch (const FileError& e) {
        EXPECT_NE(std::string(e.what()).find("state.bin"), std::string::npos);
        EXPECT_NE(std::string(e.what()).find("disk full"), std::string::npos);
    }
    EXPECT_EQ(readText(file), "old");
    EXPECT_EQ(entries(), 1u);
    // A writer that makes nothing is a failure as well.
    EXPECT_THROW(writeAtomically(file, [](const fs::path&) {}), FileError);
    EXPECT_EQ(readText(file), "old");
}

TEST_F(Files, FailedVerifyRemovesTheTemporary)
{
    const fs::path file = folder_ / "frame.vdb";
    fs::path seen;
    const auto write = [&](const fs::path& temporary) {
        seen = temporary;
        std::ofstream(temporary) << "damaged";
    };
    EXPECT_THROW(writeAtomically(file, write, [](const fs::path&) { throw Error("differs"); }), FileError);
    EXPECT_EQ(entries(), 0u);
    EXPECT_EQ(seen.parent_path(), folder_);         // so that renaming never copies
    EXPECT_EQ(seen.extension(), file.extension());  // writers choose their format by it
    EXPECT_NE(seen.filename(), file.filename());
}

TEST_F(Files, WhatALinkPointsToIsWritten)
{
    writeText(folder_ / "real", "old");
    fs::create_symlink("real", folder_ / "link");
    fs::create_symlink("later", folder_ / "dangling");
    writeText(folder_ / "link", "new");
    writeText(folder_ / "dangling", "made");
    EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
    EXPECT_EQ(readText(folder_ / "real"), "new");
    EXPECT_TRUE(fs::is_symlink(folder_ / "dangling"));
    EXPECT_EQ(readText(folder_ / "later"), "made");
    fs::create_symlink("circle", folder_ / "circle");
    EXPECT_THROW(writeText(folder_ / "circle", "x"), FileError);
    EXPECT_THROW((void)readText(folder_ / "circle"), FileError);
}

TEST_F(Files, DevicesAndPipesAreNeitherReplacedNorRead)
{
    const fs::path pipe = folder_ / "pipe";
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    for (const fs::path& other : {pipe, fs::path("/dev/null"), fs::path("/dev/zero")}) {
        EXPECT_THROW(writeText(other, "x"), FileError) << other;
        EXPECT_THROW((void)readText(other), FileError) << other;  // and does not wait for somebody to write
    }
    EXPECT_TRUE(fs::is_fifo(pipe));
    EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(Files, AnErrorWhileReadingIsNoEnd)
{
    try {
        (void)readText("/proc/self/mem");  // page 0 cannot be read: EIO
        FAIL() << "nothing was thrown";
    } catch (const FileError& e) {
        EXPECT_NE(std::string(e.what()).find("cannot be read"), std::string::npos) << e.what();
    }
}

TEST_F(Files, NoMoreIsReadThanAllowed)
{
    writeText(folder_ / "ten", "0123456789");
    EXPECT_EQ(readText(folder_ / "ten", 10), "0123456789");
    EXPECT_THROW((void)readText(folder_ / "ten", 9), FileError);
    EXPECT_GT(readText("/proc/self/status").size(), 0u);  // says that it has 0 bytes
    EXPECT_THROW((void)readText("/proc/self/status", 9), FileError);
}

TEST_F(Files, WritingBehindKeepsWhatIsBeforeAndCutsOffWhatIsAfter)
{
    const fs::path file = folder_ / "log";
    writeBehind(file, 0, "first");
    writeBehind(file, 5, " and second");
    EXPECT_EQ(readText(file), "first and second");
    writeBehind(file, 5, "!");
    EXPECT_EQ(readText(file), "first!");
    EXPECT_THROW(writeBehind(folder_, 0, "x"), FileError);
}

TEST_F(Files, FolderInPlaceOfAFileIsRefused)
{
    fs::create_directory(folder_ / "a");
    EXPECT_THROW(writeText(folder_ / "a", "text"), FileError);
    EXPECT_TRUE(fs::is_directory(folder_ / "a"));
    EXPECT_EQ(entries(), 1u);
    EXPECT_THROW((void)readText(folder_ / "a"), FileError);
    EXPECT_THROW((void)readText(folder_ / "missing"), FileError);
    EXPECT_THROW(writeText(folder_ / "missing" / "a", "text"), FileError);
}

TEST(Errors, InputErrorSaysPlaceWhatAllowedAndHint)
{
    const InputError error(std::vector<InputError::Detail>{
        {"a.toml:3:1", "nu is 0.7", "-1 < nu < 0.5", "rubber has 0.49"}, {"b", "c", "", ""}});
    const std::string text = error.what();
    for (const char* part : {"a.toml:3:1", "nu is 0.7", "-1 < nu < 0.5", "rubber has 0.49", "b: c"})
        EXPECT_NE(text.find(part), std::string::npos) << part;
    EXPECT_EQ(error.details().size(), 2u);
}

// --- ledger --------------------------------------------------------------------------------------------------------

TEST(Ledger, CountsAddUpAndStagesKeepTheirOrder)
{
    Ledger ledger;
    EXPECT_EQ(ledger.countOf("cut", "cells"), 0);
    EXPECT_TRUE(ledger.stages().empty());  // asking makes no stage
    ledger.count("solve", "calls", 1);
    ledger.count("cut", "cells", 10);
    ledger.count("cut", "cells", 5);
    ledger.count("cut", "voxels", 0);
    ledger.addSeconds("solve", 1.5);
    EXPECT_EQ(ledger.countOf("cut", "cells"), 15);
    EXPECT_EQ(ledger.countOf("cut", "voxels"), 0);
    EXPECT_EQ(ledger.secondsOf("solve"), 1.5);
    ASSERT_EQ(ledger.stages().size(), 2u);
    EXPECT_EQ(ledger.stages()[0].name, "solve");
    EXPECT_EQ(ledger.stages()[1].name, "cut");

    Ledger all;
    all.count("cut", "cells", 1);
    all.add(ledger);
    all.add(ledger);
    EXPECT_EQ(all.countOf("cut", "cells"), 31);
    EXPECT_EQ(all.countOf("solve", "calls"), 2);
    EXPECT_EQ(all.secondsOf("solve"), 3);
    EXPECT_EQ(all.stages()[0].name, "cut");
    {
        const StageTimer timer(all, "write");
    }
    EXPECT_EQ(all.countOf("write", "calls"), 1);
    EXPECT_GE(all.secondsOf("write"), 0);
    all.clear();
    EXPECT_TRUE(all.stages().empty());
}

// --- solids --------------------------------------------------------------------------------------------------------

struct Solid {
    const char* name;
    Primitive primitive;
};

std::vector<Solid> solids()
{
    const Vec3 centre(.2, -.3, .5), axis = Vec3(1, 2, -.5).normalized();
    std::vector<Solid> all;
    const auto add = [&](const char* name, Primitive::Kind kind) -> Primitive& {
        all.push_back({name, {}});
        all.back().primitive.kind = kind;
        all.back().primitive.center = centre;
        return all.back().primitive;
    };
    add("box", Primitive::Kind::box).size = Vec3(1, .6, .4);
    add("sphere", Primitive::Kind::sphere).radius = .7;
    for (const char* name : {"cylinder", "endless cylinder"}) {
        Primitive& p = add(name, Primitive::Kind::cylinder);
        p.axis = axis, p.radius = .4, p.height = std::string(name) == "cylinder" ? 1.1 : 0;
    }
    Primitive& capsule = add("capsule", Primitive::Kind::capsule);
    capsule.axis = axis, capsule.radius = .3, capsule.height = .9;
    Primitive& torus = add("torus", Primitive::Kind::torus);
    torus.axis = axis, torus.radius = .7, torus.tube = .2;
    Primitive& half = add("halfspace", Primitive::Kind::halfspace);
    half.axis = axis, half.offset = .25;
    return all;
}

Vec3 gradientOf(const Primitive& solid, const Vec3& X)
{
    constexpr double kStep = 1e-6;
    Vec3 g;
    for (int d = 0; d < 3; ++d)
        g[d] = (signedDistance(solid, X + kStep * Vec3::Unit(d)) - signedDistance(solid, X - kStep * Vec3::Unit(d))) /
               (2 * kStep);
    return g;
}

Vec3 somewhere(std::mt19937& random)
{
    std::uniform_real_distribution<double> uniform(-1.6, 1.6);
    const double x = uniform(random), y = uniform(random), z = uniform(random);
    return Vec3(.2, -.3, .5) + Vec3(x, y, z);
}

TEST(Primitives, DistanceIsTheLengthToTheNearestPointOfTheSurface)
{
    constexpr double kDifference = 1e-5;  // central differences with a step of 1e-6 where the surface bends
    for (const Solid& s : solids()) {
        std::mt19937 random(2);
        for (int trial = 0; trial < 2000; ++trial) {
            const Vec3 X = somewhere(random);
            const double distance = signedDistance(s.primitive, X);
            const Vec3 g = gradientOf(s.primitive, X);
            ASSERT_NEAR(g.norm(), 1, kDifference) << s.name;
            ASSERT_NEAR(signedDistance(s.primitive, X - distance * g), 0, kDifference) << s.name;
        }
    }
}

TEST(Primitives, BoundsHoldTheSurfaceAndTouchIt)
{
    constexpr double kDifference = 1e-5;
    constexpr double kSampling = .03;  // m: 20000 random points come that near to every extreme
    for (const Solid& s : solids()) {
        const Bounds b = bounds(s.primitive);
        Vec3 lower = Vec3::Constant(1e9), upper = Vec3::Constant(-1e9);
        std::mt19937 random(3);
        for (int trial = 0; trial < 20000; ++trial) {
            const Vec3 X = somewhere(random);
            const Vec3 onSurface = X - signedDistance(s.primitive, X) * gradientOf(s.primitive, X);
            lower = lower.cwiseMin(onSurface);
            upper = upper.cwiseMax(onSurface);
        }
        for (int d = 0; d < 3; ++d) {
            EXPECT_GE(lower[d], b.lower[d] - kDifference) << s.name;
            EXPECT_LE(upper[d], b.upper[d] + kDifference) << s.name;
            if (std::isfinite(b.lower[d])) {
                EXPECT_LE(lower[d], b.lower[d] + kSampling) << s.name << d;
            }
            if (std::isfinite(b.upper[d])) {
                EXPECT_GE(upper[d], b.upper[d] - kSampling) << s.name << d;
            }
        }
        const bool endless = std::string(s.name) == "halfspace" || std::string(s.name) == "endless cylinder";
        EXPECT_EQ(b.lower.allFinite() && b.upper.allFinite(), !endless) << s.name;
    }
}

TEST(Primitives, KnownDistances)
{
    Primitive box;
    box.size = Vec3(2, 2, 2);
    EXPECT_DOUBLE_EQ(signedDistance(box, Vec3(2, 2, 2)), std::sqrt(3.));
    EXPECT_DOUBLE_EQ(signedDistance(box, Vec3::Zero()), -1);
    Primitive half;
    half.kind = Primitive::Kind::halfspace;
    half.axis = Vec3::UnitZ();
    half.offset = 2;
    EXPECT_DOUBLE_EQ(signedDistance(half, Vec3(5, 5, 3)), -1);  // all X with normal.X >= offset
    Primitive torus;
    torus.kind = Primitive::Kind::torus;
    torus.axis = Vec3::UnitZ();
    torus.radius = 2, torus.tube = .5;
    EXPECT_DOUBLE_EQ(signedDistance(torus, Vec3::Zero()), 1.5);
    EXPECT_DOUBLE_EQ(signedDistance(torus, Vec3(0, 2, 0)), -.5);
}

// --- fingerprints --------------------------------------------------------------------------------------------------

TEST(Hash, IsXxh3AndDoesNotChange)
{
    // Published test values of XXH3, 64 bits, seed 0. Files carry these hashes: they must be the same for ever.
    EXPECT_EQ(hashBytes("", 0), 0x2d06800538d394c2u);
    EXPECT_EQ(hexadecimal(hashBytes("", 0)), "2d06800538d394c2");
    EXPECT_EQ(hexadecimal(0x1f), "000000000000001f");
    EXPECT_EQ(hexadecimal(~std::uint64_t{0}), "ffffffffffffffff");
}

TEST(Hash, OfAFileIsThatOfItsPieces)
{
    const fs::path file = fs::path(testing::TempDir()) / "hash_of_a_file";
    constexpr std::size_t kPiece = 1 << 20;
    const std::string text = std::string(kPiece, 'a') + "b";
    std::ofstream(file, std::ios::binary) << text;
    EXPECT_EQ(hashFile(file, 3), hashBytes("b", 1, hashBytes(text.data(), kPiece, 3)));
    std::ofstream(file, std::ios::binary) << "";
    EXPECT_EQ(hashFile(file, 3), 3u);
    fs::remove(file);
    EXPECT_THROW((void)hashFile(file), FileError);
}

TEST(Hash, SeesEveryBitOrderAndSeed)
{
    std::vector<double> values = awkwardNumbers(1000);
    const auto hash = [&](std::uint64_t seed = 0) { return hashOf(std::span<const double>(values), seed); };
    const std::uint64_t first = hash();
    EXPECT_EQ(hash(), first);
    EXPECT_NE(hash(1), first);
    values[500] = std::nextafter(values[500], 1e300);
    EXPECT_NE(hash(), first);
    values[500] = std::nextafter(values[500], -1e300);
    EXPECT_EQ(hash(), first);
    std::swap(values[1], values[2]);
    EXPECT_NE(hash(), first);
    EXPECT_NE(hashOf(std::span<const double>(std::vector<double>{0.})),
              hashOf(std::span<const double>(std::vector<double>{-0.})));
}

}  // namespace
