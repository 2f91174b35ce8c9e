# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders one frame of a cache with motion blur, without Blender's windows.

  python render_frame.py 'dam.####.ply' FRAME OUT.png [--size WxH] [--samples N] [--still]

Needs the packages meniscus-surface and bpy (PyPI; for one version of Python each). --still: without
motion blur.
"""

import argparse
import sys
from pathlib import Path

import bpy
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))
import meniscus  # noqa: E402
import meniscus_cache  # noqa: E402
from meniscus_cache import cache  # noqa: E402


def add_light(scene, kind, energy, **settings):
    data = bpy.data.lights.new(kind, kind)
    data.energy = energy
    for name, value in settings.items():
        setattr(data, name, value)
    light = bpy.data.objects.new(kind, data)
    scene.collection.objects.link(light)
    return light


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cache")
    parser.add_argument("frame", type=int)
    parser.add_argument("out")
    parser.add_argument("--size", default="480x360")
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--still", action="store_true")
    arguments = parser.parse_args()
    width, height = map(int, arguments.size.split("x"))

    bpy.ops.wm.read_factory_settings(use_empty=True)
    meniscus_cache.register()
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = arguments.samples
    scene.cycles.use_denoising = False
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.fps = 24
    scene.render.use_motion_blur = not arguments.still
    scene.render.motion_blur_shutter = 1

    # Where Meniscus would look from at all particles of the frame.
    path = cache.frame_path(arguments.cache, arguments.frame)
    framed = meniscus.Camera.frame(meniscus.read_particles(path), size=(width, height))
    eye = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    view = framed.view
    place = -view[:3, :3].T @ view[:3, 3]
    rotation = [[*view[:3, row], place[row]] for row in range(3)] + [[0, 0, 0, 1]]
    from mathutils import Matrix

    eye.matrix_world = Matrix(rotation)
    eye.data.sensor_fit = "VERTICAL"
    eye.data.sensor_height = 24
    eye.data.lens = 12 * framed.projection[1, 1]
    eye.data.clip_end = 1e4
    scene.collection.objects.link(eye)
    scene.camera = eye

    sun = add_light(scene, "SUN", 3, angle=.1)
    sun.rotation_euler = Vector((.3, 1, .5)).to_track_quat("Z", "Y").to_euler()
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (.35, .45, .6, 1)

    bpy.context.view_layer.update()
    scene.frame_current = arguments.frame
    bpy.ops.object.meniscus_cache(filepath=arguments.cache)
    shown = bpy.data.objects["Surface"]
    water = bpy.data.materials.new("Water")
    water.use_nodes = True
    shader = water.node_tree.nodes["Principled BSDF"].inputs
    shader["Base Color"].default_value = (.05, .25, .4, 1)
    shader["Roughness"].default_value = .15
    shown.data.materials.append(water)

    scene.frame_set(arguments.frame)  # as playing the animation does
    print(f"{len(shown.data.polygons)} triangles, attributes "
          f"{sorted(a.name for a in shown.data.attributes if not a.is_internal)}")
    scene.render.filepath = str(Path(arguments.out).resolve())
    bpy.ops.render.render(write_still=True)


main()
