#!/usr/bin/env bash
# Installs a finished build into a folder of its own, then builds and runs tests/consumer against it.
# Usage: run.sh BUILD_DIR SOURCE_DIR
set -euo pipefail
if [ "$#" -ne 2 ]; then
    echo "usage: $0 BUILD_DIR SOURCE_DIR" >&2
    exit 2
fi
build="$1"
source="$2"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

cmake --install "$build" --prefix "$work/prefix" > "$work/install.log" || { cat "$work/install.log" >&2; exit 1; }
cmake -S "$source/tests/consumer" -B "$work/build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/prefix"
cmake --build "$work/build"
"$work/build/consumer"
"$work/prefix/bin/vdbfrac" --version
