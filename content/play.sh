#!/bin/sh
# SPDX-License-Identifier: MIT
# content/play.sh [INPUT] [rill-player options...]: installs what is missing, builds Rill, cooks INPUT (default:
# the liquid beside this file) and plays it: in a window where there is a display, as PNG pictures where there is none.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
input=$here/drop_splash
if [ $# -gt 0 ] && [ -e "$1" ]; then
    input=$(cd "$(dirname "$1")" && pwd)/$(basename "$1")
    shift
fi
cd "$here/.."
sh third_party/install.sh
command -v ccache >/dev/null && export CMAKE_CXX_COMPILER_LAUNCHER=ccache
cmake --preset release >/dev/null
cmake --build --preset release --target rill rill-player

name=$(basename "$input")
name=${name%.*}
asset=build/play/$name.rill
mkdir -p build/play
if [ ! -e "$asset" ] || [ -n "$(find "$input" build/release/cooker/rill -newer "$asset" | head -n 1)" ]; then
    build/release/cooker/rill cook "$input" -o "$asset" || [ $? -eq 3 ]  # 3: done, but a little less exact than asked for
fi
build/release/cooker/rill info "$asset"
if [ -n "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ]; then
    exec build/release/sample_app/rill-player "$asset" "$@"
fi
pictures=build/play/$name
mkdir -p "$pictures"
echo "No display here: drawing the frames as pictures."
build/release/sample_app/rill-player "$asset" --headless --size 960x540 --out "$pictures/frame_%04d.png" \
    --contact-sheet "$pictures.png" "$@"
echo "Frames:        $PWD/$pictures/"
echo "Contact sheet: $PWD/$pictures.png"
