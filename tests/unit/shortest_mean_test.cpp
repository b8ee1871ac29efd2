// The shortest weighted mean of a few vectors: against a fine grid of weights, and where the answer is known.
#include "../../solver/src/shortest_mean.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

using vdbfrac::solver::kMaxMeans;
using vdbfrac::solver::shortestMean;

namespace {

constexpr double kRounding = 1e-12;  // relative: products of a few numbers each

/// `count` vectors in the columns, of random length and direction about a common offset.
Eigen::MatrixXd randomVectors(std::mt19937& random, int dimension, int count, double offset)
{
    std::normal_distribution<double> normal;
    Eigen::MatrixXd vectors(dimension, count);
    for (int i = 0; i < count; ++i) {
        const double size = std::exp(normal(random));
        for (int k = 0; k < dimension; ++k) vectors(k, i) = size * normal(random) + (k == 0 ? offset : 0);
    }
    return vectors;
}

Eigen::VectorXd weightsOf(const Eigen::MatrixXd& vectors) { return shortestMean(vectors.transpose() * vectors); }

void expectWeights(const Eigen::VectorXd& weight)
{
    EXPECT_GE(weight.minCoeff(), 0);
    EXPECT_NEAR(weight.sum(), 1, kRounding);
}

/// Least |mean|^2 over all weights that are multiples of 1 / cells, from vector `from` on, of which `left` are to be
/// given away.
double minOnGrid(const Eigen::MatrixXd& vectors, int cells, int from, int left, const Eigen::VectorXd& mean)
{
    const Eigen::VectorXd vector = vectors.col(from) / cells;
    if (from + 1 == vectors.cols()) return (mean + left * vector).squaredNorm();
    double least = INFINITY;
    for (int k = 0; k <= left; ++k)
        least = std::min(least, minOnGrid(vectors, cells, from + 1, left - k, mean + k * vector));
    return least;
}

TEST(ShortestMean, NoWeightsOfAFineGridMakeAShorterMean)
{
    constexpr int kCells[] = {0, 1, 4000, 400, 80};  // of the grid, for so many vectors
    std::mt19937 random(1);
    for (int count = 2; count <= 4; ++count)
        for (int trial = 0; trial < 20; ++trial) {
            const Eigen::MatrixXd vectors = randomVectors(random, 2 + trial % 4, count, trial % 3);
            const Eigen::VectorXd weight = weightsOf(vectors);
            expectWeights(weight);
            const double cells = kCells[count], found = (vectors * weight).norm();
            const double onGrid =
                std::sqrt(minOnGrid(vectors, int(cells), 0, int(cells), Eigen::VectorXd::Zero(vectors.rows())));
            double longest = 0;
            for (int i = 0; i < count; ++i) longest = std::max(longest, vectors.col(i).norm());
            EXPECT_LE(found, onGrid + kRounding * longest);
            // The nearest weights of the grid are within 1 / cells of the best ones each.
            EXPECT_GE(found, onGrid - count * longest / cells);
        }
}

/// What makes it the shortest: no vector lies on the side of the mean that is turned to 0 (the nearest point of a
/// convex body).
TEST(ShortestMean, EveryVectorReachesAsFarAlongTheMeanAsTheMeanItself)
{
    std::mt19937 random(2);
    for (int trial = 0; trial < 200; ++trial) {
        const int count = 1 + trial % kMaxMeans;
        const Eigen::MatrixXd vectors = randomVectors(random, 1 + trial % 12, count, trial % 5);
        const Eigen::VectorXd weight = weightsOf(vectors), mean = vectors * weight;
        expectWeights(weight);
        double longest = 0;
        for (int i = 0; i < count; ++i) longest = std::max(longest, vectors.col(i).squaredNorm());
        for (int i = 0; i < count; ++i) {
            EXPECT_GE(vectors.col(i).dot(mean), mean.squaredNorm() - kRounding * longest);
            if (weight[i] == 0) continue;
            EXPECT_NEAR(vectors.col(i).dot(mean), mean.squaredNorm(), kRounding * longest);
        }
    }
}

TEST(ShortestMean, OfOneVectorIsTheVector)
{
    for (double size : {0., 1e-200, 3., 1e100})
        EXPECT_EQ(shortestMean(Eigen::MatrixXd::Constant(1, 1, size * size))[0], 1);
}

TEST(ShortestMean, OfOppositeVectorsIsZeroWithWeightsAsTheOthersLength)
{
    Eigen::MatrixXd vectors(3, 2);
    vectors.col(0) = Eigen::Vector3d(1, -2, 2);
    vectors.col(1) = -3 * vectors.col(0);
    const Eigen::VectorXd weight = weightsOf(vectors);
    EXPECT_NEAR(weight[0], 0.75, kRounding);
    EXPECT_NEAR(weight[1], 0.25, kRounding);
    EXPECT_LE((vectors * weight).norm(), kRounding * vectors.norm());
}

TEST(ShortestMean, OfVectorsRoundZeroIsZero)
{
    // Corners of a triangle and of a tetrahedron with 0 inside.
    Eigen::MatrixXd triangle(2, 3), tet(3, 4);
    triangle << 2, -1, -1, 0, 1, -3;
    tet << 1, -1, -1, 1, 1, 1, -1, -1, 1, -1, 1, -1;
    const Eigen::VectorXd weight = weightsOf(triangle);
    EXPECT_LE((weight - Eigen::Vector3d(1. / 3, 1. / 2, 1. / 6)).norm(), kRounding);
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(weightsOf(tet)[i], 0.25, kRounding) << i;
}

TEST(ShortestMean, AVectorBeforeAllOthersIsTheMeanItself)
{
    Eigen::MatrixXd vectors(2, 4);
    vectors << 1, 2, 1.5, 1, 0, 1, -3, 5;  // none lies on the near side of the line x = 1
    const Eigen::VectorXd weight = weightsOf(vectors);
    EXPECT_NEAR(weight[0], 1, kRounding);
    EXPECT_NEAR((vectors * weight - vectors.col(0)).norm(), 0, kRounding);
}

TEST(ShortestMean, SameVectorsTwiceChangeNothing)
{
    std::mt19937 random(3);
    for (int trial = 0; trial < 50; ++trial) {
        const int count = 1 + trial % (kMaxMeans / 2);
        const Eigen::MatrixXd vectors = randomVectors(random, 3, count, 1);
        Eigen::MatrixXd twice(3, 2 * count);
        twice << vectors, vectors;
        const Eigen::VectorXd weight = weightsOf(twice);
        expectWeights(weight);
        // Systems are singular.
        EXPECT_NEAR((twice * weight - vectors * weightsOf(vectors)).norm(), 0, 1e-6 * vectors.norm());
    }
}

TEST(ShortestMean, IsTheSameInOtherUnits)
{
    std::mt19937 random(4);
    const Eigen::MatrixXd vectors = randomVectors(random, 5, 4, 1);
    const Eigen::VectorXd weight = weightsOf(vectors);
    for (double unit : {1e-100, 1e-9, 1e9, 1e100})
        for (int i = 0; i < 4; ++i) EXPECT_NEAR(weightsOf(unit * vectors)[i], weight[i], kRounding) << unit;
}

}  // namespace
