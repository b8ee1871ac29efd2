#!/usr/bin/env bash
# Installs what is needed, builds everything and runs the tests. Arguments go to ctest: ./run_tests.sh -L unit
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

# As many jobs as cores, but no more than one for each 2 GiB of free memory: some files are heavy to compile.
jobs_for_build() {
    local cores memory
    cores="$(nproc)"
    memory="$(awk '/^MemAvailable:/ { print int($2 / 2097152) }' /proc/meminfo)"
    if [ "${memory:-1}" -lt 1 ]; then memory=1; fi
    echo "$((cores < memory ? cores : memory))"
}

./cmake/install_packages.sh
./cmake/install_packages.sh test_packages.txt || echo "run_tests: tests that need what is missing of cmake/test_packages.txt are skipped"
cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DVDBFRAC_TESTS=ON -DVDBFRAC_UNITY=ON -DVDBFRAC_KERNELS=all
cmake --build build -j "$(jobs_for_build)"
cd build
# Two tests at a time, for many use all cores by themselves. ctest ends with a summary by label.
ctest -j 2 --output-on-failure --no-tests=error "$@"
