"""Halflight: hybrid raster and ray-traced global illumination.

    import halflight as hl
    scene = hl.load("a.glb")
    picture = hl.render(scene, samples=64)
    picture["albedo"]            # numpy array

Settings of pictures are keyword arguments with the names and values of the options of ``halflight render``. Examples
are bounces=4, estimator="auto" and filter_radius=1.5; settings() lists all. Errors are exceptions of class Error with
one line of text. Scenes and renderers belong to the thread that made them.
"""
import json as _json
import logging as _logging
import os as _os
from collections import namedtuple as _namedtuple
from collections.abc import Mapping as _Mapping

try:
    import numpy as _numpy  # noqa: F401; the native module needs it, and fails without naming it
except ImportError as _error:
    raise ImportError(f"halflight needs the package numpy ({_error}); Debian's package is python3-numpy") from None

from . import _native
from ._native import Error

__all__ = ["Error", "Picture", "Progress", "Renderer", "Scene", "denoise", "devices", "layers", "limit_memory", "load",
           "render", "render_sequence", "settings"]

Error.__module__ = "halflight"
_logger = _logging.getLogger("halflight")

Progress = _namedtuple("Progress", "samples_done samples_total seconds")
Progress.__doc__ = """Progress of a picture: samples per pixel that are done, expected samples per pixel, and seconds
since its start."""

Setting = _namedtuple("Setting", "name values description")
Layer = _namedtuple("Layer", "name channels description debug in_all")
Device = _namedtuple("Device", "name taken reason")


def _log(is_warning, line):
    _logger.log(_logging.WARNING if is_warning else _logging.INFO, "%s", line)


def _callback(progress):
    """Returns the callback for the native module; it gets tuples."""
    return None if progress is None else lambda values: progress(Progress(*values))


def _call(function, **arguments):
    """Calls a native function with the arguments by position. Raises TypeError of one line for wrong types."""
    try:
        return function(*arguments.values())
    except TypeError as error:
        if error.__traceback__.tb_next or "(): incompatible " not in str(error):  # a callback's error has a next frame
            raise
        given = ", ".join(f"{name}={' '.join(repr(value).split())}" for name, value in arguments.items()
                          if value is not None and not callable(value))
        raise TypeError(f"one argument has the wrong type: {given}") from None


def _items(values):
    """Returns the elements as a list. list() would trust the length that a sequence claims, and allocate for it."""
    return [item for item in values]  # pylint: disable=unnecessary-comprehension


def _names(value):
    """Returns one name or several as a list."""
    return [value] if isinstance(value, str) else _items(value)


def _links(links):
    if not isinstance(links, (dict, type(None))):
        raise TypeError(f"links are a dict of lists of names, or None, not {links!r:.100}")
    return [(light, _names(objects)) for light, objects in (links or {}).items()]


def _text(value):
    if isinstance(value, bool) or type(value).__name__ in ("bool_", "bool"):  # numpy's, whose names depend on its version
        return "yes" if value else "no"
    if isinstance(value, (list, tuple, set)):
        return ",".join(map(str, value))
    return str(value)


def _texts(keywords, layers):
    if "aov" in keywords:
        raise Error("there is no setting 'aov'; did you mean 'layers'?")
    texts = {name.replace("_", "-"): _text(value) for name, value in keywords.items() if value is not None}
    if layers is not None and len(layers) > 0:
        texts["aov"] = layers if isinstance(layers, str) else ",".join(_items(layers))
    return texts


def settings():
    """Returns all settings of pictures: keyword arguments of render(), Renderer() and render_sequence()."""
    return [Setting(name.replace("-", "_"), values or metavar, description)
            for name, metavar, description, values in _native.settings() if name != "aov"]


def layers():
    """Returns all layers that a picture can have beside "beauty" and "view"."""
    return [Layer(*row) for row in _native.layers()]


def devices():
    """Returns all devices, whether each would be taken, and the reason."""
    return [Device(*row) for row in _native.devices()]


