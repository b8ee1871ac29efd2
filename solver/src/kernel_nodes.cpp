// The part of a kernel that has passes over nodes, and the kernel that all its parts make up.
#include "kernel_parts.h"
#include "node_passes.h"

namespace vdbfrac::solver {

namespace {

template <class Real>
void readAll(const PatchData& patch, const Real* points, Real* in)
{
    for (const NodeRun* run = patch.run; run != patch.run + patch.runs; ++run) {
        const Real* from = points + 3 * std::size_t(run->node);
        int i = run->local;
        const int end = i + run->count;
        for (; i + kLanes <= end; i += kLanes, from += 3 * kLanes) {
            PackT<Real> v[3];
            split(from, v);
            for (int d = 0; d < 3; ++d) storeLoose(in + d * patch.stride + i, v[d]);
        }
        for (; i < end; ++i, from += 3)
            for (int d = 0; d < 3; ++d) in[d * patch.stride + i] = from[d];
    }
    for (int d = 0; d < 3; ++d)
        for (int i = patch.nodes; i < patch.stride; ++i) in[d * patch.stride + i] = 0;
}

template <class Real>
void writeAll(const PatchData& patch, const Real* out, Real* points)
{
    for (int i = 0; i < patch.nodes; i += kLanes, points += 3 * kLanes)
        join(loadLoose(out + i), loadLoose(out + patch.stride + i), loadLoose(out + 2 * patch.stride + i), points);
}

template <class Real>
constexpr VectorKernel<Real> kVectors = {readAll<Real>, writeAll<Real>, VDBFRAC_KERNEL::product, updateResidual<Real>,
                                         updateDirection<Real>};

}  // namespace

#define VDBFRAC_TEXT2(x) #x
#define VDBFRAC_TEXT(x) VDBFRAC_TEXT2(x)

namespace VDBFRAC_KERNEL {
extern const Kernel kernel;
const Kernel kernel = {evaluate,         diagonal,        averageTets, polar,
                       kVectors<double>, kVectors<float>, smoothNodes, VDBFRAC_TEXT(VDBFRAC_KERNEL)};
}  // namespace VDBFRAC_KERNEL

}  // namespace vdbfrac::solver
