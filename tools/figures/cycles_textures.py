"""Reads textures and vertex colours of a glTF file for cycles_materials.py, inside Blender.

Blender's importer stores vertex colours with 8 bits, and Cycles filters images of 8 bits before it decodes sRGB. Here
both become floats: images are decoded first, as SHADING.md says, and COLOR_0 keeps the values of the file.
"""
import base64
import json
import math
import pathlib
import struct
import tempfile
import urllib.parse

import bpy
import numpy
from io_scene_gltf2.blender.imp import gltf2_blender_material, gltf2_blender_mesh
from io_scene_gltf2.io.imp.gltf2_io_gltf import glTFImporter

REPEAT, CLAMP, MIRRORED = 10497, 33071, 33648  # values of wrapS and wrapT
NEAREST = 9728
COLOR, INDEX, COLORED, TANGENTS = "Col", "halflight_index", "halflight_colored", "halflight_tangents"


def is_data(uri):
    return uri.lstrip().lower().startswith("data:")


def bytes_of_data(uri):
    """Returns the bytes of a data URI. Base64 may lack its padding, and contain percent escapes and white space."""
    head, body = uri.split("#")[0].split(",", 1)
    body = urllib.parse.unquote_to_bytes(body)
    is_base64 = "".join(head.split()).lower().endswith(";base64")
    return base64.b64decode(body + b"==") if is_base64 else body  # too much padding is ignored


class Document:
    """A .gltf or .glb file: its JSON, and its images as float images of Blender."""

    def __init__(self, path):
        self.path, data = pathlib.Path(path), pathlib.Path(path).read_bytes()
        self.binary, self.images = b"", {}
        if data[:4] == b"glTF":
            length = struct.unpack_from("<I", data, 12)[0]
            self.binary, data = data[20 + length + 8:], data[20:20 + length]
        self.json = json.loads(data)

    def bytes_of_uri(self, uri):
        if is_data(uri):
            return bytes_of_data(uri)
        return (self.path.parent / urllib.parse.unquote(uri)).read_bytes()

    def bytes_of_image(self, image):
        if "uri" in image:
            return self.bytes_of_uri(image["uri"])
        view = self.json["bufferViews"][image["bufferView"]]
        buffer = self.json["buffers"][view["buffer"]]
        data = self.bytes_of_uri(buffer["uri"]) if "uri" in buffer else self.binary
        start = view.get("byteOffset", 0)
        return data[start:start + view["byteLength"]]

    def source(self, info):
        """Returns the index of the image of a texture; None if Blender cannot read it."""
        texture = self.json["textures"][info["index"]]
        extensions = texture.get("extensions", {})
        index = extensions.get("EXT_texture_webp", {}).get("source", texture.get("source"))
        if "KHR_texture_basisu" in extensions or index is None:
            return None
        return index if self.bytes_of_image(self.json["images"][index])[:5] != b"\xabKTX " else None

    def image(self, info, is_color):
        """Returns linear texels of a texture. Alpha and data are not converted."""
        key = self.source(info), is_color
        if key not in self.images:
            with tempfile.NamedTemporaryFile() as file:
                file.write(self.bytes_of_image(self.json["images"][key[0]]))
                file.flush()
                read = bpy.data.images.load(file.name)
                read.colorspace_settings.name, read.alpha_mode = "Non-Color", "CHANNEL_PACKED"
                width, height = read.size
                if 0 in read.size:
                    bpy.data.images.remove(read)
                    raise ValueError("a texture that Blender cannot read")
                texels = numpy.empty((height * width, 4), "f")
                read.pixels.foreach_get(texels.ravel())
            bpy.data.images.remove(read)
            texels = numpy.round(texels * 255) / 255  # 16 bits are rounded
            if is_color:
                c = texels[:, :3]
                texels[:, :3] = numpy.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055)**2.4)
            made = bpy.data.images.new("texels", width, height, alpha=True, float_buffer=True, is_data=True)
            made.alpha_mode = "CHANNEL_PACKED"
            made.pixels.foreach_set(texels.astype("f").ravel())
            self.images[key] = made
        return self.images[key]


def uv_map(info):
    """Returns the name that the importer gives to the texture coordinates of a texture."""
    number = info.get("extensions", {}).get("KHR_texture_transform", {}).get("texCoord", info.get("texCoord", 0))
    return f"UVMap.{number:03d}" if number else "UVMap"


def transformed(u, v, info, add_product):
    """Returns coordinates after KHR_texture_transform. add_product(a, b, c) is a b + c."""
    transform = info.get("extensions", {}).get("KHR_texture_transform", {})
    scale, offset, turn = (transform.get(*key) for key in (("scale", (1, 1)), ("offset", (0, 0)), ("rotation", 0)))
    cos, sin = math.cos(turn), math.sin(turn)
    rows = (cos * scale[0], sin * scale[1], offset[0]), (-sin * scale[0], cos * scale[1], offset[1])
    return (add_product(u, a, add_product(v, b, c)) for a, b, c in rows)


