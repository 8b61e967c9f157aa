"""Runs Blender's Cycles with the materials of cycles_materials.py, for scripts that compare it with Halflight."""
import pathlib
import subprocess

import numpy

import exr_layers

TOOLS = pathlib.Path(__file__).resolve().parent
RENDER_SCRIPT = TOOLS.parent / "../shared/peers/cycles_render.py"


def command(scene, output, samples, seed, size, bounces, environment=None, script=RENDER_SCRIPT, view=()):
    """Returns the command that renders `scene`, by default from its first camera. `bounces` are those of Halflight; `view`
    holds the options of another camera."""
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
