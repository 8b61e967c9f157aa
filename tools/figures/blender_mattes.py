"""Checks that Blender's Cryptomatte node takes the mattes from an .exr that the specification defines.

    halflight render SCENE.glb mattes.exr --aov cryptoobject
    blender -b --factory-startup -P tools/figures/blender_mattes.py -- mattes.exr NAME... [--layer CryptoObject]

Prints a line of JSON for each name. Exits with 1 if a pixel differs by more than --tolerance (1e-5) or a matte is empty.
"""
import argparse
import json
import os
import sys
import tempfile

import bpy
import numpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import exr_layers  # noqa: E402


def blenders_matte(picture, layer, name, size):
    """Returns the coverage that the compositor computes."""
    scene = bpy.context.scene
    scene.use_nodes = True
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    tree = scene.node_tree
    tree.nodes.clear()
    node = tree.nodes.new("CompositorNodeCryptomatteV2")
    node.source = "IMAGE"
    node.image = bpy.data.images.load(picture, check_existing=True)
    node.layer_name = layer
    node.matte_id = name
    output = tree.nodes.new("CompositorNodeComposite")
    tree.links.new(node.outputs["Matte"], output.inputs["Image"])
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.color_mode = "RGB"
    scene.render.image_settings.exr_codec = "ZIP"
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = os.path.join(folder, "matte.exr")
        bpy.ops.render.render(write_still=True)
        return exr_layers.read(scene.render.filepath)[2]["R"]


def our_matte(layers, layer, identity):
    """Returns the sum of the coverage of all ranks that have this id, as the specification defines it."""
    matte = 0
    for rank in range(6):
        plane = f"{layer}{rank // 2:02}."
        ids, coverage = (layers[plane + c] for c in ("RG" if rank % 2 == 0 else "BA"))
        matte = matte + numpy.where(ids.view(numpy.uint32) == identity, coverage, 0)
    return matte


def main():
    parser = argparse.ArgumentParser(prog="blender_mattes.py")
    parser.add_argument("picture")
    parser.add_argument("names", nargs="+")
    parser.add_argument("--layer", default="CryptoObject")
    parser.add_argument("--tolerance", type=float, default=1e-5)
    a = parser.parse_args(sys.argv[sys.argv.index("--") + 1:])

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.collection.objects.link(camera := bpy.data.objects.new("camera", bpy.data.cameras.new("camera")))
    scene.camera = camera
    width, height, layers = exr_layers.read(a.picture)
    try:
        ids = exr_layers.manifest(a.picture, a.layer)
    except KeyError as error:
        sys.exit(f"blender_mattes.py: {error.args[0]}")
    for name in a.names:
        if name not in ids:
            sys.exit(f"blender_mattes.py: {a.picture}: {a.layer} has no {name!r}, only {', '.join(sorted(ids))}")
    good = True
    for name in a.names:
        theirs = blenders_matte(os.path.abspath(a.picture), a.layer, name, (width, height))
        ours = our_matte(layers, a.layer, ids[name])
        difference = float(numpy.abs(theirs - ours).max())
        print(json.dumps({"name": name, "coverage": float(ours.sum()), "blenders_coverage": float(theirs.sum()),
                          "partly_covered_pixels": int(((ours > 0) & (ours < 1)).sum()),
                          "greatest_difference": difference}), flush=True)
        good = good and difference <= a.tolerance and ours.any()
    sys.exit(0 if good else 1)


main()
