"""Checks that Blender reads the layers of an .exr, and the same layers from files in other forms.

    halflight render SCENE.glb zip.exr --aov all --aov-names blender
    halflight render SCENE.glb other.exr --aov all --aov-names blender --exr-compression piz --exr-parts
    blender -b --factory-startup -P tools/figures/blender_layers.py -- zip.exr [other.exr ...] [--tolerance 0]

Compares the passes of the first file, of one part with ZIP compression, with those that Blender's compositor takes from
it, and the other files with the first. Prints a line for each file. Exits with 1 if a pass is missing or differs by more than
--tolerance, relative to its largest value. tools/figures/blender_mattes.py checks mattes.
"""
import argparse
import os
import sys
import tempfile

import bpy
import numpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import exr_layers  # noqa: E402

LAYER = "ViewLayer"  # Blender's name of the layer whose passes --aov-names blender writes


def blenders_layers(picture):
    """Returns the channels that the compositor's node of the picture puts out: {"DiffDir": {"R": array, ...}, ...}."""
    scene = bpy.context.scene
    scene.use_nodes = True
    tree = scene.node_tree
    tree.nodes.clear()
    node = tree.nodes.new("CompositorNodeImage")
    node.image = bpy.data.images.load(os.path.abspath(picture))
    scene.render.resolution_x, scene.render.resolution_y = node.image.size
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Raw"
    node.layer = LAYER
    names = [socket.name for socket in node.outputs if socket.enabled]
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        output = tree.nodes.new("CompositorNodeOutputFile")
        output.base_path = folder
        output.format.file_format, output.format.color_depth, output.format.exr_codec = "OPEN_EXR", "32", "ZIP"
        output.format.color_mode = "RGBA"
        output.file_slots.clear()
        for i, name in enumerate(names):
            output.file_slots.new(f"layer{i}_")
            tree.links.new(node.outputs[name], output.inputs[i])
        bpy.ops.render.render()
        for i, name in enumerate(names):
            found[name] = exr_layers.read(os.path.join(folder, f"layer{i}_{scene.frame_current:04}.exr"))[2]
    return found


def expected(planes):
    """Returns the channels of Blender's passes in the file: "ViewLayer.DiffDir.R" is "R" of "DiffDir"."""
    passes = {}
    for name, values in planes.items():
        if name.startswith(LAYER + "."):
            _, of, channel = name.split(".")
            passes.setdefault(of, {})[channel] = values
    return passes


def differences(layers, others):
    """Yields the layer, and its largest difference relative to its largest value; None if the others lack it."""
    for name, channels in layers.items():
        if name not in others:
            yield name, None
            continue
        worst, largest = 0.0, 1e-30
        for channel, values in channels.items():
            # A layer of one value has that in all channels of the compositor's picture; the names of vectors differ.
            other = others[name].get(channel, others[name].get({"X": "R", "Y": "G", "Z": "B", "V": "R"}.get(channel, "")))
            if other is None or other.shape != values.shape:
                worst = numpy.inf
                continue
            finite = numpy.isfinite(values)
            worst = max(worst, float(numpy.abs(other - values)[finite].max(initial=0)))
            largest = max(largest, float(numpy.abs(values[finite]).max(initial=0)))
        yield name, worst / largest


def main():
    parser = argparse.ArgumentParser(prog="blender_layers.py")
    parser.add_argument("first")
    parser.add_argument("others", nargs="*")
    parser.add_argument("--tolerance", type=float, default=0)
    a = parser.parse_args(sys.argv[sys.argv.index("--") + 1:])
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.collection.objects.link(camera := bpy.data.objects.new("camera", bpy.data.cameras.new("camera")))
    scene.camera = camera
    first = blenders_layers(a.first)
    good = True
    cases = [(a.first, expected(exr_layers.read(a.first)[2]), first)]
    cases += [(other, first, blenders_layers(other)) for other in a.others]
    for path, layers, others in cases:
        found = dict(differences(layers, others))
        bad = {name: value for name, value in found.items() if value is None or not value <= a.tolerance}
        good = good and not bad
        print(f"{path}: {len(found) - len(bad)} of {len(found)} passes are equal" +
              "".join(f", {name} {'is missing' if v is None else f'differs by {v:.3g}'}" for name, v in bad.items()))
    sys.exit(0 if good else 1)


main()
