# SPDX-License-Identifier: MIT
"""A column of liquid collapses onto a box in a closed tank. cache=DIR [res=64] [frames=100] [fps=24]"""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import scene

given = scene.arguments()
frames = int(given.get("frames", 100))
low, high = (-1.0, -0.5, 0.0), (1.0, 0.5, 1.0)

scene.reset(frames, int(given.get("fps", 24)))
scene.flow(scene.box("Column", (-0.96, -0.46, 0.04), (-0.40, 0.46, 0.86)))
scene.obstacle(scene.box("Block", (0.22, -0.18, -0.05), (0.46, 0.18, 0.30)))
# With Blender's default particle radius of 1.0 this scene gains 160 % volume in 100 frames.
tank = scene.domain(low, high, int(given.get("res", 64)), frames, given["cache"],
                    mesh_scale=int(given.get("mesh_scale", 2)), particle_radius=0.65)
scene.bake("dam_break", "column collapsing onto a static box", tank, low, high)
