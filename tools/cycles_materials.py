"""Replaces the materials of a glTF scene by those of shaders/SHADING.md before Cycles renders it:

    blender -b --factory-startup -P tools/cycles_materials.py -P .../cycles_render.py -- SCENE OUT.exr ...

Blender 3.4 imports every material as a Principled node, whose models differ from ours. Its diffuse lobe is Disney's. Its
metal is single-scattering GGX with separable Smith terms, G_1 G_1, and the Fresnel curve of an ior of 1.5. Its coat, its
dielectric and its glass take no energy from what is below, or take another share of it. In a Cornell box with metals,
blocks of 16x16 pixels are up to 4 % darker, and a purely diffuse box is 9 % too bright.

This script reads the materials of the glTF file and builds them of plain nodes:

- Diffuse, Translucent, Emission, Transparent (thin glass without roughness) and Volume Absorption are the same models.
- A reflection is the sum of two nodes. The first is Cycles' own Glossy or Anisotropic node in the colour f_0,
  D G_1 G_1 / (4 mu_o mu_i) f_0. The second is the remainder of our model, D / (4 mu_o mu_i) (G_2 F M - G_1 G_1 f_0) >= 0.
  No node of Cycles has this shape. It is therefore a mirror (sharp Glossy node) whose normal h is drawn per hit by
  D cos(h, n), with a colour that compensates for the density: its mean is the term.
- The interface of a solid is a sharp Glossy and a sharp Refraction node at such a normal h, weighted by Cycles' Fresnel
  node. Without roughness these are what Cycles' Glass node consists of.
- Albedos, which scale what is below a lobe, are integrals that stand in small images.

If HALFLIGHT_IMPORTED_GLOSSY is set in the environment, all materials that are not purely diffuse stay as imported: the
second node makes noise, which a comparison of times should not contain. Materials with textures, vertex colours, sheen,
iridescence, dispersion or rough thin glass stay as imported, too, and their names are printed.

Prints the CPU seconds of the render, all threads, as a line of JSON in addition to that of cycles_render.py.

Cycles does not count the first reflection as a bounce: its --bounces N are our --bounces N + 1.
"""
import json
import math
import os
import struct
import sys
import time

import bpy
import numpy

# Images of albedos have columns by sqrt(mu), which spreads the steep part near 0, and rows by azimuth.
WIDTH, HEIGHT = 128, 24


def albedos(mu, phi, alphas, ior, reflected, steps=96):
    """Returns E_1, E_B, and E_s from outside and from inside, for a wo with the cosine mu and the azimuth phi.

    It is the midpoint rule over the two numbers that choose h. The first is 1 - s^4, because its tail is long."""
    s, turn = numpy.meshgrid((numpy.arange(steps) + 0.5) / steps, (numpy.arange(steps) + 0.5) * 2 * numpy.pi / steps)
    slope = (1 / s**4 - 1)**0.5
    h = numpy.stack([alphas[0] * slope * numpy.cos(turn), alphas[1] * slope * numpy.sin(turn), numpy.ones_like(s)])
    h /= numpy.linalg.norm(h, axis=0)
    sine = (1 - mu * mu)**0.5
    wo = numpy.array([sine * math.cos(phi), sine * math.sin(phi), mu])[:, None, None]
    x = (wo * h).sum(0)
    scale = numpy.array([*alphas, 1])[:, None, None]
    root = numpy.linalg.norm(scale * wo, axis=0)

    def weight(wi, side):
        cosine = side * wi[2]
        seen = (x > 0) & (cosine > 0)
        denominator = h[2] * (mu * numpy.linalg.norm(scale * wi, axis=0) + cosine * root)
        return numpy.where(seen, 2 * x * cosine / numpy.maximum(denominator, 1e-30) * 4 * s**3, 0)

    mirrored = weight(2 * x * h - wo, 1)
    solid = []
    for eta, most in ((ior, reflected), (1 / ior, 1)):
        y_squared = 1 - (1 - x * x) / (eta * eta)
        y = numpy.maximum(y_squared, 0)**0.5
        s_wave, p_wave = (x - eta * y) / (x + eta * y), (eta * x - y) / (eta * x + y)
        f = most * numpy.where(y_squared > 0, (s_wave**2 + p_wave**2) / 2, 1)
        solid.append(numpy.mean(f * mirrored + (1 - f) * weight((x / eta - y) * h - wo / eta, -1)))
    return [numpy.mean(mirrored), numpy.mean(mirrored * (1 - x)**5), *solid]


