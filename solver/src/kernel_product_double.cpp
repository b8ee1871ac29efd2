// The part of a kernel that has products in double precision.
#include "kernel_product.h"

double vdbfrac::solver::VDBFRAC_KERNEL::product(const PatchData& patch, const double* in, double* out)
{
    return productAll(patch, in, out);
}