def limit_memory(size):
    """Limits the memory of the process: a number of bytes, or a text such as "2GiB". Scenes and pictures that need more
    raise Error. By default the limit is three quarters of what is free."""
    _native.limit_memory(str(size))


def load(path, environment=None, animation=None, fps=None, allow_outside=False, strict=False, variant=None, sky=None,
         mip_levels=False, line_width=None, lamps=True, settings=None, frame_offset=0):
    """Loads a glTF scene and returns it as a Scene.

      environment    None, a constant radiance (r, g, b), the path of an equirectangular .exr or .hdr, or a value of
                     --env: "none", "white", "#8899cc", "neutral", "studio", "sky", "overcast"
      sky            "ELEVATION,AZIMUTH[,TURBIDITY[,ALBEDO[,ALTITUDE]]]" of a clear sky, in place of an environment
      animation      name or number of the animation that plays, "all", or None: the scene at rest
      fps            frames per second, "24" or "30000/1001"; None: frame rate in the scene's extras, else 24
      frame_offset   number of the frame at 0 s
      allow_outside  lets the scene name files outside its folder
      strict         refuses a scene that breaks the rules of glTF, or whose images cannot be read
      variant        name of a material variant of the file, or None: its own materials
      line_width     diameter of points and lines, in units of the scene; 0, the default, leaves them out
      lamps          adds lamps to closed rooms that are dark
      mip_levels     makes the mip levels that the setting texture_lod needs
      settings       path of a settings file of the viewer: camera, environment, variant, animation and edits; other
                     arguments override it. Scene.settings has its render settings

    Warnings go to the logger "halflight". Raises Error.
    """
    if environment is not None and not isinstance(environment, (str, bytes, _os.PathLike)):
        environment = tuple(map(float, environment))
    return Scene(_call(_native.load, path=path, environment=environment, sky=sky,
                       animation=None if animation is None else str(animation),
                       fps=None if fps is None else str(fps), frame_offset=frame_offset, allow_outside=allow_outside, strict=strict,
                       variant=variant, mip_levels=mip_levels, line_width=None if line_width is None else float(line_width),
                       lamps=bool(lamps), settings=settings, log=_log))


def _edit_text(value):
    """Returns a value of an edit as text: a number, numbers, rows of numbers, or text such as "#8899cc"."""
    if isinstance(value, str):
        return value
    if hasattr(value, "__len__"):
        return ",".join(map(_edit_text, value))
    return repr(float(value))


def _edit_texts(values):
    return {key: _edit_text(value) for key, value in values.items() if value is not None}


