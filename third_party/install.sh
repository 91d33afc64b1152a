#!/bin/sh
# SPDX-License-Identifier: MIT
# third_party/install.sh [GROUP...]: installs the packages of packages.txt that are missing (Debian 12).
# Without a group: everything needed to build, play and test. Touches nothing when all are there.
set -eu
list=$(dirname "$0")/packages.txt
[ $# -gt 0 ] || set -- build runtime cooker player tests

if ! command -v dpkg-query >/dev/null; then
    echo "install.sh: no Debian package manager here; provide the packages of $list yourself" >&2
    exit 0  # CMake names what it cannot find
fi

missing=
for group; do
    packages=$(awk -v group="[$group]" '
        /^\[/ { inside = ($0 == group); found += inside; next }
        inside && /^[^#]/ { print $1 }
        END { exit !found }' "$list") || { echo "install.sh: no group '$group' in $list" >&2; exit 1; }
    for package in $packages; do
        [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] ||
            missing="$missing $package"
    done
done
[ -n "$missing" ] || exit 0

echo "install.sh: installing$missing"
as_root=
if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
        echo "install.sh: needs root or sudo to run: apt-get install$missing" >&2
        exit 1
    fi
    as_root=sudo
fi
apt() {
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get -q -o DPkg::Lock::Timeout=300 -o Acquire::Retries=3 "$@"
}
log=$(mktemp)
trap 'rm -f "$log"' EXIT
# shellcheck disable=SC2086  # a list of words
{ apt update && apt install -y --no-install-recommends $missing; } </dev/null >"$log" 2>&1 || {
    cat "$log" >&2
    echo "install.sh: could not install$missing" >&2
    exit 1
}
