# SPDX-License-Identifier: MIT
"""A sphere of liquid falls into a shallow pool: crown and splash. cache=DIR [res=72] [frames=80] [fps=24]"""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import scene

given = scene.arguments()
frames = int(given.get("frames", 80))
low, high = (1.0, -2.0, 0.0), (5.0, 2.0, 3.0)  # deliberately not around the origin

scene.reset(frames, int(given.get("fps", 24)))
scene.flow(scene.box("Pool", (1.05, -1.95, 0.05), (4.95, 1.95, 0.55)))
scene.flow(scene.sphere("Drop", (3.1, 0.1, 2.05), 0.5))
tank = scene.domain(low, high, int(given.get("res", 72)), frames, given["cache"],
                    mesh_scale=int(given.get("mesh_scale", 2)), particle_radius=0.8)
scene.bake("drop_splash", "liquid sphere falling into a shallow pool", tank, low, high)
