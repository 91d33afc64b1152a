# SPDX-License-Identifier: MIT
"""A stream pours onto a sphere and pools below. cache=DIR [res=64] [frames=100] [fps=24]"""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import scene

given = scene.arguments()
frames = int(given.get("frames", 100))
low, high = (-1.0, -1.0, 0.0), (1.0, 1.0, 2.4)

scene.reset(frames, int(given.get("fps", 24)))
scene.flow(scene.cylinder("Spout", (0.06, 0.03, 2.18), 0.16, 0.16), behavior="INFLOW", velocity=(0.0, 0.0, -1.5))
scene.obstacle(scene.sphere("Ball", (0.0, 0.0, 1.0), 0.42))
tank = scene.domain(low, high, int(given.get("res", 64)), frames, given["cache"],
                    mesh_scale=int(given.get("mesh_scale", 2)), particle_radius=0.7)
scene.bake("pour_sphere", "inflow stream onto a static sphere", tank, low, high)
