// Packs of eight numbers, one a lane, for the vector unit that the including file is compiled for. Not installed; only
// for the parts of a kernel, hence without linkage.
#pragma once

#include "kernel.h"

#if defined(__AVX512F__)
#include <immintrin.h>
#endif

#include <type_traits>
#include <utility>

namespace vdbfrac::solver {

namespace {

typedef double Pack __attribute__((vector_size(64)));
typedef float SinglePack __attribute__((vector_size(32)));
typedef double LoosePack __attribute__((vector_size(64), aligned(8), may_alias));
typedef float LooseSinglePack __attribute__((vector_size(32), aligned(4), may_alias));
typedef long long Mask __attribute__((vector_size(64)));

/// The pack of a number type: eight of them.
template <class Real>
struct PackOf;
template <>
struct PackOf<double> {
    using Type = Pack;
    using Loose = LoosePack;
};
template <>
struct PackOf<float> {
    using Type = SinglePack;
    using Loose = LooseSinglePack;
};
template <class Real>
using PackT = typename PackOf<Real>::Type;

#define VDBFRAC_INLINE inline __attribute__((always_inline))
#define VDBFRAC_OUTLINE __attribute__((noinline))
// Plain code of a pack is many instructions: there compile time counts for more than the call.
#if defined(__FMA__)
#define VDBFRAC_INLINE_WIDE VDBFRAC_INLINE
#else
#define VDBFRAC_INLINE_WIDE VDBFRAC_OUTLINE
#endif

/// Calls f(integral_constant<0>), ... at compile time.
template <int n, class F>
VDBFRAC_INLINE void unroll(const F& f)
{
    [&]<int... k>(std::integer_sequence<int, k...>) __attribute__((always_inline))
    {
        (f(std::integral_constant<int, k>{}), ...);
    }
    (std::make_integer_sequence<int, n>{});
}

/// Calls f(0), ... f(n - 1) in a loop that stays one.
template <class F>
VDBFRAC_INLINE void inTurn(int n, const F& f)
{
#pragma GCC unroll 1
    for (int k = 0; k < n; ++k) f(k);
}

template <class Real, class P>
VDBFRAC_INLINE PackT<Real> convert(P v)
{
    if constexpr (std::is_same_v<P, PackT<Real>>) return v;
#if defined(__AVX512F__)  // the compiler would convert halves and join them
    else if constexpr (std::is_same_v<P, SinglePack>)
        return Pack(_mm512_cvtps_pd(__m256(v)));
    else
        return SinglePack(_mm512_cvtpd_ps(__m512d(v)));
#else
    else
        return __builtin_convertvector(v, PackT<Real>);
#endif
}
/// Eight aligned numbers of type From as a pack of Real.
template <class Real, class From>
VDBFRAC_INLINE PackT<Real> load(const From* p)
{
    return convert<Real>(*reinterpret_cast<const PackT<From>*>(p));
}
VDBFRAC_INLINE void store(float* p, Pack v)
{
    *reinterpret_cast<SinglePack*>(p) = __builtin_convertvector(v, SinglePack);
}
template <class Real>
VDBFRAC_INLINE PackT<Real> loadLoose(const Real* p)
{
    return *reinterpret_cast<const typename PackOf<Real>::Loose*>(p);
}
template <class Real>
VDBFRAC_INLINE void storeLoose(Real* p, PackT<Real> v)
{
    *reinterpret_cast<typename PackOf<Real>::Loose*>(p) = v;
}
VDBFRAC_INLINE Pack all(double v) { return Pack{} + v; }
VDBFRAC_INLINE Pack root(Pack v)
{
    Pack r;
    for (int l = 0; l < kLanes; ++l) r[l] = __builtin_sqrt(v[l]);
    return r;
}
VDBFRAC_INLINE Pack magnitude(Pack v) { return v < 0 ? -v : v; }
VDBFRAC_INLINE bool any(Mask m)
{
    typedef long long Half __attribute__((vector_size(32)));
    typedef long long Quarter __attribute__((vector_size(16)));
    const Half half = __builtin_shufflevector(m, m, 0, 1, 2, 3) | __builtin_shufflevector(m, m, 4, 5, 6, 7);
    const Quarter quarter = __builtin_shufflevector(half, half, 0, 1) | __builtin_shufflevector(half, half, 2, 3);
    return (quarter[0] | quarter[1]) != 0;
}

/// Eight points, xyz after xyz, as a pack for each axis.
template <class Real>
VDBFRAC_INLINE void split(const Real* points, PackT<Real> (&v)[3])
{
    const PackT<Real> a = loadLoose(points), b = loadLoose(points + 8), c = loadLoose(points + 16);
    v[0] =
        __builtin_shufflevector(__builtin_shufflevector(a, b, 0, 3, 6, 9, 12, 15, -1, -1), c, 0, 1, 2, 3, 4, 5, 10, 13);
    v[1] = __builtin_shufflevector(__builtin_shufflevector(a, b, 1, 4, 7, 10, 13, -1, -1, -1), c, 0, 1, 2, 3, 4, 8, 11,
                                   14);
    v[2] = __builtin_shufflevector(__builtin_shufflevector(a, b, 2, 5, 8, 11, 14, -1, -1, -1), c, 0, 1, 2, 3, 4, 9, 12,
                                   15);
}

/// The other way round.
template <class Real>
VDBFRAC_INLINE void join(PackT<Real> x, PackT<Real> y, PackT<Real> z, Real* points)
{
    storeLoose(points, __builtin_shufflevector(__builtin_shufflevector(x, y, 0, 8, -1, 1, 9, -1, 2, 10), z, 0, 1, 8, 3,
                                               4, 9, 6, 7));
    storeLoose(points + 8, __builtin_shufflevector(__builtin_shufflevector(x, y, -1, 3, 11, -1, 4, 12, -1, 5), z, 10, 1,
                                                   2, 11, 4, 5, 12, 7));
    storeLoose(points + 16, __builtin_shufflevector(__builtin_shufflevector(x, y, 13, -1, 6, 14, -1, 7, 15, -1), z, 0,
                                                    13, 2, 3, 14, 5, 6, 15));
}

}  // namespace

}  // namespace vdbfrac::solver