class Nodes:
    """Builds arithmetic in the node tree of a material. Operands are sockets or constants."""

    def __init__(self, tree):
        self.tree = tree
        geometry = self.node("ShaderNodeNewGeometry").outputs
        self.normal, self.wo, self.inside = geometry["Normal"], geometry["Incoming"], geometry["Backfacing"]
        self.position, self.mu = geometry["Position"], self.dot(geometry["Normal"], geometry["Incoming"])

    def link(self, operand, socket):
        if isinstance(operand, bpy.types.NodeSocket):
            self.tree.links.new(operand, socket)
        else:
            socket.default_value = operand

    def node(self, kind, *operands, normal=None, **settings):
        node = self.tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        for socket, operand in zip(node.inputs, operands):
            self.link(operand, socket)
        if normal is not None:
            self.link(normal, node.inputs["Normal"])
        return node

    def math(self, operation, *operands):
        return self.node("ShaderNodeMath", *operands, operation=operation).outputs[0]

    def product(self, first, *others):
        for other in others:
            first = self.math("MULTIPLY", first, other)
        return first

    def vector(self, operation, *operands):
        return self.node("ShaderNodeVectorMath", *operands, operation=operation).outputs["Vector"]

    def dot(self, a, b):
        return self.node("ShaderNodeVectorMath", a, b, operation="DOT_PRODUCT").outputs["Value"]

    def scaled(self, vector, *factors):
        for factor in factors:
            node = self.node("ShaderNodeVectorMath", vector, operation="SCALE")
            self.link(factor, node.inputs["Scale"])
            vector = node.outputs["Vector"]
        return vector

    def sum(self, *vectors):
        total = vectors[0]
        for vector in vectors[1:]:
            total = self.vector("ADD", total, vector)
        return total

    def one_less(self, value):
        return self.math("SUBTRACT", 1.0, value)

    def mixed(self, outside, inside):
        """Returns the value of the side that the ray comes from."""
        return self.math("ADD", self.product(self.inside, inside), self.product(self.one_less(self.inside), outside))


