"""Compares the shadows on shadow catchers with those of Blender's Cycles.

    halflight render SCENE.glb ours.exr --shadow-catcher floor --hide light --env sky.hdr --bounces 1 --transparent
    blender -b --factory-startup -P tools/figures/blender_catcher.py -- ours.exr SCENE.glb --catcher floor --hide light
        --env sky.hdr [--camera NAME] [--samples 256] [--tolerance 0.02]

Renders the scene with the direct light of the environment and of punctual lights, which have no size here. Compares
alpha, the part of the light that is missing, by blocks of 16x16 pixels. Prints the mean of both pictures, and the median, the
95th percentile and the maximum of the differences of blocks. Exits with 1 if a 95th percentile is above --tolerance.
Cycles counts the light of emissive surfaces as that of objects, so hide them.
"""
import argparse
import os
import sys
import tempfile

import numpy

for name in ("bool", "int", "float", "object"):  # Blender 3.4's importer uses the aliases that numpy 1.24 has dropped
    setattr(numpy, name, getattr(__builtins__, name) if hasattr(__builtins__, name) else __builtins__[name])
import bpy  # noqa: E402

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import exr_layers  # noqa: E402

BLOCK = 16


def find(name):
    found = [o for o in bpy.data.objects if o.name == name or (o.data and o.data.name == name)]
    return found or sys.exit(f"{name}: the scene has no such object")


def add_environment(scene, path):
    world = bpy.data.worlds.new("world")
    scene.world, world.use_nodes = world, True
    nodes = world.node_tree.nodes
    background = nodes["Background"]
    background.inputs[1].default_value = 1 if path else 0
    if path:
        texture = nodes.new("ShaderNodeTexEnvironment")
        texture.image = bpy.data.images.load(os.path.abspath(path))
        world.node_tree.links.new(texture.outputs[0], background.inputs[0])


def cycles_alpha(a, width, height):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=os.path.abspath(a.scene), convert_lighting_mode="COMPAT")
    scene = bpy.context.scene
    cameras = [o for o in bpy.data.objects if o.type == "CAMERA"]
    scene.camera = find(a.camera)[0] if a.camera else cameras[0]
    add_environment(scene, a.env)
    for lamp in bpy.data.lights:
        if hasattr(lamp, "shadow_soft_size"):
            lamp.shadow_soft_size = 0
    for name in a.hide:
        for hidden in find(name):
            hidden.hide_render = True
    for name in a.catcher:
        for catcher in find(name):
            catcher.is_shadow_catcher = True
    c, r = scene.cycles, scene.render
    r.engine, c.samples, c.max_bounces = "CYCLES", a.samples, 0
    c.use_denoising = c.use_adaptive_sampling = False
    c.light_sampling_threshold, c.pixel_filter_type = 0, "BOX"
    r.film_transparent = True
    r.resolution_x, r.resolution_y, r.resolution_percentage = width, height, 100
    image = r.image_settings
    image.file_format, image.color_depth, image.color_mode, image.exr_codec = "OPEN_EXR", "32", "RGBA", "ZIP"
    with tempfile.TemporaryDirectory() as folder:
        r.filepath = os.path.join(folder, "cycles.exr")
        bpy.ops.render.render(write_still=True)
        return exr_layers.read(r.filepath)[2]["A"]


def blocks(plane):
    height, width = (n - n % BLOCK for n in plane.shape)
    return plane[:height, :width].reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK).mean((1, 3))


def main():
    parser = argparse.ArgumentParser(prog="blender_catcher.py")
    parser.add_argument("picture")
    parser.add_argument("scene")
    parser.add_argument("--catcher", action="append", required=True)
    parser.add_argument("--hide", action="append", default=[])
    parser.add_argument("--env")
    parser.add_argument("--camera")
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--tolerance", type=float, default=0.02)
    a = parser.parse_args(sys.argv[sys.argv.index("--") + 1:])
    width, height, planes = exr_layers.read(a.picture)
    ours, theirs = planes["A"], cycles_alpha(a, width, height)
    differences = numpy.abs(blocks(ours) - blocks(theirs))
    high = numpy.quantile(differences, 0.95)
    print(f"alpha: ours {ours.mean():.4f}, Cycles {theirs.mean():.4f}; blocks differ by {numpy.median(differences):.4f} "
          f"(median), {high:.4f} (95 %), {differences.max():.4f} (most)")
    sys.exit(1 if high > a.tolerance else 0)


main()
