# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows a particle cache as the surface that the scene's camera sees, frame by frame.

The mesh carries the attribute `velocity`, from which Cycles blurs motion though every frame has other
vertices. It belongs to its camera: it is made anew for each frame and is open where the camera sees no
further.
"""

import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy.props import BoolProperty, FloatProperty, PointerProperty, StringProperty

from . import cache


class MeniscusCache(bpy.types.PropertyGroup):
    """What an object shows; it does where the path is not empty."""

    path: StringProperty(name="Cache", subtype="FILE_PATH",
                         description="Files of particles, #### for the frame's number")
    particle_radius: FloatProperty(name="Particle radius", min=0, precision=5,
                                   description="Half the particles' spacing; 0: the file's")
    cell: FloatProperty(name="Cell", default=2, min=.25, max=256,
                        description="Size of the mesh's cells, pixels of the image")
    smooth: BoolProperty(name="Surface's normals", default=True,
                         description="Shade by the surface's own normals")


def camera_of(scene, depsgraph, shown):
    """The scene's camera in the object's space."""
    if scene.camera is None:
        raise RuntimeError("the scene has no camera, whose view the surface is of")
    render = scene.render
    width = max(1, render.resolution_x * render.resolution_percentage // 100)
    height = max(1, render.resolution_y * render.resolution_percentage // 100)
    eye = scene.camera.evaluated_get(depsgraph)
    projection = eye.calc_matrix_camera(depsgraph, x=width, y=height,
                                        scale_x=render.pixel_aspect_x,
                                        scale_y=render.pixel_aspect_y)
    return cache.camera_of(eye.matrix_world.inverted() @ shown.matrix_world, projection, width,
                           height)


def fill(mesh, made, smooth):
    """Puts what was made into Blender's mesh, or nothing where the cache has no such frame."""
    mesh.clear_geometry()
    if made is None or len(made.triangles) == 0:
        return
    mesh.vertices.add(len(made.positions))
    mesh.vertices.foreach_set("co", made.positions.ravel())
    corners = made.triangles.astype(np.int32).ravel()
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners)
    mesh.polygons.add(len(made.triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, len(corners), 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    if made.velocities is not None:
        velocity = mesh.attributes.new("velocity", "FLOAT_VECTOR", "POINT")
        velocity.data.foreach_set("vector", made.velocities.ravel())
    if smooth:
        mesh.shade_smooth()
        mesh.normals_split_custom_set_from_vertices(made.normals)


def show(scene, depsgraph, shown):
    settings = shown.meniscus
    made = cache.mesh_of(bpy.path.abspath(settings.path), scene.frame_current,
                         camera_of(scene, depsgraph, shown), settings.particle_radius,
                         settings.cell)
    fill(shown.data, made, settings.smooth)


@persistent
def on_frame(scene, depsgraph=None):
    for shown in scene.objects:
        if shown.type == "MESH" and shown.meniscus.path:
            show(scene, depsgraph or bpy.context.evaluated_depsgraph_get(), shown)


class OBJECT_OT_meniscus_cache(bpy.types.Operator):
    """Adds an object that shows a particle cache as a surface"""

    bl_idname = "object.meniscus_cache"
    bl_label = "Meniscus cache"
    bl_options = {"REGISTER", "UNDO"}

    filepath: StringProperty(subtype="FILE_PATH")
    particle_radius: FloatProperty(name="Particle radius", min=0, precision=5)

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        shown = bpy.data.objects.new("Surface", bpy.data.meshes.new("Surface"))
        context.collection.objects.link(shown)
        shown.meniscus.path = self.filepath
        shown.meniscus.particle_radius = self.particle_radius
        try:
            show(context.scene, context.evaluated_depsgraph_get(), shown)
        except (cache.meniscus.Error, RuntimeError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class OBJECT_PT_meniscus(bpy.types.Panel):
    bl_label = "Meniscus cache"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "object"

    def draw(self, context):
        column = self.layout.column()
        for name in ("path", "particle_radius", "cell", "smooth"):
            column.prop(context.object.meniscus, name)


CLASSES = (MeniscusCache, OBJECT_OT_meniscus_cache, OBJECT_PT_meniscus)


def add_to_menu(menu, context):
    menu.layout.operator(OBJECT_OT_meniscus_cache.bl_idname, icon="MATFLUID")


def register():
    for one in CLASSES:
        bpy.utils.register_class(one)
    bpy.types.Object.meniscus = PointerProperty(type=MeniscusCache)
    bpy.types.VIEW3D_MT_add.append(add_to_menu)
    bpy.app.handlers.frame_change_post.append(on_frame)


def unregister():
    bpy.app.handlers.frame_change_post.remove(on_frame)
    bpy.types.VIEW3D_MT_add.remove(add_to_menu)
    del bpy.types.Object.meniscus
    for one in reversed(CLASSES):
        bpy.utils.unregister_class(one)
