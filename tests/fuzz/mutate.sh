#!/usr/bin/env bash
# Mutations of small valid files under the address and undefined-behaviour sanitizers: tests/fuzz/mutate.sh [COUNT] [SEED]
# Every one has to end as read or with a named error, within 10 s and the memory limit.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
cmake -S . -B build-asan -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g1" \
    -DCMAKE_CXX_FLAGS="-fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer" > /dev/null
cmake --build build-asan -j "${JOBS:-$(nproc)}" --target fuzz_driver
exec build-asan/tests/fuzz/fuzz_driver mutate "${1:-20000}" "${2:-1}"
