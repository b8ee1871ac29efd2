#!/usr/bin/env bash
# Mutations of small valid files under the address and undefined-behaviour sanitizers: tests/fuzz/mutate.sh [COUNT [SEED [KIND]]]
# What the commands do with every one of them has to end as done or with a named error, within 10 s and the memory limit.
# Needs clang, as build.sh says.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
tests/fuzz/build.sh fuzz_driver
build-fuzz/tests/fuzz/fuzz_driver mutate "${1:-20000}" "${@:2}"