def tangent_map(material, info):
    """Returns the name of the coordinates that tangents follow, on all meshes of a material. Those of meshes without
    TANGENT follow the transform of the normal map, as in Halflight."""
    if "KHR_texture_transform" not in info.get("extensions", {}):
        return uv_map(info)
    name = f"tangents {material[INDEX]} {info['index']}"
    for mesh in bpy.data.meshes:
        source = mesh.uv_layers.get(uv_map(info))
        if mesh.materials.find(material.name) < 0 or source is None or name in mesh.uv_layers:
            continue
        places = numpy.empty((len(mesh.loops), 2), "f")
        source.data.foreach_get("uv", places.ravel())
        if TANGENTS not in mesh:
            u, v = transformed(places[:, 0], 1 - places[:, 1], info, lambda a, b, c: a * b + c)
            places = numpy.stack([u, 1 - v], axis=1).astype("f")
        mesh.uv_layers.new(name=name).data.foreach_set("uv", places.ravel())
    return name


def texture(n, document, info, is_color):
    """Returns colour and alpha of a texture at a hit. Coordinates are wrapped by nodes, because Blender 3.4 has no
    mirrored repetition, and only one mode for both axes."""
    image = document.image(info, is_color)
    u, v, _ = n.node("ShaderNodeSeparateXYZ", n.node("ShaderNodeUVMap", uv_map=uv_map(info)).outputs[0]).outputs
    v = n.one_less(v)  # the importer turns v around
    if "KHR_texture_transform" in info.get("extensions", {}):
        u, v = transformed(u, v, info, lambda a, b, c: n.math("MULTIPLY_ADD", a, b, c))
    sampler = document.json["textures"][info["index"]].get("sampler")
    sampler = {} if sampler is None else document.json["samplers"][sampler]
    place = []
    for value, mode, size in zip((u, v), (sampler.get("wrapS", REPEAT), sampler.get("wrapT", REPEAT)), image.size):
        if mode == MIRRORED:
            value = n.math("PINGPONG", value, 1.0)
        if mode != REPEAT:  # within the centres of the outer texels, so that the image does not repeat
            value = n.math("MINIMUM", n.math("MAXIMUM", value, 0.5 / size), 1 - 0.5 / size)
        place.append(value)
    vector = n.node("ShaderNodeCombineXYZ", place[0], n.one_less(place[1]), 0.0).outputs[0]
    nearest = sampler.get("magFilter") == NEAREST
    return n.node("ShaderNodeTexImage", vector, image=image, interpolation="Closest" if nearest else "Linear").outputs


def vertex_color(n):
    """Returns colour and alpha of COLOR_0."""
    return n.node("ShaderNodeVertexColor", layer_name=COLOR).outputs


def watch_importer():
    """Makes the importer mark materials with their index in the file, since names may occur twice, and with whether
    COLOR_0 multiplies their colour, and meshes that have TANGENT. Replaces the vertex colours of meshes by floats, and
    decodes data URIs, because the importer fails if one base64 text has no padding."""
    squish, primitives, create = (gltf2_blender_mesh.squish, gltf2_blender_mesh.do_primitives,
                                  gltf2_blender_material.BlenderMaterial.create)
    colors, load_uri = [], glTFImporter.load_uri

    def load_uri_of_any_padding(importer, uri):
        if not is_data(uri):
            return load_uri(importer, uri)
        try:
            return memoryview(bytes_of_data(uri))
        except ValueError:
            return None  # the importer then leaves out an image, and rejects a buffer

    def squish_and_keep(array):
        if array.ndim == 2 and array.shape[1] == 4:  # only colours have four components
            colors.append(array)
        return squish(array)

    def with_float_colors(gltf, mesh_index, skin_index, mesh, *others):
        colors.clear()
        primitives(gltf, mesh_index, skin_index, mesh, *others)
        if any("TANGENT" in primitive.attributes for primitive in gltf.data.meshes[mesh_index].primitives):
            mesh[TANGENTS] = True
        if colors and len(colors[0]) == len(mesh.loops):
            mesh.color_attributes.remove(mesh.color_attributes[COLOR])
            made = mesh.color_attributes.new(name=COLOR, type="FLOAT_COLOR", domain="CORNER")
            made.data.foreach_set("color", squish(colors[0].astype("f")))

    def create_and_mark(gltf, index, vertex_color):
        create(gltf, index, vertex_color)
        material = bpy.data.materials[gltf.data.materials[index].blender_material[vertex_color]]
        material[INDEX], material[COLORED] = index, vertex_color is not None

    glTFImporter.load_uri = load_uri_of_any_padding
    gltf2_blender_mesh.squish, gltf2_blender_mesh.do_primitives = squish_and_keep, with_float_colors
    gltf2_blender_material.BlenderMaterial.create = staticmethod(create_and_mark)


def add_default_materials():
    """Gives a material to faces without one, with the index None of glTF's default material."""
    made = {}
    for mesh in bpy.data.meshes:
        is_colored = COLOR in mesh.color_attributes
        if len(mesh.materials) == 0:
            mesh.materials.append(None)
        for slot, material in enumerate(mesh.materials):
            if material is None:
                if is_colored not in made:
                    made[is_colored] = bpy.data.materials.new("default")
                    made[is_colored].use_nodes = True
                    made[is_colored][INDEX], made[is_colored][COLORED] = -1, is_colored
                mesh.materials[slot] = made[is_colored]
