#!/usr/bin/env bash
# Runs every fuzz target (libFuzzer, ASan, UBSan) for a time, from the sound files and the breakers:
#   tests/fuzz/fuzz.sh [SECONDS_EACH] [KIND...]
# Needs clang, as build.sh says. What breaks a target is left in build-fuzz/found/KIND; the last lines
# are a table: runs, coverage (edges), files kept for the coverage they brought, peak memory.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
seconds="${1:-60}"
shift || true
kinds=("$@")
[ "${#kinds[@]}" -gt 0 ] || kinds=(scene obj stl ply off vdb checkpoint)
tests/fuzz/build.sh fuzz_driver $(printf 'fuzz_%s ' "${kinds[@]}")
fuzz=build-fuzz/tests/fuzz
"$fuzz/fuzz_driver" corpus build-fuzz/corpus

# The row of a target, out of what it printed.
row() {
    awk -v kind="$1" '/ cov: / { for (i = 1; i < NF; i++) { if ($i == "cov:") cov = $(i + 1); if ($i == "corp:") kept = $(i + 1) } }
        /number_of_executed_units/ { runs = $2 } /peak_rss_mb/ { peak = $2 }
        END { sub("/.*", "", kept); printf "%-10s %9s %9s %6s %8s\n", kind, runs, cov, kept, peak }' "$2"
}

table="$(printf '%-10s %9s %9s %6s %8s' kind runs coverage kept 'peak, MB')"
broken=0
for kind in "${kinds[@]}"; do
    mkdir -p "build-fuzz/found/$kind"
    breakers="tests/fuzz/breakers/$kind" log="build-fuzz/found/$kind.log"
    "$fuzz/fuzz_$kind" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -malloc_limit_mb=1024 -print_final_stats=1 \
        -artifact_prefix="build-fuzz/found/$kind/" "build-fuzz/corpus/$kind" $([ -d "$breakers" ] && echo "$breakers") 2>&1 | tee "$log" || broken=1
    table+=$'\n'"$(row "$kind" "$log")"
done
echo "$table"
exit "$broken"