class Facets:
    """The half vector h of a hit, drawn by D cos(h, n), and the lobes that it makes."""

    def __init__(self, n, alpha, ior=1.0, strength=0, rotation=0, reflected=1.0):
        self.n, self.ior, self.reflected, self.tangent = n, ior, reflected, None
        self.alphas = (alpha + (1 - alpha) * strength**2, max(alpha, 1e-4)) if strength else (alpha, alpha)
        noise = n.node("ShaderNodeTexWhiteNoise", n.position, noise_dimensions="3D").outputs["Color"]
        u, v, w = n.node("ShaderNodeSeparateXYZ", noise).outputs
        # The slope of h is distributed as D cos(h, n) (Walter 2007, eq. 35).
        slope, turn = n.math("SQRT", n.math("DIVIDE", u, n.one_less(u))), n.product(w, 2 * math.pi)
        if strength:
            t = n.node("ShaderNodeTangent", direction_type="UV_MAP").outputs[0]
            b = n.vector("CROSS_PRODUCT", n.normal, t)
            self.tangent = n.sum(n.scaled(t, math.cos(rotation)), n.scaled(b, math.sin(rotation)))
            self.across = n.vector("CROSS_PRODUCT", n.normal, self.tangent)
            tilt = n.sum(n.scaled(self.tangent, n.math("COSINE", turn), self.alphas[0]),
                         n.scaled(self.across, n.math("SINE", turn), self.alphas[1]))
        else:  # The azimuth is that of a uniform direction.
            z = n.math("MULTIPLY_ADD", v, 2.0, -1.0)
            radius = n.math("SQRT", n.one_less(n.product(z, z)))
            sphere = n.node("ShaderNodeCombineXYZ", n.product(radius, n.math("COSINE", turn)),
                            n.product(radius, n.math("SINE", turn)), z).outputs[0]
            along = n.scaled(n.normal, n.dot(n.normal, sphere))
            tilt = n.scaled(n.vector("NORMALIZE", n.vector("SUBTRACT", sphere, along)), alpha)
        self.h = n.vector("NORMALIZE", n.sum(n.normal, n.scaled(tilt, slope)))
        self.h_z, self.x = n.dot(n.normal, self.h), n.dot(n.wo, self.h)
        self.root = self.root_of(n.wo, n.mu)
        self.e_1, self.e_b, self.e_out, self.e_in = self.look_up()

    def root_of(self, w, cosine):
        """Returns the root in Lambda = (root / cosine - 1) / 2 (Heitz 2014, eqs. 72 and 80)."""
        n = self.n
        if self.tangent is None:
            squared = self.alphas[0]**2
            return n.math("SQRT", n.math("MULTIPLY_ADD", n.product(cosine, cosine), 1 - squared, squared))
        along = n.product(n.dot(w, self.tangent), self.alphas[0])
        across = n.product(n.dot(w, self.across), self.alphas[1])
        squares = [n.product(value, value) for value in (along, across, cosine)]
        return n.math("SQRT", n.math("ADD", n.math("ADD", squares[0], squares[1]), squares[2]))

    def look_up(self):
        """Returns the four albedos at wo, from an image whose rows are azimuths from the tangent."""
        n = self.n
        rows = 1 if self.tangent is None else HEIGHT
        places = [(((i + 0.5) / WIDTH)**2, (j + 0.5) / rows * math.pi / 2) for j in range(rows) for i in range(WIDTH)]
        values = [albedos(mu, phi, self.alphas, self.ior, self.reflected) for mu, phi in places]
        row = 0.5
        if self.tangent is not None:
            sides = [n.math("ABSOLUTE", n.dot(n.wo, axis)) for axis in (self.across, self.tangent)]
            row = n.product(n.math("ARCTAN2", *sides), 2 / math.pi)
        place = n.node("ShaderNodeCombineXYZ", n.math("SQRT", n.mu), row, 0.0).outputs[0]
        found = []
        for pair in (0, 2):  # Two images, because nodes give alpha another meaning than colours.
            image = bpy.data.images.new("albedo", WIDTH, rows, float_buffer=True, is_data=True)
            image.pixels.foreach_set(numpy.array([(*v[pair:pair + 2], 0, 1) for v in values], "f").ravel())
            texture = n.node("ShaderNodeTexImage", place, image=image, extension="EXTEND")
            found += n.node("ShaderNodeSeparateXYZ", texture.outputs["Color"]).outputs[:2]
        return found

    def weight(self, cosine, w):
        """Returns 2 x / h_z cosine / (mu root_w + cosine root): G_2 cosine over the density of the direction w."""
        n = self.n
        seen = n.product(n.math("GREATER_THAN", self.x, 0.0), n.math("GREATER_THAN", cosine, 0.0))
        sum_of_roots = n.math("ADD", n.product(n.mu, self.root_of(w, cosine)), n.product(cosine, self.root))
        return n.math("DIVIDE", n.product(seen, 2.0, self.x, cosine), n.product(self.h_z, sum_of_roots))

    def gain(self, f0):
        """Returns M(f_0)."""
        lost = self.n.math("DIVIDE", self.n.one_less(self.e_1), self.e_1)
        return self.n.sum((1.0, 1.0, 1.0), self.n.scaled(f0, lost))

    def albedo(self, f0, f90):
        """Returns min(max-component of M(f_0) (f_0 E_A + f_90 E_B), 1)."""
        n, f0 = self.n, (max(f0),) * 3
        e = n.sum(n.scaled(f0, n.math("SUBTRACT", self.e_1, self.e_b)), n.scaled((f90,) * 3, self.e_b))
        components = n.node("ShaderNodeSeparateXYZ", n.vector("MULTIPLY", self.gain(f0), e)).outputs
        return n.math("MINIMUM", components[0], 1.0)

    def mirrored(self):
        """Returns the direction wo mirrored at h, and its cosine with n."""
        n = self.n
        w = n.vector("SUBTRACT", n.scaled(self.h, n.product(2.0, self.x)), n.wo)
        return w, n.dot(w, n.normal)

    def reflection(self, f0, f90, share):
        """Returns the nodes of share D G_2 / (4 mu_o mu_i) F(f_0, f_90, x) M(f_0)."""
        n = self.n
        wi, mu_i = self.mirrored()
        schlick = n.math("POWER", n.one_less(self.x), 5.0)
        fresnel = n.sum(f0, n.scaled(tuple(f90 - v for v in f0), schlick))
        # G_1 G_1 / G_2 for the part that Cycles' own node has.
        root_i = self.root_of(wi, mu_i)
        separable = n.math("DIVIDE", n.product(2.0, n.math("ADD", n.product(n.mu, root_i), n.product(mu_i, self.root))),
                           n.product(n.math("ADD", n.mu, self.root), n.math("ADD", mu_i, root_i)))
        beyond = n.vector("SUBTRACT", n.vector("MULTIPLY", fresnel, self.gain(f0)), n.scaled(f0, separable))
        rest = n.scaled(beyond, self.weight(mu_i, wi), share)
        own = n.scaled(f0, share)
        nodes = [n.node("ShaderNodeBsdfGlossy", rest, distribution="SHARP", normal=self.h)]
        if self.tangent is None:
            return [n.node("ShaderNodeBsdfGlossy", own, self.alphas[0]**0.5, distribution="GGX"), *nodes]
        # The node has alpha_t = roughness^2 / (1 + a) and alpha_b = roughness^2 (1 + a) for its anisotropy a < 0.
        a, b = self.alphas
        gloss = n.node("ShaderNodeBsdfAnisotropic", own, (a * b)**0.25, (b / a)**0.5 - 1, 0.0, distribution="GGX")
        n.link(self.tangent, gloss.inputs["Tangent"])
        return [gloss, *nodes]

    def interface(self, reflected, color, share):
        """Returns the nodes of share / E_s (s_r / s_m f_r + c f_t); `reflected` is s_r outside."""
        n = self.n
        share = n.math("DIVIDE", share, n.mixed(self.e_out, self.e_in))
        fresnel = n.node("ShaderNodeFresnel", self.ior, self.h).outputs[0]
        wi, mu_i = self.mirrored()
        dimmed = n.sum(n.scaled(reflected, n.one_less(n.inside)), n.scaled((1.0, 1.0, 1.0), n.inside))
        bounced = n.scaled(dimmed, fresnel, self.weight(mu_i, wi), share)
        bent = n.node("ShaderNodeVectorMath", n.scaled(n.wo, -1.0), self.h, operation="REFRACT")
        n.link(n.mixed(1 / self.ior, self.ior), bent.inputs[3])
        wi = bent.outputs["Vector"]
        kept = n.product(fresnel, n.mixed(self.reflected, 1.0))
        passed = n.scaled(color, n.one_less(kept), self.weight(n.product(n.dot(wi, n.normal), -1.0), wi), share)
        return [n.node("ShaderNodeBsdfGlossy", bounced, distribution="SHARP", normal=self.h),
                n.node("ShaderNodeBsdfRefraction", passed, 0.0, self.ior, distribution="SHARP", normal=self.h)]


