#!/usr/bin/env python3
"""compare_drivers.py CHECKOUT PROGRAM: compares pictures of Mesa's zink on lavapipe with those of llvmpipe.

On zink, all culling methods must give the same bits. Between the drivers, pixels may differ by the rounding of arithmetic.
A rounding can also send a path elsewhere, so a few pixels may differ by more. Prints a row per scene.
"""
import hashlib
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy

SKIPPED = 77  # exit status of a test that cannot run
SCENES = ["cornell.glb --estimator reuse=16", "still-life.glb --bounces 3", "atrium.glb --camera nave --bounces 2"]
METHODS = ["off", "compute", "raster", "native"]
ZINK = {"MESA_LOADER_DRIVER_OVERRIDE": "zink", "LIBGL_ALWAYS_SOFTWARE": "1"}
NOISE = 1e-4  # relative difference that rounding alone does not reach
MOST_APART = 0.01  # part of the pixels that may differ by more


def render(program, scene, method, output, environment):
    words = scene.split()
    return subprocess.run([program, "render", *words, output, "--width", "48", "--height", "32", "--samples", "2", "--quiet",
                           "--reproducible", "--culling", method, *environment.pop("OPTIONS", "").split()],
                          env={**os.environ, **environment}, capture_output=True, text=True)


def main():
    checkout, program = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2]
    sys.path.insert(0, str(checkout / "tools/figures"))
    import exr_layers

    failed = False
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        environment = {"XDG_CACHE_HOME": str(folder), "XDG_RUNTIME_DIR": str(folder)}
        for scene in SCENES:
            def picture(name, method, more):
                path = folder / f"{name}.exr"
                path.unlink(missing_ok=True)
                done = render(program, f"{checkout}/scenes/{scene}", method, path, {**environment, **more})
                if done.returncode and "no OpenGL 4.5 context" in done.stderr:
                    print("there is no zink (Debian's mesa-vulkan-drivers):", done.stderr.strip())
                    sys.exit(SKIPPED)
                if done.returncode:
                    sys.exit(f"{scene}, {name}, {method}: exit status {done.returncode}\n{done.stderr}")
                _, _, layers = exr_layers.read(path)
                return numpy.stack([layers[c] for c in "RGB"])

            reference = picture("llvmpipe", "off", {"OPTIONS": "--device llvmpipe"})
            pictures = [picture("zink", method, {**ZINK, "OPTIONS": "--device zink"}) for method in METHODS]
            hashes = {hashlib.sha256(p.tobytes()).hexdigest() for p in pictures}
            scale = numpy.maximum(numpy.abs(reference).max(axis=0), reference.mean())
            apart = numpy.abs(pictures[0] - reference).max(axis=0) / scale
            many = (apart > NOISE).mean()
            print(f"{scene}: {len(hashes)} picture by {len(METHODS)} methods; median difference {numpy.median(apart):.1e}, "
                  f"{100 * many:.2f} % of the pixels above {NOISE:g}, mean {pictures[0].mean() / reference.mean() - 1:+.1e}")
            failed |= len(hashes) != 1 or many > MOST_APART or not numpy.isfinite(pictures[0]).all()
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
