#!/usr/bin/env bash
# Installs what is needed, builds the program, tears a block and makes pictures of it. The result is in out/.
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
cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DVDBFRAC_TESTS=ON -DVDBFRAC_UNITY=ON -DVDBFRAC_KERNELS=host
cmake --build build --target vdbfrac_tool -j "$(jobs_for_build)"
build/tools/vdbfrac sim data/scenes/notched_block.toml -o out --overwrite
build/tools/vdbfrac preview out > /dev/null

echo
echo "Frames:   $PWD/out/vdb, $PWD/out/obj"
echo "Pictures: $PWD/out/preview/contact_sheet.png, and one for each frame shown there:"
for picture in out/preview/*.[0-9]*.png; do echo "  $picture"; done
