"""Calls the entry points of the Python module with random arguments.

usage: python3 python_calls.py [--seconds S] [--seed N] [--calls N] [--note FILE]

Each call has a seed of its own, which follows from N and the call's number. Only Error, TypeError, ValueError, KeyError,
IndexError and OverflowError may come out, and Error has one line. The seed of the call in progress is in FILE, for calls that
end the process; --seed S --calls 1 repeats it. Prints number_of_executed_units, as libFuzzer does. The exit status is 1 after a
finding.
"""
import argparse
import os
import pathlib
import random
import shutil
import sys
import tempfile
import time

import numpy

import halflight as hl

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SCENE = pathlib.Path(tempfile.mkdtemp()) / "cornell.glb"  # a copy, which calls may write to
ALLOWED = (hl.Error, TypeError, ValueError, KeyError, IndexError, OverflowError)


class Text:
    """An object whose text raises."""

    def __str__(self):
        raise ValueError("no text")


class Sequence:
    """A sequence that raises while it is read, or never ends in its length."""

    def __len__(self):
        return 1 << 40

    def __getitem__(self, index):
        raise IndexError("no element") if index > 2 else ValueError("no number")


def value(dice, depth=0):
    """Returns a random value, often one at the edge of what a parameter takes."""
    kind = dice.randrange(12 if depth < 2 else 9)
    if kind == 0:
        return dice.choice([0, 1, -1, 2, 7, 2**31 - 1, 2**31, -(2**31), 2**32, 2**63, 2**64, -(2**63) - 1, 10**400])
    if kind == 1:
        return dice.choice([0.0, -0.0, 0.5, 1.0, -1.0, 1e-300, 1e300, float("nan"), float("inf"), -float("inf")])
    if kind == 2:
        return dice.choice(["", "0", "1", "all", "none", "auto", "floor", "a\0b", "\udcff", "x" * 100000, "1-3", "1-4x0",
                            "nan", "inf", "../..", "/dev/zero", "\n", "é", str(SCENE)])
    if kind == 3:
        return dice.choice([None, True, False])
    if kind == 4:
        return dice.choice([b"", b"abc", bytearray(3), memoryview(b"12")])
    if kind == 5:
        return dice.choice([numpy.float32(1.5), numpy.int64(-3), numpy.zeros(3), numpy.eye(4), numpy.zeros((2, 2)),
                            numpy.full(4, numpy.nan), numpy.array([], dtype=object)])
    if kind == 6:
        return dice.choice([object(), Text(), Sequence(), int, len, SCENE, pathlib.Path("."), range(3), 1j, Ellipsis])
    if kind == 7:
        return tuple(dice.choice([0, 1, 0.5, -1, 1e9, float("nan")]) for _ in range(dice.randrange(6)))
    if kind == 8:
        return [[dice.choice([0, 1, 1e300, float("inf")]) for _ in range(4)] for _ in range(dice.randrange(3, 6))]
    if kind == 9:
        return [value(dice, depth + 1) for _ in range(dice.randrange(4))]
    if kind == 10:
        return {dice.choice(["a", "roughness", 3, None]): value(dice, depth + 1) for _ in range(dice.randrange(3))}
    return (item for item in [value(dice, depth + 1)])


def some(dice, **usual):
    """Returns keyword arguments: each with its usual value, with a random one, or left out."""
    chosen = {}
    for name, likely in usual.items():
        what = dice.random()
        if what < 0.5:
            chosen[name] = likely
        elif what < 0.75:
            chosen[name] = value(dice)
    return chosen


