// The part of a kernel that has products in single precision.
#include "kernel_product.h"

double vdbfrac::solver::VDBFRAC_KERNEL::product(const PatchData& patch, const float* in, float* out)
{
    return productAll(patch, in, out);
}
