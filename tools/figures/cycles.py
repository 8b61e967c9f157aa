"""Runs Blender's Cycles with the materials of cycles_materials.py, for scripts that compare it with Halflight."""
import pathlib
import struct
import subprocess

import numpy

import exr_layers

TOOLS = pathlib.Path(__file__).resolve().parent
RENDER_SCRIPT = TOOLS.parents[1] / "../shared/peers/cycles_render.py"


def constant_map(radiance, file):
    """Writes a picture of one colour, radiance "r,g,b", for Blender: OpenEXR, 2x1 pixels, uncompressed floats."""
    def attribute(name, kind, value):
        return b"%s\0%s\0%s" % (name, kind, struct.pack("<I", len(value)) + value)

    box, channels = struct.pack("<4i", 0, 0, 1, 0), b"".join(b"%c\0" % c + struct.pack("<4I", 2, 0, 1, 1) for c in b"BGR")
    header = struct.pack("<2I", 20000630, 2) + b"".join(attribute(*words) for words in (
        (b"channels", b"chlist", channels + b"\0"), (b"compression", b"compression", b"\0"), (b"dataWindow", b"box2i", box),
        (b"displayWindow", b"box2i", box), (b"lineOrder", b"lineOrder", b"\0"),
        (b"pixelAspectRatio", b"float", struct.pack("<f", 1)), (b"screenWindowCenter", b"v2f", struct.pack("<2f", 0, 0)),
        (b"screenWindowWidth", b"float", struct.pack("<f", 1)))) + b"\0"
    red, green, blue = (float(value) for value in radiance.split(","))
    row = struct.pack("<6f", blue, blue, green, green, red, red)
    file.write_bytes(header + struct.pack("<Q", len(header) + 8) + struct.pack("<iI", 0, len(row)) + row)
    return file


def command(scene, output, samples, seed, size, bounces, environment=None, script=RENDER_SCRIPT, view=()):
    """Returns the command that renders `scene`, by default from its first camera. `bounces` are those of Halflight; `view`
    holds the options of another camera. A constant environment "r,g,b" becomes a map beside the output."""
    if isinstance(environment, str) and environment.count(",") == 2:
        environment = constant_map(environment, pathlib.Path(output).with_suffix(".env.exr"))
    words = ["blender", "-b", "--factory-startup", "-P", TOOLS / "cycles_materials.py", "-P", script, "--", scene, output,
             "--spp", samples, "--seed", seed, "--size", f"{size[0]}x{size[1]}", "--bounces", bounces - 1, *view]
    return [str(word) for word in words + (["--env", environment] if environment else [])]


def render(*arguments, **options):
    """Renders as `command` says. Blender ends with status 0 after errors, so what counts is whether it wrote the file."""
    words = command(*arguments, **options)
    output = pathlib.Path(arguments[1])
    output.unlink(missing_ok=True)
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode or not output.exists():
        raise SystemExit(f"Cycles failed: {done.stderr or done.stdout}")
    return done.stdout


def rgb(picture):
    _, _, channels = exr_layers.read(picture)
    return numpy.stack([channels[name] for name in "RGB"]).astype(float)
