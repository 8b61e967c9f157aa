"""Reads the channels of OpenEXR files of scan lines, uncompressed or ZIP, and writes uncompressed ones, without OpenEXR.

Scripts use this module to compare the files of this project with what other programs read. The reader follows
"OpenEXR File Layout" of openexr.com.

    width, height, channels = exr_layers.read("picture.exr")   # {"R": array[height, width], ...}, float32 or uint32

Size and arrays are those of the display window. Pixels outside the data window are 0.
"""
import struct
import zlib

import numpy

KINDS = {0: numpy.dtype("<u4"), 1: numpy.dtype("<f2"), 2: numpy.dtype("<f4")}
LINES = {0: 1, 2: 1, 3: 16}  # lines of a block by compression: none, ZIPS, ZIP


def text(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def header(data):
    """Returns the attributes by name, as bytes, and the offset of the header's end."""
    magic, version = struct.unpack_from("<II", data, 0)
    if magic != 20000630 or version & 0x1a00:
        raise ValueError("not an OpenEXR file of one part of scan lines")
    attributes, at = {}, 8
    while data[at]:
        name, at = text(data, at)
        _, at = text(data, at)
        size, = struct.unpack_from("<I", data, at)
        attributes[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    return attributes, at + 1


def channel_list(data):
    channels, at = [], 0
    while data[at]:
        name, at = text(data, at)
        channels.append((name, KINDS[struct.unpack_from("<I", data, at)[0]]))
        at += 16
    return channels


def unpack(block, size):
    """Returns the bytes of a ZIP block, a deflated sequence of differences with the even bytes first."""
    if len(block) == size:
        return block
    differences = numpy.frombuffer(zlib.decompress(block), numpy.uint8)
    parts = (numpy.cumsum(differences.astype(numpy.int64) - 128) + 128).astype(numpy.uint8)
    whole = numpy.empty(size, numpy.uint8)
    whole[0::2], whole[1::2] = parts[:(size + 1) // 2], parts[(size + 1) // 2:]
    return whole.tobytes()


def placed(plane, corner, window):
    """Returns the values of a window (left, top, right, bottom) from a plane with its upper left value at a corner."""
    left, top, right, bottom = window
    whole = numpy.zeros((bottom - top + 1, right - left + 1), plane.dtype)
    x, y = corner[0] - left, corner[1] - top
    inside = plane[max(-y, 0):max(len(whole) - y, 0), max(-x, 0):max(whole.shape[1] - x, 0)]
    whole[max(y, 0):max(y, 0) + len(inside), max(x, 0):max(x, 0) + inside.shape[1]] = inside
    return whole


def read(path):
    with open(path, "rb") as file:
        data = file.read()
    attributes, at = header(data)
    compression = attributes["compression"][0]
    if compression not in LINES:
        raise ValueError(f"{path}: compression {compression} is not read here")
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    width, height, lines = right - left + 1, bottom - top + 1, LINES[compression]
    channels = channel_list(attributes["channels"])
    planes = {name: numpy.empty((height, width), kind if kind.itemsize == 4 else numpy.float32)
              for name, kind in channels}
    displayed = struct.unpack("<4i", attributes["displayWindow"])
    row_bytes = width * sum(kind.itemsize for _, kind in channels)
    for offset in struct.unpack_from(f"<{(height + lines - 1) // lines}Q", data, at):
        first, size = struct.unpack_from("<iI", data, offset)
        first -= top
        count = min(lines, height - first)
        block = unpack(data[offset + 8:offset + 8 + size], row_bytes * count)
        place = 0
        for y in range(first, first + count):
            for name, kind in channels:
                planes[name][y] = numpy.frombuffer(block, kind, width, place)
                place += width * kind.itemsize
    if (left, top, right, bottom) != displayed:
        planes = {name: placed(plane, (left, top), displayed) for name, plane in planes.items()}
    return displayed[2] - displayed[0] + 1, displayed[3] - displayed[1] + 1, planes


def manifest(path, layer):
    """Returns the ids (the bits of floats) of a Cryptomatte by name."""
    import json
    with open(path, "rb") as file:
        attributes, _ = header(file.read())
    for name, value in attributes.items():
        if name.startswith("cryptomatte/") and name.endswith("/name") and value.decode() == layer:
            return {n: int(i, 16) for n, i in json.loads(attributes[name[:-4] + "manifest"]).items()}
    raise KeyError(f"{path}: has no Cryptomatte {layer!r}")


def write(path, channels):
    """Writes channels of float32, {"R": array[height, width], ...}, as an uncompressed file."""
    names = sorted(channels)  # files list channels by name
    height, width = channels[names[0]].shape

    def attribute(name, kind, value):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(value)) + value

    listed = b"".join(name.encode() + b"\0" + struct.pack("<IB3xII", 2, 0, 1, 1) for name in names) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    long_names = 0x400 if max(map(len, names)) > 31 else 0
    head = struct.pack("<II", 20000630, 2 | long_names) \
        + attribute("channels", "chlist", listed) + attribute("compression", "compression", b"\0") \
        + attribute("dataWindow", "box2i", window) + attribute("displayWindow", "box2i", window) \
        + attribute("lineOrder", "lineOrder", b"\0") + attribute("pixelAspectRatio", "float", struct.pack("<f", 1)) \
        + attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)) \
        + attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0"
    rows = numpy.stack([channels[name] for name in names], axis=1).astype("<f4")  # [height, channel, width]
    line = 8 + rows[0].nbytes
    start = len(head) + 8 * height
    with open(path, "wb") as file:
        file.write(head + struct.pack(f"<{height}Q", *(start + y * line for y in range(height))))
        for y in range(height):
            file.write(struct.pack("<iI", y, rows[y].nbytes) + rows[y].tobytes())