class Calls:
    """The entry points, with a scene and a renderer that live through many calls."""

    def __init__(self, folder):
        self.folder = folder
        self.scene = hl.load(SCENE)
        self.renderer = hl.Renderer(self.scene, layers=["normal"], width=4, height=4, samples=1)
        self.settings = [s.name for s in hl.settings()]
        self.all = [getattr(self, name) for name in dir(self) if name.startswith("call_")]
        public = {name: what for name, what in vars(hl.Scene).items() if not name.startswith("_")}
        self.properties = [name for name, what in public.items() if isinstance(what, property)]
        missing = [name for name in public if name not in self.properties and not hasattr(self, f"call_{name}")]
        if missing:
            raise SystemExit(f"no call_ method for {', '.join(missing)} of halflight.Scene")

    def call_load(self, dice):
        hl.load(**({"path": SCENE} | some(dice, path=SCENE, environment=(1, 1, 1), animation="none", fps=24, sky="30,40",
                                          variant=None, line_width=0, mip_levels=False, strict=True,
                                          allow_outside=True, settings=dice.choice([self.folder / "look.json", None]))))

    def call_camera(self, dice):
        self.scene.camera = value(dice)

    def call_look(self, dice):
        self.scene.look(**({"look_from": (0, 1, 4), "look_at": (0, 1, 0)} |
                           some(dice, look_from=(0, 1, 4), look_at=(0, 1, 0), up=(0, 1, 0), vfov=40)))

    def call_material(self, dice):
        self.scene.material(value(dice))

    def call_edit_material(self, dice):
        self.scene.edit_material(dice.choice([0, value(dice)]),
                                 **some(dice, roughness=0.5, base_color=(1, 0, 0, 1), no_such_property=1))

    def call_edit_light(self, dice):
        self.scene.edit_light(dice.choice([0, value(dice)]),
                              **some(dice, factor=2, color=(1, 0, 0), position=(0, 1, 0), direction=(0, -1, 0),
                                      intensity=100, temperature=2700, off=True))

    def call_add_light(self, dice):
        self.scene.add_light(dice.choice(["lamp", value(dice)]), dice.choice(["point", "spot", "rectangle", value(dice)]),
                             **some(dice, position=(0, 1, 0), direction=(0, -1, 0), intensity=100, outer=40, size=(1, 2)))

    def call_remove_light(self, dice):
        self.scene.remove_light(dice.choice(["lamp", value(dice)]))

    def call_edit_node(self, dice):
        self.scene.edit_node(dice.choice([0, "*", "tall block", value(dice)]),
                             **some(dice, translate=(0, 0.1, 0), rotate=(0, 45, 0), scale=2, matrix=numpy.eye(4)))

    def call_hide(self, dice):
        self.scene.hide(*dice.choice([[], ["tall block"], ["mesh:*", "node:0"], [value(dice), value(dice)]]))

    def call_show(self, dice):
        hidden = self.scene.hidden
        self.scene.show(*dice.choice([hidden, hidden[:1], [value(dice)]]))

    def call_edit_options(self, dice):
        self.scene.edit_options()

    def call_save_settings(self, dice):
        # Paths are few, since any that can be written is written.
        paths = [self.folder / "look.json", self.folder / "none/look.json", self.folder, "", "a\0b", 3, None, Text()]
        self.scene.save_settings(dice.choice(paths))

    def call_edit_environment(self, dice):
        self.scene.edit_environment(**some(dice, rotation=90, intensity=2, tint=(1, 1, 0)))

    def call_edit_emission(self, dice):
        self.scene.edit_emission(value(dice))

    def call_set_clay(self, dice):
        self.scene.set_clay(value(dice))

    def call_set_ground(self, dice):
        self.scene.set_ground(value(dice), dice.choice([None, -1.5, value(dice)]))

    def call_set_shadow_catchers(self, dice):
        self.scene.set_shadow_catchers(*dice.choice([[], ["floor"], ["*"], [value(dice), value(dice)]]))

    def call_set_light_groups(self, dice):
        self.scene.set_light_groups(dice.choice([{}, {"ceiling": ["*"]}, {"a": [], "b": value(dice)}, value(dice)]))

    def call_set_light_links(self, dice):
        self.scene.set_light_links(dice.choice([{}, {"light": ["-floor"]}, {"*": [], "b": value(dice)}, value(dice)]))

    def call_set_shadow_links(self, dice):
        self.scene.set_shadow_links(dice.choice([{}, {"light": "-*block"}, {"environment": value(dice)}, value(dice)]))

    def call_transform(self, dice):
        self.scene.transform(value(dice))

    def call_edit_transform(self, dice):
        self.scene.edit_transform(dice.choice([0, value(dice)]), dice.choice([numpy.eye(4), value(dice)]))

    def call_reset_edits(self, dice):
        self.scene.reset_edits()

    def call_properties(self, dice):
        for name in self.properties:
            getattr(self.scene, name)
        repr(self.scene)

    def call_renderer(self, dice):
        known = {name: value(dice) for name in dice.sample(self.settings, 2)}
        more = some(dice, layers=["normal", "albedo"], measure=True, pictures=1, device="", shutter=0.5, shutter_times=2,
                    working_space="", strict=False, reproducible=True, exr_compression="piz", exr_parts=True,
                    exr_tiles=16)
        # The size is the last word, so that no call makes a picture that takes long.
        hl.Renderer(self.scene, **({"samples": 1} | known | more | {"width": 4, "height": 4}))

    def call_render(self, dice):
        answers = [None, lambda progress: True, lambda progress: False, lambda progress: 1 / 0, value(dice)]
        try:
            picture = self.renderer.render(**some(dice, frame=1, progress=dice.choice(answers)))
        except ZeroDivisionError:
            return
        layer = dice.choice(["beauty", "view", "normal", value(dice)])
        numpy.asarray(picture[layer]).sum()
        picture.channels(layer), picture.stats, repr(picture), len(picture), list(picture)
        picture.save(dice.choice([self.folder / "a.exr", self.folder / "a.png", self.folder / "a.txt", value(dice)]))

    def call_change(self, dice):
        self.renderer.change(**some(dice, samples=1, seed=3, error=None, filter="box", no_such_setting=1))
        self.renderer.change(samples=1)

    def call_find_estimator(self, dice):
        self.renderer.find_estimator(value(dice))

    def call_sequence(self, dice):
        hl.render_sequence(self.scene, **({"outputs": self.folder / "f.####.exr", "frames": [1], "overwrite": True} |
                                          some(dice, outputs=[self.folder / "f.##.png"], frames=[1, 2], layers=["normal"],
                                               stats=self.folder / "s.json", overwrite=True, progress=None,
                                               edit=lambda frame, scene: scene.edit_light(value(dice), factor=frame))),
                           width=4, height=4, samples=1)

    def call_limit_memory(self, dice):
        hl.limit_memory(value(dice))
        hl.limit_memory("4GiB")

    def call_lists(self, dice):
        hl.settings(), hl.layers()