class Material:
    """The factors of a glTF material."""

    def __init__(self, source):
        self.extensions, pbr = source.get("extensions", {}), source.get("pbrMetallicRoughness", {})
        self.color, self.metallic = tuple(pbr.get("baseColorFactor", (1.0,) * 4)[:3]), pbr.get("metallicFactor", 1.0)
        self.alpha = pbr.get("roughnessFactor", 1.0)**2
        self.ior, self.specular = self.of("ior", "ior", 1.5), self.of("specular", "specularFactor", 1.0)
        self.tint = tuple(self.of("specular", "specularColorFactor", (1.0,) * 3))
        self.transmission = self.of("transmission", "transmissionFactor", 0.0)
        self.backlit = self.of("diffuse_transmission", "diffuseTransmissionFactor", 0.0)
        self.solid = self.of("volume", "thicknessFactor", 0.0) > 0 and self.transmission + self.backlit > 0
        strength = self.of("emissive_strength", "emissiveStrength", 1.0)
        self.emission = tuple(strength * v for v in source.get("emissiveFactor", (0.0,) * 3))
        self.coat = self.of("clearcoat", "clearcoatFactor", 0.0)
        self.is_glossy = max(self.metallic, self.specular, self.coat, self.transmission) > 0
        thin_and_rough = self.transmission > 0 and not self.solid and self.alpha >= 1e-4
        others = {"KHR_materials_" + name for name in ("sheen", "iridescence", "dispersion", "unlit")}
        self.is_known = "Texture\"" not in json.dumps(source) and not others & set(self.extensions) and not thin_and_rough

    def of(self, extension, key, default):
        return self.extensions.get("KHR_materials_" + extension, {}).get(key, default)

    def shader(self, n):
        """Returns the last node of the surface."""
        nodes, share = [n.node("ShaderNodeEmission", (*self.emission, 1.0))] if max(self.emission) > 0 else [], 1.0
        if self.coat > 0:
            facets = Facets(n, self.of("clearcoat", "clearcoatRoughnessFactor", 0.0)**2)
            nodes += facets.reflection((0.04,) * 3, 1.0, self.coat)
            share = n.one_less(n.product(self.coat, facets.albedo((0.04,) * 3, 1.0)))
        f0 = tuple(min(((self.ior - 1) / (self.ior + 1))**2 * v, 1) * self.specular for v in self.tint)
        facets = Facets(n, self.alpha, self.ior, self.of("anisotropy", "anisotropyStrength", 0.0),
                        self.of("anisotropy", "anisotropyRotation", 0.0)) if self.metallic or max(f0) else None
        if self.metallic > 0:
            nodes += facets.reflection(self.color, 1.0, n.product(share, self.metallic))
        share = n.product(share, 1 - self.metallic)
        opaque = n.product(share, 1 - self.transmission if self.solid else 1.0)
        if max(f0) > 0 and self.metallic < 1:
            if not self.solid or self.transmission < 1:
                nodes += facets.reflection(f0, self.specular, opaque)
            opaque = n.product(opaque, n.one_less(facets.albedo(f0, self.specular)))
        if self.metallic < 1:
            nodes += self.base(n, share, opaque)
        total = nodes[0] if nodes else n.node("ShaderNodeBsdfDiffuse", (0.0, 0.0, 0.0, 1.0))
        for node in nodes[1:]:
            total = n.node("ShaderNodeAddShader", total.outputs[0], node.outputs[0])
        return total

    def base(self, n, share, opaque):
        """Returns the nodes below the dielectric reflection, and those of a solid's interface."""
        nodes, through = [], self.transmission if not self.solid else 0.0
        if self.transmission < 1:
            nodes.append(n.node("ShaderNodeBsdfDiffuse", n.scaled(self.color, opaque, (1 - through) * (1 - self.backlit))))
        if self.transmission < 1 and self.backlit > 0:
            color = self.of("diffuse_transmission", "diffuseTransmissionColorFactor", (1.0,) * 3)
            nodes.append(n.node("ShaderNodeBsdfTranslucent", n.scaled(color, opaque, (1 - through) * self.backlit)))
        if through > 0:
            nodes.append(n.node("ShaderNodeBsdfTransparent", n.scaled(self.color, opaque, through)))
        if self.solid and self.transmission > 0:
            reflected = tuple(min(self.specular * v, 1) for v in self.tint)
            share = n.product(share, self.transmission)
            nodes += Facets(n, self.alpha, self.ior, reflected=max(reflected)).interface(reflected, self.color, share)
        return nodes

    def absorption(self, n):
        """Returns the node of the volume, or None."""
        distance = self.of("volume", "attenuationDistance", math.inf)
        per_metre = [-math.log(max(v, 1e-30)) / distance for v in self.of("volume", "attenuationColor", (1.0,) * 3)]
        if not self.solid or max(per_metre) <= 0:
            return None
        return n.node("ShaderNodeVolumeAbsorption", (*(1 - v / max(per_metre) for v in per_metre), 1.0), max(per_metre))


