"""Lists scenes on which scripts measure errors: scenes of this repository, and assets of ../shared with a map and a view.

Each scene has a file, an environment and options of a view, which Halflight and tools/figures/cycles.py know. The environment is a
map, a constant radiance "r,g,b" or None. Cycles knows neither the environments in scene files nor the order of cameras, so
both are named.
"""
import json
import pathlib
import struct

ROOT = pathlib.Path(__file__).resolve().parents[2]
ASSETS = ROOT / "../shared/assets"


OWN_ENVIRONMENTS = {"still-life": "0.18,0.2,0.24", "atrium": "1.4,1.7,2.2"}
OWN_CAMERAS = {"atrium": ["--camera", "nave"]}


def own(*names):
    return {name: (ROOT / "scenes" / f"{name}.glb", OWN_ENVIRONMENTS.get(name), OWN_CAMERAS.get(name, [])) for name in names}


def assets(*names, work=None):
    """Returns the named assets, those whose files exist. `work` is a folder for lit copies of unlit ones."""
    found = {name: ALL_ASSETS[name] for name in names if ALL_ASSETS[name][0].exists()}
    return {name: (lit_copy(case[0], work), *case[1:]) if name in UNLIT else case for name, case in found.items()}


def asset(file, environment, view=()):
    return ASSETS / file, ASSETS / "env" / f"{environment}.hdr", view


def view(eye, target, field=40):
    return [f"--look-from={eye}", f"--look-at={target}", "--vfov", str(field)]


def lit_copy(file, folder):
    """Writes a .glb without KHR_materials_unlit to `folder`, unless it is there."""
    copy = folder / file.name
    if not copy.exists():
        data = file.read_bytes()
        length, = struct.unpack_from("<I", data, 12)
        scene = json.loads(data[20:20 + length])
        for material in scene["materials"]:
            material.get("extensions", {}).pop("KHR_materials_unlit", None)
        scene["extensionsUsed"].remove("KHR_materials_unlit")
        if not scene["extensionsUsed"]:  # empty lists are invalid
            del scene["extensionsUsed"]
        text = json.dumps(scene).encode()
        text += b" " * (-len(text) % 4)
        rest = data[20 + length:]
        copy.write_bytes(struct.pack("<4s4I", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4e4f534a) + text + rest)
    return copy


ALL_ASSETS = {
    "Fox": asset("animation/Fox.glb", "spiaggia_di_mondello_1k", view("67.7,93.4,152.4", "-26.3,25,-10.3")),
    "roughness-scale": asset("product/roughness-scale/scene.gltf", "studio_small_05_1k", view("9.6,7.1,20.1", "-0.7,-0.4,2.2")),
    "house": asset("stress/house/house.glb", "kloppenheim_05_1k", view("0.5,0.35,0.7", "0,0.12,0")),
    "lamborghini": asset("product/lamborghini/lamborghini.glb", "studio_small_05_1k"),
    "AttenuationTest": asset("materials/AttenuationTest.glb", "studio_small_05_1k"),
    "vr-gallery": asset("interior/vr_gallery/vr-gallery.glb", "kloppenheim_05_1k", view("3.8,1.7,3.8", "-2,1.6,-3", 60)),
}
UNLIT = ("vr-gallery",)


def options(case):
    """Returns the options of `halflight render` for environment and view."""
    _, environment, view = case
    return [*view, *(["--env", environment] if environment else [])]