def judge(calls, seed):
    """Makes the call of a seed. Returns what is wrong with its outcome, or nothing."""
    dice = random.Random(seed)
    call = dice.choice(calls.all)
    try:
        call(dice)
    except ALLOWED as error:
        if isinstance(error, hl.Error) and (not str(error) or "\n" in str(error)):
            return f"{call.__name__}: the error is not one line: {str(error)!r}"
    except Exception as error:  # pylint: disable=broad-except
        return f"{call.__name__}: {type(error).__name__}: {error}"
    return None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=float("inf"))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--calls", type=int, default=1 << 62)
    parser.add_argument("--note", type=lambda text: pathlib.Path(text).resolve())
    arguments = parser.parse_args()
    note = os.open(arguments.note, os.O_WRONLY | os.O_CREAT | os.O_TRUNC) if arguments.note else None
    done, finding = 0, None
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(ROOT / "scenes/cornell.glb", SCENE)
        os.chdir(folder)  # relative names among the random values lead here
        calls = Calls(pathlib.Path(folder))
        end = time.monotonic() + arguments.seconds
        while done < arguments.calls and time.monotonic() < end and not finding:
            seed = arguments.seed + done
            if note is not None:
                os.pwrite(note, f"{seed:20}\n".encode(), 0)
            finding = judge(calls, seed)
            done += 1
        os.chdir("/")
    shutil.rmtree(SCENE.parent)
    if finding:
        print(f"finding, seed {seed}: {finding}")
    elif note is not None:
        os.unlink(arguments.note)
    print(f"number_of_executed_units: {done}")
    sys.exit(bool(finding))


if __name__ == "__main__":
    main()