class Scene:
    """A loaded scene with its camera and its edits. Edits replace or scale values of the file, which is not changed.
    They can be changed between pictures and hold from the next picture on."""

    def __init__(self, native):
        self._native = native

    file = property(lambda self: self._native.file, doc="The path of the scene's file.")
    variants = property(lambda self: self._native.variants, doc="Names of the material variants, for load(variant=).")
    cameras = property(lambda self: self._native.cameras, doc="Names of the cameras.")
    materials = property(lambda self: self._native.materials, doc="Names of the materials.")
    nodes = property(lambda self: self._native.nodes, doc="Names of the nodes of the file.")
    hidden = property(lambda self: self._native.hidden, doc="Names that are hidden.")
    settings = property(lambda self: self._native.settings,
                        doc="Render settings of the settings file of load(), for render(scene, **scene.settings).")
    instances = property(lambda self: self._native.instances, doc="Names of the instances of meshes, also of hidden ones.")
    lights = property(lambda self: self._native.lights, doc="Lights with their edits, as dicts.")
    ground = property(lambda self: self._native.ground, doc="Whether the scene has a ground (set_ground()).")
    shadow_catchers = property(lambda self: self._native.shadow_catchers, doc="Names of shadow catchers.")
    light_groups = property(lambda self: self._native.light_groups, doc="Names of light groups, \"rest\" last.")
    bounds = property(lambda self: self._native.bounds, doc="Lower and upper corner of all surfaces, metres.")
    frame_rate = property(lambda self: self._native.frame_rate, doc="Frames per second, as text.")

    def _index(self, names, which, what):
        if isinstance(which, int) and which >= 0:
            return which
        if not isinstance(which, str) or which not in names:
            text = f"{self.file}: there is no {what} '{which}', only {', '.join(names) or 'none'}"
            raise Error(" ".join(text.split()))  # arrays, files and names can have several lines
        return names.index(which)

    @property
    def camera(self):
        """Name of the camera. Set it to a name or a number, or to None for the scene's first camera."""
        return self._native.camera

    @camera.setter
    def camera(self, which):
        self._native.set_camera(None if which is None else str(which), None, None, (0, 1, 0), 45)

    def look(self, look_from, look_at, up=(0, 1, 0), vfov=45):
        """Sets a free camera: its position, its target and up direction (metres, world), and its vertical field
        of view in degrees."""
        _call(self._native.set_camera, name=None, look_from=tuple(_items(look_from)), look_at=tuple(_items(look_at)),
              up=tuple(_items(up)), vfov=vfov)

    def material(self, which):
        """Returns the properties of a material, given by name or number, with its edits, as a dict."""
        return self._native.material(self._index(self.materials, which, "material"))

    def edit_material(self, which, **properties):
        """Replaces properties of materials: edit_material("floor", roughness=0.2, base_color="#8899cc").

        `which` is a name, a number, or a pattern with * and ?; so it is in the other methods that edit by name."""
        _call(self._native.edit_material, which=str(which), values=_edit_texts(properties))

    def edit_light(self, which, factor=None, color=None, position=None, direction=None, intensity=None,
                   temperature=None, radius=None, angle=None, ies=None, off=None, inner=None, outer=None, size=None):
        """Edits lights, by name, number or pattern.

          factor       factor of the intensity
          intensity    intensity in place of the light's own: candela, lux of directional lights, nits of surfaces
          color        linear Rec.709, [0,1], or "#8899cc"
          temperature  colour of a black body, kelvin
          position     metres
          direction    direction in which the light travels
          radius       metres, of the ball from which the light of a point or spot comes
          angle        degrees, diameter in the sky of a directional light
          ies          file of a light profile (IES LM-63) of a point or spot, in place of its own distribution
          off          True switches the light off, False on again
          inner        degrees from the direction to where the light of a spot begins to fall off
          outer        degrees from the direction to where it ends
          size         metres: width and height of an added rectangle, or the diameter of an added disc

        Values of earlier edits stay unless they are given."""
        values = _edit_texts(dict(factor=factor, intensity=intensity, color=color, temperature=temperature,
                                  position=position, direction=direction, radius=radius, angle=angle, ies=ies,
                                  inner=inner, outer=outer, size=size))
        if off is not None:
            values["off" if off else "on"] = ""
        _call(self._native.edit_light, which=str(which), values=values)

    def add_light(self, name, kind, **values):
        """Adds a light: add_light("fill", "spot", position=(0, 2, 0), intensity=50).

        `kind` is "point", "spot", "sun", "rectangle" or "disc"; the values are those of edit_light() that suit it. All
        kinds but "sun" need a position. A light without further values is white, has an intensity of 1 and shines
        down. edit_light(), groups and links find it by its name."""
        _call(self._native.add_light, name=name, kind=kind, values=_edit_texts(values))

    def remove_light(self, name):
        """Removes a light that add_light(), or a settings file, has added."""
        _call(self._native.remove_light, name=name)

    def edit_node(self, which, translate=None, rotate=None, scale=None, matrix=None):
        """Moves nodes with everything below them. edit_node(which) restores their own transforms.

          translate  metres along the world's axes
          rotate     degrees about the world's X, then Y, then Z axis through the node's origin
          scale      one factor, or one for each axis of the world
          matrix     three or four rows from the node to the world, in place of its own matrix

        Values of earlier edits stay unless they are given."""
        scale = (scale,) * 3 if scale is not None and not hasattr(scale, "__len__") else scale
        _call(self._native.edit_node, which=str(which),
              values=_edit_texts(dict(translate=translate, rotate=rotate, scale=scale, matrix=matrix)))

    def hide(self, *names):
        """Hides nodes with everything below them, meshes and lights of these names or patterns; "node:NAME",
        "mesh:NAME" and "light:NAME" select a kind."""
        _call(self._native.hide, names=list(names))

    def show(self, *names):
        """Shows what hide() of the same names has hidden."""
        _call(self._native.show, names=list(names))

    def set_shadow_catchers(self, *names):
        """Makes nodes with everything below them, and meshes, of these names or patterns shadow catchers: the camera sees
        the shadows on them alone, as alpha. "node:NAME" and "mesh:NAME" select a kind. No names: nothing is one."""
        _call(self._native.set_shadow_catchers, names=list(names))

    def set_ground(self, on=True, height=None):
        """Adds a level floor below the scene, of which the camera sees only the shadows on it, or removes it. height, in
        metres, replaces that of the lowest point of the unedited surfaces at 0 s."""
        _call(self._native.set_ground, on=on, height=height)

    def set_light_groups(self, groups=None):
        """Groups lights, whose light gets the layers "light_NAME" of pictures: set_light_groups({"key": ["sun", "lamp*"]}).

        A light is the name or pattern of lights, emissive materials, or nodes with everything below them, or
        "environment"; "light:NAME", "material:NAME" and "node:NAME" select a kind. "light_rest" has all other lights.
        "each" makes a group of each light; None removes the groups."""
        each = isinstance(groups, str) and groups == "each"
        if not each and not isinstance(groups, (dict, type(None))):
            raise TypeError(f"light groups are a dict of lists of names, \"each\" or None, not {groups!r:.100}")
        lists = [] if each else [(name, _names(lights)) for name, lights in (groups or {}).items()]
        _call(self._native.set_light_groups, groups=lists, each=each)

    def set_light_links(self, links=None):
        """Limits the objects that lights light, a departure from physics that pictures name: set_light_links({"key":
        ["-floor"]}).

        Keys are names of lights as for set_light_groups(). An object is the name or pattern of nodes with everything
        below them or of meshes, or "ground"; "-NAME" leaves it out. A list that starts with such a name starts with all
        objects. None removes the links."""
        _call(self._native.set_light_links, links=_links(links))

    def set_shadow_links(self, links=None):
        """Limits the objects that cast the shadows of lights, by lists like those of set_light_links()."""
        _call(self._native.set_shadow_links, links=_links(links))

    def edit_options(self):
        """Returns the text of ``halflight info --names`` for the scene with its edits: objects as options of
        ``halflight render``, one a line."""
        return self._native.edit_options()

    def save_settings(self, path):
        """Writes camera, environment, variant and edits as a settings file, which ``halflight render --settings``,
        the viewer and load() read."""
        _call(self._native.save_settings, path=path)

    def edit_environment(self, rotation=None, intensity=None, tint=None):
        """Turns the environment by degrees to the right, scales and tints its radiance."""
        _call(self._native.edit_environment, rotation=rotation, intensity=intensity, tint=tint)

    def edit_emission(self, factor):
        """Scales the light of all emissive surfaces."""
        _call(self._native.edit_emission, factor=factor)

    def set_clay(self, on=True):
        """Gives all surfaces one rough grey, or their own materials again."""
        _call(self._native.set_clay, on=on)

    def transform(self, which):
        """Returns the transform of an instance, given by name or number, with its edits: four rows of four numbers."""
        return self._native.transform(self._index(self.instances, which, "instance"))

    def edit_transform(self, which, matrix):
        """Replaces the transform of an instance by a matrix of four rows from object to world space, at all times.
        None restores its own transform."""
        rows = None if matrix is None else [[float(x) for x in row] for row in matrix]
        _call(self._native.edit_transform, which=self._index(self.instances, which, "instance"), rows=rows)

    def reset_edits(self):
        """Removes all edits. The camera stays."""
        self._native.reset_edits()

    def __repr__(self):
        return f"<halflight.Scene {self.file}: {len(self.instances)} instances, {len(self.materials)} materials>"


