#!/bin/sh
# SPDX-License-Identifier: MIT
# content/bake.sh SCENE OUT [key=value...]   e.g.  content/bake.sh drop_splash build/drop res=32 frames=60
# Bakes a liquid with Blender's Mantaflow solver, installing Blender where it is missing (Debian 12).
# OUT becomes the cache as Blender wrote it (mesh/, config/) with bake.json, and OUT/ply the same frames as PLY.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
if [ $# -lt 2 ] || [ ! -f "$here/bake/$1.py" ]; then
    echo "usage: content/bake.sh SCENE OUT [res=N] [frames=N] [fps=N]; SCENE is one of:" >&2
    for scene in "$here"/bake/*.py; do
        case $(basename "$scene" .py) in scene | cache_to_ply) ;; *) basename "$scene" .py >&2 ;; esac
    done
    exit 1
fi
scene=$1
out=$2
shift 2
if [ -e "$out/mesh" ]; then
    echo "content/bake.sh: $out holds a cache already; name another folder" >&2
    exit 1
fi
sh "$here/../third_party/install.sh" bake
mkdir -p "$out"
out=$(cd "$out" && pwd)  # Blender takes a relative path as relative to its own file
if ! blender -b --python-exit-code 1 --python "$here/bake/$scene.py" -- "cache=$out" "$@" >"$out/bake.log" 2>&1; then
    tail -20 "$out/bake.log" >&2
    echo "content/bake.sh: Blender failed; all it said is in $out/bake.log" >&2
    exit 1
fi
grep BAKED "$out/bake.log"
rm -rf "$out/data" "$out/particles" "$out/noise" "$out/guiding"  # the solver's own state, not the surface
/usr/bin/python3 "$here/bake/cache_to_ply.py" "$out" "$out/ply"
