#!/usr/bin/env bash
# Runs every fuzz target (libFuzzer, ASan, UBSan) for a time, from the sound files and the breakers:
#   tests/fuzz/fuzz.sh [SECONDS_EACH] [KIND...]
# Needs clang and its runtime (libclang-rt-14-dev). What breaks a target is left in build-fuzz/found/KIND.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
seconds="${1:-60}"
shift || true
kinds=("$@")
[ "${#kinds[@]}" -gt 0 ] || kinds=(scene obj stl ply off vdb)
sanitizers="-fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=undefined -fno-sanitize=vptr,function"
cmake -S . -B build-fuzz -G Ninja -DCMAKE_CXX_COMPILER=clang++ -DVDBFRAC_FUZZ=ON -DCMAKE_BUILD_TYPE=RelWithDebInfo \
    -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g1" -DCMAKE_CXX_FLAGS="$sanitizers" > /dev/null
cmake --build build-fuzz -j "${JOBS:-$(nproc)}" --target fuzz_driver $(printf 'fuzz_%s ' "${kinds[@]}")
fuzz=build-fuzz/tests/fuzz
"$fuzz/fuzz_driver" corpus build-fuzz/corpus
for kind in "${kinds[@]}"; do
    mkdir -p "build-fuzz/found/$kind"
    breakers="tests/fuzz/breakers/$kind"
    "$fuzz/fuzz_$kind" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -malloc_limit_mb=1024 -print_final_stats=1 \
        -artifact_prefix="build-fuzz/found/$kind/" "build-fuzz/corpus/$kind" $([ -d "$breakers" ] && echo "$breakers")
done