class Picture(_Mapping):
    """A picture: a mapping from the names of its layers to numpy arrays of shape (height, width, channels). Layers of
    one channel lack the last axis. Rows run from top to bottom.

      "beauty"  RGBA, float32, scene-linear Rec.709
      "view"    RGBA, float32 in [0,1], through the view transform

    layers() describes the other layers. Arrays share the memory of the picture."""

    def __init__(self, native):
        self._native = native

    width = property(lambda self: self._native.width, doc="Pixels.")
    height = property(lambda self: self._native.height, doc="Pixels.")

    def __getitem__(self, layer):
        return self._native.layer(layer)

    def __iter__(self):
        return iter(["beauty", "view", *self._native.layers])

    def __len__(self):
        return 2 + len(self._native.layers)

    @property
    def stats(self):
        """Statistics as a dict, equal to the JSON of --stats: samples, seconds, error, device, ..."""
        return _json.loads(self._native.statistics)

    @property
    def interrupted(self):
        """True if a progress callback has stopped the picture before its last sample."""
        return self._native.interrupted

    def channels(self, layer):
        """Returns the full names of a layer's channels, as in .exr files."""
        return self._native.channels(layer)

    def save(self, path):
        """Writes the picture as .exr with its layers, or as .png, .jpg or .tif through the view transform. Raises Error
        for an interrupted picture, in which rows may be missing."""
        _call(self._native.save, path=path)

    def _repr_png_(self):
        return self._native.png()

    def __repr__(self):
        return f"<halflight.Picture {self.width} x {self.height}: {', '.join(self)}>"