def materials_of(path):
    """Returns the materials of a .gltf or .glb file by the names that the importer gives them."""
    data = open(path, "rb").read()
    if data[:4] == b"glTF":
        data = data[20:20 + struct.unpack_from("<I", data, 12)[0]]
    sources = json.loads(data).get("materials", [])
    return {source.get("name", f"Material_{k}"): Material(source) for k, source in enumerate(sources)}


@bpy.app.handlers.persistent
def use_our_materials(*_):
    known = materials_of(sys.argv[sys.argv.index("--") + 1])
    for material in bpy.data.materials:
        tree = material.node_tree
        for principled in [node for node in tree.nodes if node.type == "BSDF_PRINCIPLED"] if tree else []:
            ours = known.get(material.name)
            if ours and ours.is_glossy and os.environ.get("HALFLIGHT_IMPORTED_GLOSSY"):
                continue
            if ours is None or not ours.is_known or principled.inputs["Base Color"].is_linked:
                print("left as imported:", material.name)
                continue
            n = Nodes(tree)
            shader, volume = ours.shader(n), ours.absorption(n)
            for link in list(principled.outputs["BSDF"].links):
                tree.links.new(shader.outputs[0], link.to_socket)
            output = tree.get_output_node("CYCLES")
            for link in list(output.inputs["Volume"].links):
                tree.links.remove(link)
            if volume:
                tree.links.new(volume.outputs[0], output.inputs["Volume"])


