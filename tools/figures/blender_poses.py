"""Checks the poses of a frame against Blender's glTF import.

Measures the distance of the points of layer `position` from Blender's surfaces at that frame, relative to the extent of the
scene. Pixels beside the background are left out, because rasterizers cover some whose centres lie slightly outside.

    halflight render FOX.glb fox.####.exr --frames 7 --animation Survey --aov position,ids
    blender -b --factory-startup -P tools/figures/blender_poses.py -- FOX.glb fox.0007.exr --frame 7 --animation Survey [--fps 24]

Prints a line of JSON. Exits with 1 if the greatest distance is above --tolerance (1e-4). `greatest_at_next_frame` is the
distance from the surfaces of the next frame, and shows what a wrong pose would give.
"""
import argparse
import json
import os
import sys

import numpy
for name in ("bool", "int", "float", "object"):  # Blender 3.4's importer uses the aliases that numpy 1.24 dropped
    setattr(numpy, name, getattr(__builtins__, name) if hasattr(__builtins__, name) else __builtins__[name])
import bpy
from mathutils.bvhtree import BVHTree

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import exr_layers  # noqa: E402


def play(wanted):
    """Plays only the named glTF animation. Blender has it as NLA tracks of that name on all objects that it drives."""
    owners = [o for o in bpy.data.objects] + [k for k in bpy.data.shape_keys]
    tracks = [t for o in owners if o.animation_data for t in o.animation_data.nla_tracks]
    names = list(dict.fromkeys(t.name for t in tracks))
    for owner in owners:
        if owner.animation_data:
            owner.animation_data.action = None
    for track in tracks:
        track.mute = wanted is not None and track.name != wanted
        for strip in track.strips:  # the importer starts them at frame 1, one frame late
            late = strip.frame_start - strip.action_frame_start
            strip.frame_start -= late
            strip.frame_end -= late
    if wanted is not None and wanted not in names:
        sys.exit(f"there is no animation {wanted}, only {', '.join(names)}")


def surfaces(frame):
    """Returns the corners of all triangles at a frame, in glTF's axes, and the triangles as indices."""
    bpy.context.scene.frame_set(int(frame), subframe=frame % 1)
    graph = bpy.context.evaluated_depsgraph_get()
    corners, triangles = [], []
    for instance in graph.object_instances:
        if instance.object.type != "MESH":
            continue
        mesh = instance.object.to_mesh()
        mesh.calc_loop_triangles()
        first = len(corners)
        for vertex in mesh.vertices:
            x, y, z = instance.matrix_world @ vertex.co
            corners.append((x, z, -y))
        triangles += [tuple(first + v for v in t.vertices) for t in mesh.loop_triangles]
        instance.object.to_mesh_clear()
    return corners, triangles


def distances(frame, points):
    corners, triangles = surfaces(frame)
    tree = BVHTree.FromPolygons(corners, triangles, all_triangles=True)
    extent = float(numpy.max(numpy.ptp(numpy.array(corners), axis=0)))
    return numpy.array([tree.find_nearest(p)[3] for p in points]) / extent


def main():
    parser = argparse.ArgumentParser(prog="blender_poses.py")
    parser.add_argument("scene")
    parser.add_argument("picture", help=".exr of the frame with the layers position and ids")
    parser.add_argument("--frame", type=float, required=True)
    parser.add_argument("--fps", type=int, default=24)
    parser.add_argument("--animation", help="name (default: all)")
    parser.add_argument("--tolerance", type=float, default=1e-4)
    a = parser.parse_args(sys.argv[sys.argv.index("--") + 1:])

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = a.fps
    bpy.ops.import_scene.gltf(filepath=a.scene)
    play(a.animation)
    _, _, layers = exr_layers.read(a.picture)
    surface = numpy.pad(layers["ids.instance"] != 0xffffffff, 1)
    height, width = layers["ids.instance"].shape
    seen = numpy.all([surface[y:y + height, x:x + width] for y in range(3) for x in range(3)], axis=0)
    points = numpy.stack([layers["position." + axis][seen] for axis in "XYZ"], axis=-1).astype(numpy.float64)
    found, other = distances(a.frame, points), distances(a.frame + 1, points)
    print(json.dumps({"scene": os.path.basename(a.scene), "frame": a.frame, "points": len(points),
                      "greatest": float(found.max()), "mean": float(found.mean()),
                      "greatest_at_next_frame": float(other.max())}), flush=True)
    sys.exit(0 if len(points) and found.max() <= a.tolerance else 1)


main()
