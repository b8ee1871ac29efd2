// Passes over the nodes of a system, eight at a time. Not installed; only for kernel_nodes.cpp, hence without linkage.
#pragma once

#include "kernel_packs.h"

#include <cstddef>

namespace vdbfrac::solver {

namespace {

template <class Real>
using PointsT = PackT<Real>[3];

/// Eight points of which the first `count` are there.
template <class Real>
VDBFRAC_INLINE void splitSome(const Real* points, std::size_t count, PointsT<Real>& v)
{
    if (count == kLanes) return split(points, v);
    Real some[3 * kLanes] = {};
    for (std::size_t i = 0; i < 3 * count; ++i) some[i] = points[i];
    split(some, v);
}

template <class Real>
VDBFRAC_INLINE void joinSome(const PointsT<Real>& v, std::size_t count, Real* points)
{
    if (count == kLanes) return join(v[0], v[1], v[2], points);
    Real some[3 * kLanes];
    join(v[0], v[1], v[2], some);
    for (std::size_t i = 0; i < 3 * count; ++i) points[i] = some[i];
}

template <class To, class From>
VDBFRAC_INLINE PackT<To> loadSome(const From* p, std::size_t count)
{
    From some[kLanes] = {};
    if (count == kLanes) return convert<To>(loadLoose(p));
    for (std::size_t i = 0; i < count; ++i) some[i] = p[i];
    return convert<To>(loadLoose(some));
}

/// What the patches add to the nodes from `first` on, of a group of eight.
template <class Real>
VDBFRAC_INLINE void sumSlots(const SlotSums<Real>& sums, std::size_t first, std::size_t count, PointsT<Real>& v)
{
    if (const std::uint32_t slot = sums.contiguous[first / kLanes]; slot != kNoSlot)
        return split(sums.slot + 3 * std::size_t(slot), v);
    Real sum[3 * kLanes] = {};
    std::uint32_t s = sums.start[first];
    for (std::size_t l = 0; l < count; ++l)
        for (const std::uint32_t end = sums.start[first + l + 1]; s < end; ++s) {
            const Real* const slot = sums.slot + 3 * std::size_t(sums.slots[s]);
            for (std::size_t d = 0; d < 3; ++d) sum[3 * l + d] += slot[d];
        }
    split(sum, v);
}

template <class Real>
VDBFRAC_INLINE void applyBlocks(const LaneBlocks& B, const PointsT<Real>& r, PointsT<Real>& z)
{
    const PackT<Real> xx = load<Real>(B.v[0]), yy = load<Real>(B.v[1]), zz = load<Real>(B.v[2]);
    const PackT<Real> yz = load<Real>(B.v[3]), zx = load<Real>(B.v[4]), xy = load<Real>(B.v[5]);
    z[0] = xx * r[0] + xy * r[1] + zx * r[2];
    z[1] = xy * r[0] + yy * r[1] + yz * r[2];
    z[2] = zx * r[0] + yz * r[1] + zz * r[2];
}

template <class Real>
VDBFRAC_INLINE Pack dots(const PointsT<Real>& a, const PointsT<Real>& b)
{
    return convert<double>(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
}

/// Calls f(first, count) for the groups of nodes in [begin, end), the full ones with a constant count; returns the sum
/// over lanes of what it returns.
template <class F>
VDBFRAC_INLINE double eachGroup(std::size_t begin, std::size_t end, const F& f)
{
    Pack sum = {};
    std::size_t first = begin;
    for (; first + kLanes <= end; first += kLanes) sum += f(first, std::size_t(kLanes));
    if (first < end) sum += f(first, end - first);
    double total = 0;
    for (int l = 0; l < kLanes; ++l) total += sum[l];
    return total;
}

template <class Real>
double updateResidual(const GradientNodes<Real>& n, std::size_t begin, std::size_t end, Real step)
{
    return eachGroup(
        begin, end, [&](std::size_t first, std::size_t count) __attribute__((always_inline)) {
            PointsT<Real> r, p, Kp, z;
            splitSome(n.r + 3 * first, count, r);
            splitSome(n.p + 3 * first, count, p);
            sumSlots(n.Kp, first, count, Kp);
            const PackT<Real> inertia = convert<Real>(n.massFactor * loadSome<double>(n.mass + first, count));
            for (int d = 0; d < 3; ++d) r[d] -= step * (inertia * p[d] + Kp[d]);
            joinSome<Real>(r, count, n.r + 3 * first);
            applyBlocks<Real>(n.B[first / kLanes], r, z);
            return dots<Real>(r, z);
        });
}

template <class Real>
double updateDirection(const GradientNodes<Real>& n, std::size_t begin, std::size_t end, double move, Real beta)
{
    return eachGroup(
        begin, end, [&](std::size_t first, std::size_t count) __attribute__((always_inline)) {
            PointsT<Real> r, p, z;
            splitSome(n.r + 3 * first, count, r);
            splitSome(n.p + 3 * first, count, p);
            double* const u = n.u + 3 * first;
            const Real* const points = n.p + 3 * first;
            for (std::size_t i = 0; i < 3 * count; ++i) u[i] += move * double(points[i]);
            applyBlocks<Real>(n.B[first / kLanes], r, z);
            for (int d = 0; d < 3; ++d) p[d] = z[d] + beta * p[d];
            joinSome<Real>(p, count, n.p + 3 * first);
            return loadSome<double>(n.mass + first, count) * dots<Real>(p, p);
        });
}

void smoothNodes(const SmootherNodes& n, std::size_t begin, std::size_t end, float keep, float move)
{
    (void)eachGroup(
        begin, end, [&](std::size_t first, std::size_t count) __attribute__((always_inline)) {
            PointsT<float> x, b, step, sum, z;
            splitSome(n.x + 3 * first, count, x);
            splitSome(n.b + 3 * first, count, b);
            splitSome(n.step + 3 * first, count, step);
            sumSlots(n.Kx, first, count, sum);
            const SinglePack added = loadSome<float>(n.added + first, count);
            for (int d = 0; d < 3; ++d) b[d] -= added * x[d] + sum[d];
            applyBlocks<float>(n.B[first / kLanes], b, z);
            for (int d = 0; d < 3; ++d) {
                step[d] = keep * step[d] + move * z[d];
                x[d] += step[d];
            }
            joinSome<float>(step, count, n.step + 3 * first);
            joinSome<float>(x, count, n.x + 3 * first);
            return Pack{};
        });
}

}  // namespace

}  // namespace vdbfrac::solver
