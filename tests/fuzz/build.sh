#!/usr/bin/env bash
# Builds targets of tests/fuzz under the address and undefined-behaviour sanitizers into build-fuzz: tests/fuzz/build.sh TARGET...
# With clang and its runtime (libclang-rt-14-dev): libFuzzer is of clang, and GCC takes far longer for the files that
# use OpenVDB. The first build takes minutes; JOBS limits how many files are compiled at once.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
sanitizers="-fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=undefined -fno-sanitize=vptr,function"
cmake -S . -B build-fuzz -G Ninja -DCMAKE_CXX_COMPILER=clang++ -DVDBFRAC_FUZZ=ON -DCMAKE_BUILD_TYPE=RelWithDebInfo \
    -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g1" -DCMAKE_CXX_FLAGS="$sanitizers" > /dev/null
cmake --build build-fuzz -j "${JOBS:-$(nproc)}" --target "$@"