@bpy.app.handlers.persistent
def use_our_lens(*_):
    """Takes the lens of a camera from the extras of the glTF file, which the importer stores as custom properties."""
    scene = bpy.context.scene
    camera = scene.camera.data
    if "aperture_fstop" not in camera or "focus_distance" not in camera:
        return
    # The importer sets the angle along the vertical sides. The sensor lies along the longer sides of the picture.
    aspect = scene.render.resolution_x / scene.render.resolution_y
    half = math.tan(camera.angle_y / 2) * max(aspect, 1)
    camera.sensor_fit, camera.lens_unit = "AUTO", "MILLIMETERS"
    camera.sensor_width = camera.get("sensor_width", 36)
    camera.lens = camera.sensor_width / (2 * half)
    camera.dof.use_dof, camera.dof.focus_object = True, None
    camera.dof.focus_distance, camera.dof.aperture_fstop = camera["focus_distance"], camera["aperture_fstop"]
    camera.dof.aperture_blades = camera.get("aperture_blades", 0)
    camera.dof.aperture_rotation = camera.get("aperture_rotation", 0)


@bpy.app.handlers.persistent
def begin(*_):
    global begun
    begun = time.process_time()


@bpy.app.handlers.persistent
def tell_cpu_time(*_):
    print(json.dumps({"cpu_seconds": time.process_time() - begun}), flush=True)


bpy.app.handlers.render_init.append(use_our_materials)
bpy.app.handlers.render_init.append(use_our_lens)
bpy.app.handlers.render_init.append(begin)
bpy.app.handlers.render_complete.append(tell_cpu_time)
