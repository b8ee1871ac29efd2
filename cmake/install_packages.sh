#!/usr/bin/env bash
# Installs what is missing of a list of packages: cmake/packages.txt, or the one beside it that is named. Does nothing,
# quickly, when nothing is.
set -euo pipefail

list="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)/${1:-packages.txt}"
mapfile -t packages < <(sed -e 's/#.*//' -e 's/[[:space:]]//g' -e '/^$/d' "$list")

fail() {
    echo "install_packages: $1" >&2
    echo "install_packages: install these Debian packages and run this again: $2" >&2
    exit 1
}

if ! command -v dpkg-query > /dev/null; then
    fail "this is no Debian system (there is no dpkg-query), so what is installed cannot be checked" "${packages[*]}"
fi

installed="$(dpkg-query -W -f='${db:Status-Status} ${Package}\n' 2> /dev/null | sed -n 's/^installed //p' | sort -u)"
mapfile -t missing < <(printf '%s\n' "${packages[@]}" | sort -u | comm -23 - <(printf '%s\n' "$installed"))
if [ "${#missing[@]}" -eq 0 ]; then
    exit 0
fi

if [ "$(id -u)" -eq 0 ]; then
    as_root=()
elif command -v sudo > /dev/null; then
    as_root=(sudo)
else
    fail "packages are missing, and this is neither root nor is there sudo" "${missing[*]}"
fi

echo "install_packages: installing ${missing[*]}"
apt() { ${as_root[@]+"${as_root[@]}"} env DEBIAN_FRONTEND=noninteractive apt-get -q "$@"; }
apt update || fail "'apt-get update' failed" "${missing[*]}"
apt install -y --no-install-recommends "${missing[@]}" || fail "'apt-get install' failed" "${missing[*]}"