def _options(device="", shader_cache=True, ocio=None, shutter=0, shutter_times=None,
             shutter_position="centre", shutter_ramp=0):
    return _call(_native.RendererOptions, **locals())


def _device(device="", shader_cache=True, ocio=None):
    return _options(**locals())


def _output(working_space="", reproducible=False, strict=False, best_effort=False, exr_compression="zip",
            exr_parts=False, exr_tiles=0, png_bits=0, jpeg_quality=92, tiff_type="16"):
    tiff_type = str(tiff_type)
    return _call(_native.OutputOptions, **locals())


def _split(keywords, function):
    """Removes the keyword arguments of a function from `keywords` and returns its result for them."""
    names = function.__code__.co_varnames[:function.__code__.co_argcount]
    return function(**{name: keywords.pop(name) for name in names if name in keywords})


class Renderer:
    """Renders pictures of a scene one after the other. Scene and shaders are prepared once.

    Renderer(scene, layers="all", measure=False, pictures=0, **settings)

      layers    names of layers(), "all" (those whose in_all is True), or []
      measure   times each pass, which makes rendering slower
      pictures  upper limit of the pictures that will be rendered; 0: unknown. It decides what is worth measuring.
      settings  those of halflight.settings(), and the options device, shader_cache, ocio (path of a colour config),
                shutter, shutter_times, shutter_position and shutter_ramp (motion blur), working_space, reproducible, strict, best_effort,
                exr_compression, exr_parts, exr_tiles, png_bits, jpeg_quality and tiff_type of ``halflight render``

    Edits and camera changes of the scene hold from the next picture on."""

    def __init__(self, scene, layers="all", measure=False, pictures=0, **settings):
        options, output = _split(settings, _options), _split(settings, _output)
        self.scene = scene
        self._native = _call(_native.Renderer, scene=scene._native, settings=_texts(settings, layers), options=options,
                             output=output, measure=measure, pictures=pictures)

    device = property(lambda self: self._native.device, doc="Name of the device.")

    def render(self, frame=None, progress=None):
        """Renders a frame and returns its Picture. None stands for the frame of the settings.

        progress(Progress) is called after each sample. If it returns False, the picture ends with its samples so
        far. Its exceptions are passed on. Raises Error, also for an error target that was not reached (unless
        best_effort)."""
        return Picture(_call(self._native.render, frame=frame, progress=_callback(progress), log=_log))

    def frames(self, frames, progress=None):
        """Yields (frame, Picture) for each frame number."""
        for frame in frames:
            yield frame, self.render(frame, progress)

    def find_estimator(self, progress=None):
        """Settles the open choices of estimator="auto" by small pictures, and returns the estimator as text. Calls
        progress(share) with the share of the work that is done; False cancels, and None is returned. The first
        render() settles them if need be."""
        return self._native.find_estimator(progress)

    def change(self, **settings):
        """Changes samples, seed, error, time, filter or filter_radius of later pictures."""
        self._native.change(_texts(settings, None))


