#!/bin/sh
# SPDX-License-Identifier: MIT
# tests/run.sh [PRESET...]: installs what is missing, builds and runs the tests; without a preset: release,
# then, built by clang, under the address and undefined-behaviour sanitizers, with half a minute of each fuzz target,
# then the threaded ones under the thread sanitizer. Also: debug.
set -eu
cd "$(dirname "$0")/.."
[ $# -gt 0 ] || set -- release asan tsan
sh third_party/install.sh
# Not everybody has it, so not everybody needs it; where it can be had its reader is tested, too.
sh third_party/install.sh openvdb || echo "tests/run.sh: the OpenVDB reader is not tested" >&2
command -v ccache >/dev/null && export CMAKE_CXX_COMPILER_LAUNCHER=ccache

# The thread sanitizer of GCC 12 cannot place its memory where newer kernels randomise more address bits.
fixed=
[ -n "$(setarch -R true 2>&1 || echo no)" ] || fixed="setarch -R"

suite() {  # configures, builds, tests one preset
    wrap=
    [ "$1" != tsan ] || wrap=$fixed
    cmake --preset "$1" >"build/$1.log" 2>&1 || { cat "build/$1.log"; return 1; }
    cmake --build --preset "$1" || return 1
    $wrap ctest --preset "$1" --parallel "$(nproc)" || return 1
}
mkdir -p build
failed=
for preset; do
    echo "=== $preset"
    suite "$preset" || failed="$failed $preset"
done
if [ -n "$failed" ]; then
    echo "tests/run.sh: FAILED:$failed" >&2
    exit 1
fi
echo "tests/run.sh: passed: $*"
