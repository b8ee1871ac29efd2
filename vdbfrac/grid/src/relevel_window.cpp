#include "relevel_window.h"

#include <vdbfrac/base/parallel.h>

#include <openvdb/math/Operators.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>

namespace vdbfrac::grid {

namespace {

constexpr int kWide = 14;
constexpr int kStep[3] = {kWide * kWide, kWide, 1};  // in a block, along x, y, z
constexpr int kFirst = 3 * (kStep[0] + kStep[1] + kStep[2]);

using Line = std::array<float, 8>;

/// Are all values that the stencils of a line see the same?
bool isFlat(const float* at)
{
    const float value = at[0];
    bool same = true;
    for (int z = -3; z < 11; ++z) same = same & (at[z] == value);
    for (int k : {-3, -2, -1, 1, 2, 3})
        for (int z = 0; z < 8; ++z) same = same & (at[k * kStep[0] + z] == value) & (at[k * kStep[1] + z] == value);
    return same;
}

struct Step {
    float dt, invDx, guard;
    /// phi after a step, by the square of its gradient (times dx^2).
    float operator()(float phi, float normSquared) const
    {
        const float s = phi / (std::sqrt(phi * phi + normSquared) + guard);
        return phi - dt * s * (std::sqrt(normSquared) * invDx - 1.0f);
    }
};

}  // namespace

/// Derivatives along an axis at 8 voxels side by side in z, times dx: D- and D+ (Jiang & Peng 2000, as in OpenVDB);
/// `unit`: of OpenVDB's constants.
struct Weno5 {
    static void differences(const float* at, int step, float unit, Line& down, Line& up)
    {
        const float scale2 = 0.01f * unit * unit;  // squares below a millionth of it do not count
        const auto weno = [&](const float* p, int way) {
            const auto d = [&](int k) { return p[(k + 1) * way] - p[k * way]; };
            return openvdb::math::WENO5(d(2), d(1), d(0), d(-1), d(-2), scale2);
        };
        for (int z = 0; z < 8; ++z) {
            up[std::size_t(z)] = weno(at + z, step);
            down[std::size_t(z)] = -weno(at + z, -step);
        }
    }
};

struct FirstOrder {
    static void differences(const float* at, int step, float, Line& down, Line& up)
    {
        for (int z = 0; z < 8; ++z) {
            up[std::size_t(z)] = at[z + step] - at[z];
            down[std::size_t(z)] = at[z] - at[z - step];
        }
    }
};

RelevelWindow::RelevelWindow(const openvdb::FloatGrid& grid, const std::vector<openvdb::Coord>& free)
    : dx_(grid.voxelSize()[0]),
      background_(grid.background()),
      free_(free.size()),
      round_(free.size()),
      beside_(free.size())
{
    const auto& tree = grid.constTree();
    std::map<openvdb::Coord, std::uint32_t> index;
    const auto add = [&](const openvdb::Coord& origin) {
        const auto [it, isNew] = index.emplace(origin, std::uint32_t(values_.size()));
        if (!isNew) return it->second;
        Values& values = values_.emplace_back();
        if (const auto* leaf = tree.probeConstLeaf(origin))
            std::copy_n(leaf->buffer().data(), kLeaf, values.begin());
        else
            values.fill(tree.getValue(origin));
        return it->second;
    };
    values_.reserve(8 * free.size());
    for (const openvdb::Coord& origin : free) add(origin);
    for (std::size_t i = 0; i < free.size(); ++i)
        for (int n = 0; n < 27; ++n)
            round_[i][std::size_t(n)] = add(free[i].offsetBy(8 * (n / 9 - 1), 8 * (n / 3 % 3 - 1), 8 * (n % 3 - 1)));
}

void RelevelWindow::gather(std::size_t leaf, Block& block) const
{
    float* row = block.data();
    for (int x = -kReach; x < 8 + kReach; ++x)
        for (int y = -kReach; y < 8 + kReach; ++y, row += kWide) {
            const int n = ((x + 8) >> 3) * 9 + ((y + 8) >> 3) * 3, at = (x & 7) << 6 | (y & 7) << 3;
            const auto from = [&](int k) { return values_[round_[leaf][std::size_t(n + k)]].data() + at; };
            std::memcpy(row, from(0) + 8 - kReach, kReach * sizeof(float));
            std::memcpy(row + kReach, from(1), 8 * sizeof(float));
            std::memcpy(row + kReach + 8, from(2), kReach * sizeof(float));
        }
}

void RelevelWindow::settleInterface()
{
    std::vector<Values> settled(values_.begin(), values_.begin() + std::ptrdiff_t(free_));
    parallelChunks(free_, 1, [&](std::size_t leaf, std::size_t) {
        Block block;
        gather(leaf, block);
        settleLeaf(leaf, block, settled[leaf]);
    });
    std::copy(settled.begin(), settled.end(), values_.begin());
}

void RelevelWindow::settleLeaf(std::size_t leaf, const Block& block, Values& settled)
{
    std::array<unsigned, kWide * kWide> inside{};  // of each row along z: a bit for each voxel that is material
    for (std::size_t row = 0; row < inside.size(); ++row)
        for (std::size_t z = 0; z < kWide; ++z) inside[row] |= unsigned(block[row * kWide + z] < 0) << z;
    for (int i = 0; i < kLeaf; ++i) {
        const int x = i >> 6, y = i >> 3 & 7, z = i & 7, at = kFirst + x * kStep[0] + y * kStep[1] + z;
        const double value = block[std::size_t(at)];
        if (value >= background_) continue;
        unsigned any = 0, all = 7;
        for (int dx = -1; dx <= 1; ++dx)
            for (int dy = -1; dy <= 1; ++dy) {
                const unsigned three =
                    inside[std::size_t((x + kReach + dx) * kWide + y + kReach + dy)] >> (z + kReach - 1) & 7;
                any |= three, all &= three;
            }
        if (any == 0 || all == 7) continue;
        beside_[leaf].set(std::size_t(i));
        if (value >= 0) continue;
        double nearest = std::numeric_limits<double>::infinity();  // to a crossing on an edge to a neighbour
        for (int n = 0; n < 27; ++n) {
            const int dx = n / 9 - 1, dy = n / 3 % 3 - 1, dz = n % 3 - 1;
            const double other = block[std::size_t(at + dx * kStep[0] + dy * kStep[1] + dz)];
            if (other >= 0)
                nearest = std::min(nearest, dx_ * std::sqrt(dx * dx + dy * dy + dz * dz) * value / (value - other));
        }
        settled[std::size_t(i)] = std::max(float(value), float(-nearest));
    }
}

template <class Differences>
void RelevelWindow::sweep()
{
    std::vector<Values> next(free_);
    parallelChunks(free_, 1, [&](std::size_t leaf, std::size_t) {
        Block block;
        gather(leaf, block);
        sweepLeaf<Differences>(block, next[leaf]);
    });
    std::copy(next.begin(), next.end(), values_.begin());
}

template <class Differences>
void RelevelWindow::sweepLeaf(const Block& block, Values& next) const
{
    const float dx = float(dx_), unit = float(constantsUnit(dx_));
    const Step step{dx * 0.3f, 1.0f / dx, openvdb::math::Tolerance<float>::value() * unit};
    for (int line = 0; line < 64; ++line) {
        const float* at = block.data() + kFirst + (line >> 3) * kStep[0] + (line & 7) * kStep[1];
        float* to = next.data() + 8 * line;
        if (isFlat(at)) {
            std::fill_n(to, 8, step(at[0], 0));
            continue;
        }
        std::array<Line, 3> down, up;
        for (std::size_t axis = 0; axis < 3; ++axis)
            Differences::differences(at, kStep[axis], unit, down[axis], up[axis]);
        for (std::size_t z = 0; z < 8; ++z)
            to[z] = step(at[z], openvdb::math::GodunovsNormSqrd(at[z] > 0, down[0][z], up[0][z], down[1][z], up[1][z],
                                                                down[2][z], up[2][z]));
    }
}

template void RelevelWindow::sweep<Weno5>();
template void RelevelWindow::sweep<FirstOrder>();

}  // namespace vdbfrac::grid
