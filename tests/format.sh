#!/usr/bin/env bash
# format.sh SOURCE: every C++ file is formatted as .clang-format says, by Debian 12's clang-format.
set -euo pipefail
cd "$1"
find solver tetmesh tests tools vdbfrac -name '*.h' -o -name '*.cpp' | sort | xargs clang-format --dry-run -Werror
