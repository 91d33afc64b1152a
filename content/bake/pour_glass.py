# SPDX-License-Identifier: MIT
"""A jet shoots into a glass and out of it again: sheets, fingers and droplets. cache=DIR [res=64] [frames=72] [fps=24]"""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import scene

given = scene.arguments()
frames = int(given.get("frames", 72))
low, high = (-0.8, -0.8, -0.1), (0.8, 0.8, 1.3)

scene.reset(frames, int(given.get("fps", 24)))
scene.flow(scene.cylinder("Spout", (0.1, 0, 1.1), 0.09, 0.08), behavior="INFLOW", velocity=(-0.3, 0, -0.8))
scene.obstacle(scene.lathe("Glass", [(0, 0.05), (0.30, 0.05), (0.45, 0.75), (0.55, 0.75), (0.40, -0.03), (0, -0.03)]))
tank = scene.domain(low, high, int(given.get("res", 64)), frames, given["cache"], fractions=True, tension=0.05)
scene.bake("pour_glass", "a jet into a glass", tank, low, high)
