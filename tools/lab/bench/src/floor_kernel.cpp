// Compiled several times: VDBFRAC_FLOOR names the table, the compiler's options say for which vector unit.
#include "floor_kernel.h"

namespace vdbfrac::lab::bench {

extern const FloorKernel VDBFRAC_FLOOR;

namespace {

#if defined(__AVX512F__)
constexpr int kBytes = 64;
constexpr const char* kUnit = "AVX-512";
#elif defined(__AVX2__)
constexpr int kBytes = 32;
constexpr const char* kUnit = "AVX2";
#else
constexpr int kBytes = 16;
constexpr const char* kUnit = "baseline";
#endif
constexpr int kLanes = kBytes / int(sizeof(double));
constexpr int kChains = 10;  // enough to hide the latency of two units, few enough for 16 registers

typedef double Lanes __attribute__((vector_size(kBytes)));
typedef double Unaligned __attribute__((vector_size(kBytes), aligned(alignof(double)), may_alias));

Unaligned& lanesAt(double* p) { return *reinterpret_cast<Unaligned*>(p); }
const Unaligned& lanesAt(const double* p) { return *reinterpret_cast<const Unaligned*>(p); }

/// One number that all lanes of all chains have a part in.
double total(const Lanes (&chain)[kChains])
{
    double sum = 0;
    for (const Lanes& c : chain)
        for (int l = 0; l < kLanes; ++l) sum += c[l];
    return sum;
}

double readValues(const double* values, std::size_t count)
{
    constexpr std::size_t kStride = std::size_t(kChains) * kLanes;
    Lanes chain[kChains] = {};
    std::size_t i = 0;
    for (; i + kStride <= count; i += kStride)
        for (int c = 0; c < kChains; ++c) chain[c] += lanesAt(values + i + std::size_t(c * kLanes));
    double sum = total(chain);
    for (; i < count; ++i) sum += values[i];
    return sum;
}

void streamTriad(double* a, const double* b, const double* c, double s, std::size_t count)
{
    std::size_t i = 0;
    for (; i + kLanes <= count; i += kLanes) lanesAt(a + i) = lanesAt(b + i) + s * lanesAt(c + i);
    for (; i < count; ++i) a[i] = b[i] + s * c[i];
}

double multiplyAddChains(std::size_t rounds)
{
    Lanes chain[kChains], factor, term;
    for (int l = 0; l < kLanes; ++l) {
        factor[l] = 1 - 1e-9 * (l + 1);
        term[l] = 1e-9;
        for (int c = 0; c < kChains; ++c) chain[c][l] = c + 1;
    }
    for (std::size_t r = 0; r < rounds; ++r)
        for (int c = 0; c < kChains; ++c) chain[c] = chain[c] * factor + term;
    return total(chain);
}

}  // namespace

const FloorKernel VDBFRAC_FLOOR = {readValues, streamTriad, multiplyAddChains, 2. * kChains* kLanes, kUnit};

}  // namespace vdbfrac::lab::bench
