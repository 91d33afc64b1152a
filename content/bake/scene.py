# SPDX-License-Identifier: MIT
"""What the Mantaflow scenes beside this file share (Blender 3.4.1, headless)."""
import json
import math
import os
import sys
import time

import bpy


def arguments():
    """The key=value words after -- on Blender's command line."""
    words = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    return dict(word.split("=", 1) for word in words)


def reset(frames, fps=24):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = fps
    scene.render.fps_base = 1.0
    scene.frame_start = 1
    scene.frame_end = frames
    scene.unit_settings.system = "METRIC"
    scene.gravity = (0, 0, -9.81)
    scene.use_gravity = True


def box(name, low, high):
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=[(a + b) / 2 for a, b in zip(low, high)])
    ob = bpy.context.object
    ob.name = name
    # The size goes into the mesh, so that the object's scale stays 1.
    for vertex in ob.data.vertices:
        vertex.co = [c * (b - a) for c, a, b in zip(vertex.co, low, high)]
    return ob


def sphere(name, centre, radius, segments=48):
    bpy.ops.mesh.primitive_uv_sphere_add(
        segments=segments, ring_count=segments // 2, radius=radius, location=centre)
    bpy.context.object.name = name
    return bpy.context.object


def cylinder(name, centre, radius, depth):
    bpy.ops.mesh.primitive_cylinder_add(vertices=48, radius=radius, depth=depth, location=centre)
    bpy.context.object.name = name
    return bpy.context.object


def lathe(name, profile, segments=64):
    """A profile of (radius, height), from the axis to the axis, turned about z."""
    vertices, faces = [], []
    for i in range(segments):
        turn = 2 * math.pi * i / segments
        vertices += [(radius * math.cos(turn), radius * math.sin(turn), height) for radius, height in profile]
        here, beyond = i * len(profile), (i + 1) % segments * len(profile)
        faces += [(here + j, here + j + 1, beyond + j + 1, beyond + j) for j in range(len(profile) - 1)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    ob = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(ob)
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = ob
    ob.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.remove_doubles()  # the ends on the axis
    bpy.ops.mesh.normals_make_consistent(inside=False)
    bpy.ops.object.mode_set(mode="OBJECT")
    return ob


def flow(ob, behavior="GEOMETRY", velocity=None):
    modifier = ob.modifiers.new("Fluid", "FLUID")
    modifier.fluid_type = "FLOW"
    settings = modifier.flow_settings
    settings.flow_type = "LIQUID"
    settings.flow_behavior = behavior
    settings.subframes = 0
    settings.surface_distance = 0.0
    if velocity is not None:
        settings.use_initial_velocity = True
        settings.velocity_coord = velocity


def obstacle(ob):
    modifier = ob.modifiers.new("Fluid", "FLUID")
    modifier.fluid_type = "EFFECTOR"
    settings = modifier.effector_settings
    settings.effector_type = "COLLISION"
    settings.surface_distance = 0.0
    settings.subframes = 0


def domain(low, high, resolution, frames, cache, mesh_scale=2, particle_radius=1.0, fractions=False, tension=0.0):
    ob = box("Domain", low, high)
    modifier = ob.modifiers.new("Fluid", "FLUID")
    modifier.fluid_type = "DOMAIN"
    d = modifier.domain_settings
    d.domain_type = "LIQUID"
    d.resolution_max = resolution
    d.cache_type = "ALL"
    d.cache_frame_start = 1
    d.cache_frame_end = frames
    os.makedirs(cache, exist_ok=True)
    d.cache_directory = cache
    d.cache_mesh_format = "BOBJECT"
    d.cache_data_format = "UNI"
    d.cache_particle_format = "UNI"
    d.use_mesh = True
    d.use_speed_vectors = True
    d.mesh_scale = mesh_scale
    d.mesh_particle_radius = 2.0
    d.particle_radius = particle_radius
    d.use_fractions = fractions
    d.use_adaptive_timesteps = True
    d.timesteps_max = 4
    d.timesteps_min = 1
    d.cfl_condition = 2.0
    d.surface_tension = tension
    d.use_collision_border_top = True
    bpy.context.view_layer.objects.active = ob
    return ob


def bake(name, what, ob, low, high):
    """Runs the solver and leaves bake.json, the scene's facts, beside the cache."""
    scene = bpy.context.scene
    d = ob.modifiers["Fluid"].domain_settings
    bpy.context.view_layer.objects.active = ob
    ob.select_set(True)
    start = time.time()
    result = bpy.ops.fluid.bake_all()
    seconds = round(time.time() - start, 2)
    if "FINISHED" not in result:
        raise RuntimeError("the solver answered %s" % list(result))
    facts = {"name": name, "scene": what, "fps": scene.render.fps, "frames": scene.frame_end,
             "bake_seconds": seconds, "result": list(result), "domain_lo": list(low), "domain_hi": list(high),
             "gravity": list(scene.gravity), "blender": bpy.app.version_string, "cfl": d.cfl_condition}
    for key in ("resolution_max", "mesh_scale", "mesh_generator", "mesh_particle_radius", "mesh_concave_upper",
                "mesh_concave_lower", "mesh_smoothen_pos", "mesh_smoothen_neg", "time_scale", "timesteps_max",
                "use_fractions", "flip_ratio", "surface_tension", "cache_type", "cache_frame_start",
                "cache_frame_end"):
        facts[key] = getattr(d, key)
    with open(os.path.join(d.cache_directory, "bake.json"), "w") as f:
        json.dump(facts, f, indent=1)
    print("BAKED", name, seconds, "s")
