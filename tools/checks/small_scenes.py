"""Small glTF scenes for checks, and sheets of their pictures. Debian package: python3-pil."""
import argparse
import base64
import json
import math
import pathlib
import random
import struct
import subprocess

from PIL import Image, ImageDraw

SIZE = 320, 180


class Scene:
    def __init__(self):
        self.data, self.nodes, self.meshes, self.materials, self.accessors, self.views = b"", [], [], [], [], []
        self.lights, self.cameras, self.animations = [], [], []

    def add(self, rows, kind, code, component):
        flat = [x for row in rows for x in row]
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": 4 * len(flat)})
        self.data += struct.pack(f"<{len(flat)}{code}", *flat)
        made = {"bufferView": len(self.views) - 1, "componentType": component, "count": len(rows), "type": kind}
        if code == "f":
            made.update(min=[min(c) for c in zip(*rows)], max=[max(c) for c in zip(*rows)])
        self.accessors.append(made)
        return len(self.accessors) - 1

    def material(self, color=(0.6, 0.6, 0.6), double=False, **more):
        self.materials.append({"pbrMetallicRoughness": {"baseColorFactor": [*color, more.pop("alpha", 1)],
                                                        "metallicFactor": 0}, "doubleSided": double, **more})
        return len(self.materials) - 1

    def mesh(self, points, triangles, material, **node):
        primitive = {"attributes": {"POSITION": self.add(points, "VEC3", "f", 5126)}, "material": material,
                     "indices": self.add([[i] for t in triangles for i in t], "SCALAR", "I", 5125)}
        self.meshes.append({"primitives": [primitive]})
        self.nodes.append({"mesh": len(self.meshes) - 1, **node})
        return len(self.nodes) - 1

    def box(self, lower, upper, material, inward=False, open_sides=(), **node):
        """Adds a box. Sides: 0 -x, 1 +x, 2 -y, 3 +y, 4 -z, 5 +z."""
        corners = [[(upper if i >> k & 1 else lower)[k] for k in range(3)] for i in range(8)]
        sides = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
        triangles = [t for k, (a, b, c, d) in enumerate(sides) if k not in open_sides for t in ((a, b, c), (a, c, d))]
        return self.mesh(corners, [t[::-1] for t in triangles] if inward else triangles, material, **node)

    def ball(self, center, radius, material, inward=False, columns=24, rows=12, **node):
        points, triangles = [], []
        for r in range(rows + 1):
            for c in range(columns + 1):
                turn, tilt = 2 * math.pi * c / columns, math.pi * r / rows
                n = (math.sin(tilt) * math.sin(turn), math.cos(tilt), math.sin(tilt) * math.cos(turn))
                points.append([o + radius * x for o, x in zip(center, n)])
        for r in range(rows):
            for c in range(columns):
                a, d = r * (columns + 1) + c, (r + 1) * (columns + 1) + c
                triangles += [(a, d, a + 1), (a + 1, d, d + 1)]
        return self.mesh(points, [t[::-1] for t in triangles] if inward else triangles, material, **node)

    def furniture(self, seed=1, count=8, reach=1.6):
        dice = random.Random(seed)
        for _ in range(count):
            x, z, w, h = (dice.uniform(-reach, reach), dice.uniform(-reach, reach), dice.uniform(0.1, 0.35),
                          dice.uniform(0.2, 0.9))
            self.box((x - w, 0, z - w), (x + w, h, z + w), self.material([dice.uniform(0.2, 0.8) for _ in range(3)]))

    def camera(self, place, **rotation):
        self.cameras.append({"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.01}})
        self.nodes.append({"camera": len(self.cameras) - 1, "translation": place, "name": "own camera", **rotation})

    def light(self, place, **light):
        self.lights.append(light)
        tilt = {"rotation": [-math.sqrt(0.5), 0, 0, math.sqrt(0.5)]}  # shines down
        self.nodes.append({"translation": place, "extensions": {"KHR_lights_punctual": {"light": len(self.lights) - 1}}, **tilt})

    def write(self, path):
        scene = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(self.nodes)))}],
                 "nodes": self.nodes, "meshes": self.meshes, "materials": self.materials, "accessors": self.accessors,
                 "bufferViews": self.views, "buffers": [{"byteLength": len(self.data), "uri":
                 "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()}]}
        used = {name for material in self.materials for name in material.get("extensions", {})}
        if self.lights:
            scene["extensions"] = {"KHR_lights_punctual": {"lights": self.lights}}
            used.add("KHR_lights_punctual")
        scene.update({name: rows for name, rows in (("cameras", self.cameras), ("animations", self.animations)) if rows})
        path.write_text(json.dumps({**scene, "extensionsUsed": sorted(used)} if used else scene))
        return path


def main(description, cases, options):
    """Writes the scenes of cases(), pairs of a name and a scene, and a sheet of their pictures: a row per program.
    options(name) returns the options of a case."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("programs", metavar="PROGRAM", nargs="+", help="halflight, and another build to compare")
    parser.add_argument("--work", metavar="DIR", type=pathlib.Path, required=True, help="folder for scenes and pictures")
    parser.add_argument("--only", metavar="TEXT", default="", help="only cases whose names contain this")
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    found = [(name, scene.write(arguments.work / f"{name}.gltf")) for name, scene in cases() if arguments.only in name]
    columns, lines = 4, len(arguments.programs)
    height = 16 + lines * SIZE[1]
    sheet = Image.new("RGB", (columns * SIZE[0], -(-len(found) // columns) * height), "white")
    for k, (name, path) in enumerate(found):
        left, top = k % columns * SIZE[0], k // columns * height
        ImageDraw.Draw(sheet).text((left + 4, top + 2), name, "black")
        for line, program in enumerate(arguments.programs):
            output = path.with_name(f"{name} {line}.png")
            run = subprocess.run([program, "render", path, output, "--denoise", "--width", str(SIZE[0]), "--height",
                                  str(SIZE[1]), *options(name)], text=True, capture_output=True)
            said = [text for text in run.stderr.splitlines() if "elapsed" not in text and "wrote" not in text]
            print("\n  ".join([f"{name} [{program}]: status {run.returncode}", *said]), flush=True)
            if run.returncode == 0:
                with Image.open(output) as picture:
                    sheet.paste(picture.convert("RGB"), (left, top + 16 + line * SIZE[1]))
    sheet.save(arguments.work / "sheet.png")