def render(scene, frame=None, layers="all", progress=None, **settings):
    """Renders one picture of a scene: Renderer(scene, layers, **settings).render(frame, progress)."""
    return Renderer(scene, layers, pictures=1, **settings).render(frame, progress)


def render_sequence(scene, outputs, frames, layers="all", movie=None, stats=None, overwrite=False, accept_sources=(),
                    develop=False, edit=None, progress=None, **settings):
    """Renders frames to numbered files, as ``halflight render --frames`` does. Existing frames are kept.

      outputs   one or more paths, such as .exr or .png, with a placeholder for the number: "shot.####.exr", "shot.%04d.png"
      frames    frame numbers, or a text like "1-240x2"
      movie     path of an .mp4 or .mov of all frames; needs ffmpeg
      stats     path of a file to which a line of JSON is appended for each frame
      develop   renders nothing: makes other pictures from the .exr of each frame
      accept_sources  hashes of sources whose frames count as those of this program (``halflight --version``)
      edit      called as edit(frame, scene) before the first frame is rendered, for each frame, for frames near it
                (also outside of ``frames``) and for the frame at 0 s: changes lights, materials, nodes, hidden
                objects, environment and camera of `scene`, which has its own edits and camera at the start of each
                call and after the last one
      progress  called as progress(frame, Progress); False stops the sequence

    Returns a dict: frames asked for, kept, made, and stopped_in, the frame in which `progress` stopped."""
    options, output = _split(settings, _options), _split(settings, _output)
    outputs = [outputs] if isinstance(outputs, (str, _os.PathLike)) else _items(outputs)
    frames = _native.parse_frames(frames) if isinstance(frames, str) else _items(frames)
    if not any(str(path).lower().endswith(".exr") for path in outputs):
        layers = None
    callback = None if progress is None else lambda values: progress(values[0], Progress(*values[1:]))
    edits = None if edit is None else lambda frame: edit(frame, scene)
    return _call(_native.render_files, scene=scene._native, settings=_texts(settings, layers), options=options,
                 output=output, outputs=outputs, frames=frames, movie=movie, stats=stats, overwrite=overwrite,
                 accept_sources=_items(accept_sources), develop=develop, edit=edits, progress=callback, log=_log)


def denoise(frames, outputs=(), near=None, overwrite=False, accept_sources=(), progress=None, **settings):
    """Makes denoised pictures of noisy frames that keep_noisy=True has kept, as ``halflight denoise`` does.

      frames    one or more paths: noisy frames, NAME.noisy.exr, or pictures beside which they lie
      outputs   one or more paths with a placeholder for the frame number; none: NAME.denoised.exr
      near      frames before and after each frame that are used, too; None: as many as the files are made for
      progress  called as progress(done, all) before each frame; False stops

    Further arguments are those of files and of the view, such as exposure. Returns a dict: frames, kept, made."""
    options, output = _split(settings, _device), _split(settings, _output)
    paths = [[p] if isinstance(p, (str, _os.PathLike)) else _items(p) for p in (frames, outputs)]
    return _call(_native.denoise_files, frames=paths[0], outputs=paths[1], near=near,
                 settings=_texts(settings, None), options=options, output=output, overwrite=overwrite,
                 accept_sources=_items(accept_sources),
                 progress=None if progress is None else lambda counts: progress(*counts), log=_log)
