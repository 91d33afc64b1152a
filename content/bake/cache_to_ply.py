#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""cache_to_ply.py CACHE OUT: a Mantaflow liquid cache as binary PLY frames in metres and metres per second.

x y z vx vy vz per vertex, triangles. Frame rate and time scale come from CACHE/bake.json; 24 and 1 without it.
A second opinion beside Rill's own reader of these caches, which shares no code with it."""
import glob
import gzip
import json
import os
import struct
import sys

import numpy as np

cache, out = sys.argv[1:3]
os.makedirs(out, exist_ok=True)
facts = {"fps": 24, "time_scale": 1.0}
if os.path.exists(cache + "/bake.json"):
    with open(cache + "/bake.json") as f:
        facts.update(json.load(f))


def unzipped(path):
    with gzip.open(path) as f:
        return f.read()


def floats(data, offset, count):
    return np.frombuffer(data, "<f4", count, offset)


paths = sorted(glob.glob(cache + "/mesh/fluid_mesh_*.bobj.gz"))
if not paths:
    sys.exit("no mesh/fluid_mesh_*.bobj.gz in " + cache)
for path in paths:
    number = path[-12:-8]
    mesh = unzipped(path)
    vertices, = struct.unpack_from("<i", mesh, 0)
    positions = floats(mesh, 4, 3 * vertices).reshape(-1, 3)
    count, = struct.unpack_from("<i", mesh, 8 + 24 * vertices)
    triangles = np.frombuffer(mesh, "<i4", 3 * count, 12 + 24 * vertices).reshape(-1, 3)
    velocity = floats(unzipped(f"{cache}/mesh/lVelMesh_{number}.uni"), 292, 3 * vertices).reshape(-1, 3)

    # Positions: the domain's longest side has length 1. Velocities: base-grid cells per Mantaflow time unit.
    config = unzipped(f"{cache}/config/config_{number}.uni")
    resolution = max(struct.unpack_from("<3i", config, 4))
    side = floats(config, 36, 3) - floats(config, 24, 3)
    matrix = floats(config, 84, 16).reshape(4, 4)
    scale = np.linalg.norm(matrix[:3, :3], axis=1)
    longest = float((side * scale).max())
    world = (positions * longest / scale) @ matrix[:3, :3] + matrix[3, :3]
    rotation = matrix[:3, :3] / scale[:, None]
    speed = (velocity * (longest / resolution) * 2.5 * facts["time_scale"]) @ rotation

    faces = np.empty(count, dtype=[("k", "u1"), ("i", "<i4", 3)])
    faces["k"], faces["i"] = 3, triangles
    header = ("ply\nformat binary_little_endian 1.0\n"
              f"comment metres, metres per second, {facts['fps']:g} frames per second\n"
              f"element vertex {vertices}\n"
              + "".join(f"property float {p}\n" for p in ("x", "y", "z", "vx", "vy", "vz"))
              + f"element face {count}\nproperty list uchar int vertex_indices\nend_header\n")
    with open(f"{out}/frame_{number}.ply", "wb") as f:
        f.write(header.encode() + np.hstack([world, speed]).astype("<f4").tobytes() + faces.tobytes())
with open(out + "/sequence.json", "w") as f:
    json.dump({"fps": facts["fps"], "frames": len(paths), "file_pattern": "frame_%04d.ply"}, f)
print(len(paths), "frames ->", out)
