"""Replaces the materials of a glTF scene by those of shaders/SHADING.md before Cycles renders it:

    blender -b --factory-startup -P tools/figures/cycles_materials.py -P .../cycles_render.py -- SCENE OUT.exr ...

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
- Textures, with transform, coordinate set, wrap modes and filter, and COLOR_0 multiply the factors (cycles_textures.py).
  Alpha mixes in a Transparent node, by its value (blend) or by the cutoff (mask).
- With a normal map, Cycles dims its Diffuse node by a term for bumps, and bends normals. A mirror node with directions by
  the cosine adds what is missing.

Mirror nodes do not see lights without size: point, spot and directional lights, to which Cycles gives no surface. The
remainder of a rough reflection, and that of a normal map, lack the light of these. The script prints the names of such
materials and lights. Only scenes that are lit by surfaces or an environment are a check of these materials.

If HALFLIGHT_IMPORTED_GLOSSY is set in the environment, all materials that are not purely diffuse stay as imported: the
second node makes noise, which a comparison of times should not contain. Material.why_not() lists what else stays as
imported. The script prints the names and reasons.

Prints the CPU seconds of the render, all threads, as a line of JSON in addition to that of cycles_render.py.

Cycles does not count the first reflection as a bounce: its --bounces N are our --bounces N + 1.
"""
import json
import math
import os
import sys
import time

import bpy
import numpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import cycles_textures
from cycles_nodes import Nodes, is_socket, largest

# Images of albedos have columns by sqrt(mu), which spreads the steep part near 0, and rows by azimuth or by roughness.
WIDTH, HEIGHT = 128, 24
ROUGH_WIDTH = 64  # columns of tables whose rows are roughnesses


def albedos(mu, phi, alphas, ior, reflected, steps=96):
    """Returns E_1 and E_B, or with an ior E_s from outside and from inside, for a wo with the cosine mu and the azimuth
    phi.

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
    if ior is None:
        return [numpy.mean(mirrored), numpy.mean(mirrored * (1 - x)**5)]
    solid = []
    for eta, most in ((ior, reflected), (1 / ior, 1)):
        y_squared = 1 - (1 - x * x) / (eta * eta)
        y = numpy.maximum(y_squared, 0)**0.5
        s_wave, p_wave = (x - eta * y) / (x + eta * y), (eta * x - y) / (eta * x + y)
        f = most * numpy.where(y_squared > 0, (s_wave**2 + p_wave**2) / 2, 1)
        solid.append(numpy.mean(f * mirrored + (1 - f) * weight((x / eta - y) * h - wo / eta, -1)))
    return solid


class Facets:
    """The half vector h of a hit, drawn by D cos(h, n), and the lobes that it makes."""

    def __init__(self, n, roughness, ior=None, strength=0, rotation=0, reflected=1.0):
        self.n, self.roughness, self.ior, self.reflected, self.tangent = n, roughness, ior, reflected, None
        alpha = n.product(roughness, roughness) if is_socket(roughness) else roughness**2
        self.alphas = (alpha + (1 - alpha) * strength**2, max(alpha, 1e-4)) if strength else (alpha, alpha)
        u, v, w = n.noise()
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
            sphere = n.on_sphere(v, w)
            along = n.scaled(n.normal, n.dot(n.normal, sphere))
            tilt = n.scaled(n.vector("NORMALIZE", n.vector("SUBTRACT", sphere, along)), alpha)
        self.h = n.vector("NORMALIZE", n.sum(n.normal, n.scaled(tilt, slope)))
        self.h_z, self.x = n.dot(n.normal, self.h), n.dot(n.wo, self.h)
        self.root = self.root_of(n.wo, n.mu)
        self.e_1, self.e_b = self.e_out, self.e_in = self.look_up()

    def root_of(self, w, cosine):
        """Returns the root in Lambda = (root / cosine - 1) / 2 (Heitz 2014, eqs. 72 and 80)."""
        n = self.n
        if self.tangent is None:
            squared = n.product(self.alphas[0], self.alphas[0])
            return n.math("SQRT", n.math("MULTIPLY_ADD", n.product(cosine, cosine), n.one_less(squared), squared))
        along = n.product(n.dot(w, self.tangent), self.alphas[0])
        across = n.product(n.dot(w, self.across), self.alphas[1])
        squares = [n.product(value, value) for value in (along, across, cosine)]
        return n.math("SQRT", n.math("ADD", n.math("ADD", squares[0], squares[1]), squares[2]))

    def look_up(self):
        """Returns two albedos at wo, from an image whose rows are azimuths from the tangent, or roughnesses."""
        n = self.n
        by_roughness = is_socket(self.roughness)
        rows, width = 1 if self.tangent is None and not by_roughness else HEIGHT, ROUGH_WIDTH if by_roughness else WIDTH
        values = []
        for j in range(rows):
            alphas = ((j / (rows - 1))**2,) * 2 if by_roughness else self.alphas
            phi = 0 if by_roughness else (j + 0.5) / rows * math.pi / 2
            values += [albedos(((i + 0.5) / width)**2, phi, alphas, self.ior, self.reflected) for i in range(width)]
        row = 0.5
        if by_roughness:
            row = n.math("MULTIPLY_ADD", self.roughness, (rows - 1) / rows, 0.5 / rows)
        elif self.tangent is not None:
            sides = [n.math("ABSOLUTE", n.dot(n.wo, axis)) for axis in (self.across, self.tangent)]
            row = n.product(n.math("ARCTAN2", *sides), 2 / math.pi)
        place = n.node("ShaderNodeCombineXYZ", n.math("SQRT", n.mu), row, 0.0).outputs[0]
        image = bpy.data.images.new("albedo", width, rows, float_buffer=True, is_data=True)
        image.pixels.foreach_set(numpy.array([(*pair, 0, 1) for pair in values], "f").ravel())
        texture = n.node("ShaderNodeTexImage", place, image=image, extension="EXTEND")
        return n.node("ShaderNodeSeparateXYZ", texture.outputs["Color"]).outputs[:2]

    def weight(self, cosine, w):
        """Returns 2 x / h_z cosine / (mu root_w + cosine root): G_2 cosine over the density of the direction w."""
        n = self.n
        seen = n.product(n.math("GREATER_THAN", self.x, 0.0), n.math("GREATER_THAN", cosine, 0.0))
        if n.is_mapped:
            seen = n.product(seen, n.math("GREATER_THAN", n.dot(w, n.horizon), 0.0))
        sum_of_roots = n.math("ADD", n.product(n.mu, self.root_of(w, cosine)), n.product(cosine, self.root))
        return n.math("DIVIDE", n.product(seen, 2.0, self.x, cosine), n.product(self.h_z, sum_of_roots))

    def gain(self, f0):
        """Returns M(f_0)."""
        lost = self.n.math("DIVIDE", self.n.one_less(self.e_1), self.e_1)
        return self.n.sum((1.0, 1.0, 1.0), self.n.scaled(f0, lost))

    def albedo(self, f0, f90):
        """Returns min(max-component of M(f_0) (f_0 E_A + f_90 E_B), 1)."""
        n = self.n
        most = n.largest(f0)
        e = n.math("ADD", n.product(most, n.math("SUBTRACT", self.e_1, self.e_b)), n.product(f90, self.e_b))
        gain = n.math("MULTIPLY_ADD", most, n.math("DIVIDE", n.one_less(self.e_1), self.e_1), 1.0)
        return n.math("MINIMUM", n.product(gain, e), 1.0)

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
        f90 = f90 if is_socket(f90) else (f90,) * 3
        fresnel = n.sum(f0, n.scaled(n.vector("SUBTRACT", f90, f0), schlick))
        # G_1 G_1 / G_2 for the part that Cycles' own node has.
        root_i = self.root_of(wi, mu_i)
        separable = n.math("DIVIDE", n.product(2.0, n.math("ADD", n.product(n.mu, root_i), n.product(mu_i, self.root))),
                           n.product(n.math("ADD", n.mu, self.root), n.math("ADD", mu_i, root_i)))
        beyond = n.vector("SUBTRACT", n.vector("MULTIPLY", fresnel, self.gain(f0)), n.scaled(f0, separable))
        rest = n.scaled(beyond, self.weight(mu_i, wi), share)
        own = n.scaled(f0, share)
        nodes = [n.node("ShaderNodeBsdfGlossy", rest, distribution="SHARP", normal=self.h)]
        if self.tangent is None:
            normal = n.normal if n.is_mapped else None
            return [n.node("ShaderNodeBsdfGlossy", own, self.roughness, distribution="GGX", normal=normal), *nodes]
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
    """A glTF material: factors, and textures by their pointers in the material."""

    KNOWN = {"KHR_materials_" + name for name in (
        "anisotropy", "clearcoat", "diffuse_transmission", "emissive_strength", "ior", "specular", "transmission", "unlit",
        "volume")}

    def __init__(self, document, material):
        index = material[cycles_textures.INDEX]
        source = document.json["materials"][index] if index >= 0 else {}
        self.document, self.source, self.material = document, source, material
        self.extensions, self.pbr = source.get("extensions", {}), source.get("pbrMetallicRoughness", {})
        self.metallic, self.roughness = self.pbr.get("metallicFactor", 1.0), self.pbr.get("roughnessFactor", 1.0)
        self.ior, self.specular = self.of("ior", "ior", 1.5), self.of("specular", "specularFactor", 1.0)
        self.tint = tuple(self.of("specular", "specularColorFactor", (1.0,) * 3))
        self.transmission = self.of("transmission", "transmissionFactor", 0.0)
        self.backlit = self.of("diffuse_transmission", "diffuseTransmissionFactor", 0.0)
        self.solid = self.of("volume", "thicknessFactor", 0.0) > 0 and self.transmission + self.backlit > 0
        self.strength = self.of("anisotropy", "anisotropyStrength", 0.0)
        strength = self.of("emissive_strength", "emissiveStrength", 1.0)
        self.emission = tuple(strength * v for v in source.get("emissiveFactor", (0.0,) * 3))
        self.coat, self.coat_roughness = (self.of("clearcoat", key, 0.0)
                                          for key in ("clearcoatFactor", "clearcoatRoughnessFactor"))
        self.is_unlit = "KHR_materials_unlit" in self.extensions
        self.is_glossy = max(self.metallic, self.specular, self.coat, self.transmission) > 0 and not self.is_unlit
        # Our surfaces reflect as mirrors at alpha < 1e-4. Such mirrors see no lights without size, either.
        self.has_rough_mirror = not self.is_unlit and (
            "normalTexture" in source or self.roughness >= 0.01 and max(self.metallic, self.specular) > 0 or
            self.coat > 0 and self.coat_roughness >= 0.01)

    def of(self, extension, key, default=None):
        return self.extensions.get("KHR_materials_" + extension, {}).get(key, default)

    def textures(self):
        """Returns all textures that count; occlusion and the thickness of solids do not."""
        infos = [self.source.get("normalTexture"), self.source.get("emissiveTexture")]
        for values in (self.pbr, *self.extensions.values()):
            infos += [value for key, value in values.items() if key.endswith("Texture") and key != "thicknessTexture"]
        return [info for info in infos if info]

    def why_not(self):
        """Returns why the material stays as imported; an empty text if this script can build it."""
        unknown = sorted(name for name in self.extensions if name not in self.KNOWN)
        if unknown:
            return ", ".join(unknown)
        if any(self.document.source(info) is None for info in self.textures()):
            return "a texture that Blender cannot read"
        if self.transmission > 0 and not self.solid and self.roughness >= 0.01:
            return "rough thin glass"
        rough_texture = "metallicRoughnessTexture" in self.pbr
        specular_texture = self.of("specular", "specularTexture") or self.of("specular", "specularColorTexture")
        direction_texture = self.of("anisotropy", "anisotropyTexture")
        if self.strength and (rough_texture or direction_texture or "normalTexture" in self.source):
            return "anisotropy with textures"
        if self.solid and (specular_texture or "normalTexture" in self.source):
            return "a solid with a normal map or a texture of its specular"
        if self.backlit and "normalTexture" in self.source:
            return "diffuse transmission with a normal map"
        return ""

    def read(self, n, factor, info, channels, is_color=False):
        """Returns a factor times the channels of its texture: "RGB" of a tuple, or one of a number."""
        if info is None or not largest(factor):
            return factor
        color, alpha = cycles_textures.texture(n, self.document, info, is_color)
        if channels == "RGB":
            return n.vector("MULTIPLY", color, factor)
        value = alpha if channels == "A" else n.node("ShaderNodeSeparateXYZ", color).outputs["RGB".index(channels)]
        return n.product(value, factor)

    def shader(self, n):
        """Returns the last node of the surface."""
        color, alpha = self.color_and_alpha(n)
        nodes = [n.node("ShaderNodeEmission", color)] if self.is_unlit else self.lobes(n, color)
        total = nodes[0] if nodes else n.node("ShaderNodeBsdfDiffuse", (0.0, 0.0, 0.0, 1.0))
        for node in nodes[1:]:
            total = n.node("ShaderNodeAddShader", total.outputs[0], node.outputs[0])
        mode = self.source.get("alphaMode", "OPAQUE")
        if mode == "OPAQUE":
            return total
        if mode == "MASK":
            alpha = n.one_less(n.math("LESS_THAN", alpha, self.source.get("alphaCutoff", 0.5)))
        clear = n.node("ShaderNodeBsdfTransparent", (1.0,) * 4)
        return n.node("ShaderNodeMixShader", alpha, clear.outputs[0], total.outputs[0])

    def color_and_alpha(self, n):
        *color, alpha = self.pbr.get("baseColorFactor", (1.0,) * 4)
        color = tuple(color)
        sources = [cycles_textures.vertex_color(n)] if self.material[cycles_textures.COLORED] else []
        if "baseColorTexture" in self.pbr:
            sources.append(cycles_textures.texture(n, self.document, self.pbr["baseColorTexture"], True))
        for its_color, its_alpha in sources:
            color, alpha = n.vector("MULTIPLY", its_color, color), n.product(its_alpha, alpha)
        return color, alpha

    def normal(self, n, info):
        """Returns the nodes with the normal of a normal map, if there is one."""
        if info is None:
            return n
        color = cycles_textures.texture(n, self.document, info, False)[0]
        return n.mapped(color, info.get("scale", 1.0), cycles_textures.tangent_map(self.material, info))

    def lobes(self, n, color):
        """Returns the nodes of emission and of all lobes."""
        pbr, of = self.pbr, self.of
        emission = self.read(n, self.emission, self.source.get("emissiveTexture"), "RGB", True)
        nodes, share = [n.node("ShaderNodeEmission", emission)] if largest(self.emission) > 0 else [], 1.0
        metallic = self.read(n, self.metallic, pbr.get("metallicRoughnessTexture"), "B")
        roughness = self.read(n, self.roughness, pbr.get("metallicRoughnessTexture"), "G")
        specular = self.read(n, self.specular, of("specular", "specularTexture"), "A")
        tint = self.read(n, self.tint, of("specular", "specularColorTexture"), "RGB", True)
        transmission = self.read(n, self.transmission, of("transmission", "transmissionTexture"), "R")
        below = self.normal(n, self.source.get("normalTexture"))
        if self.coat > 0:
            coat = self.read(n, self.coat, of("clearcoat", "clearcoatTexture"), "R")
            facets = Facets(self.normal(n, of("clearcoat", "clearcoatNormalTexture")).above_horizon(),
                            self.read(n, self.coat_roughness, of("clearcoat", "clearcoatRoughnessTexture"), "G"))
            nodes += facets.reflection((0.04,) * 3, 1.0, coat)
            share = n.one_less(n.product(coat, facets.albedo((0.04,) * 3, 1.0)))
        if is_socket(specular) or is_socket(tint):
            full = n.vector("MINIMUM", n.scaled(tint, ((self.ior - 1) / (self.ior + 1))**2), (1.0,) * 3)
            f0 = n.scaled(full, specular)
        else:
            f0 = tuple(min(((self.ior - 1) / (self.ior + 1))**2 * v, 1) * specular for v in tint)
        facets = Facets(below.above_horizon(), roughness, None, self.strength,
                        of("anisotropy", "anisotropyRotation", 0.0)) if self.metallic or largest(f0) else None
        if self.metallic > 0:
            nodes += facets.reflection(color, 1.0, n.product(share, metallic))
        if not is_socket(metallic) and metallic == 1:
            return nodes
        share = n.product(share, n.one_less(metallic))
        opaque = n.product(share, n.one_less(transmission) if self.solid else 1.0)
        if largest(f0) > 0:
            if not self.solid or is_socket(transmission) or transmission < 1:
                nodes += facets.reflection(f0, specular, opaque)
            opaque = n.product(opaque, n.one_less(facets.albedo(f0, specular)))
        return nodes + self.base(below, color, roughness, transmission, share, opaque)

    def base(self, n, color, roughness, transmission, share, opaque):
        """Returns the nodes below the dielectric reflection, and those of a solid's interface."""
        nodes, through = [], transmission if not self.solid else 0.0
        backlit = self.read(n, self.backlit, self.of("diffuse_transmission", "diffuseTransmissionTexture"), "A")
        if is_socket(transmission) or transmission < 1:
            kept = n.product(opaque, n.one_less(through))
            nodes += n.diffuse(n.scaled(color, kept, n.one_less(backlit)))
            if self.backlit > 0:
                factor = tuple(self.of("diffuse_transmission", "diffuseTransmissionColorFactor", (1.0,) * 3))
                passed = self.read(n, factor, self.of("diffuse_transmission", "diffuseTransmissionColorTexture"), "RGB", True)
                nodes.append(n.node("ShaderNodeBsdfTranslucent", n.scaled(passed, kept, backlit)))
        if self.transmission > 0 and not self.solid:
            nodes.append(n.node("ShaderNodeBsdfTransparent", n.scaled(color, opaque, through)))
        if self.solid and self.transmission > 0:
            reflected = tuple(min(self.specular * v, 1) for v in self.tint)
            share = n.product(share, transmission)
            nodes += Facets(n, roughness, self.ior, reflected=max(reflected)).interface(reflected, color, share)
        return nodes

    def absorption(self, n):
        """Returns the node of the volume, or None."""
        distance = self.of("volume", "attenuationDistance", math.inf)
        per_metre = [-math.log(max(v, 1e-30)) / distance for v in self.of("volume", "attenuationColor", (1.0,) * 3)]
        if not self.solid or max(per_metre) <= 0:
            return None
        return n.node("ShaderNodeVolumeAbsorption", (*(1 - v / max(per_metre) for v in per_metre), 1.0), max(per_metre))


def put(tree, shader, volume):
    """Links a surface and a volume, or none, to the output of a tree."""
    output = tree.get_output_node("CYCLES") or tree.nodes.new("ShaderNodeOutputMaterial")
    for name, node in (("Surface", shader), ("Volume", volume)):
        for link in list(output.inputs[name].links):
            tree.links.remove(link)
        if node:
            tree.links.new(node.outputs[0], output.inputs[name])


def warn_of_lights(materials):
    """Prints which mirror nodes do not see which lights."""
    lights = [light.name for light in bpy.data.lights
              if getattr(light, "shadow_soft_size", 1) == 0 or getattr(light, "angle", 1) == 0]
    if lights and materials:
        print(f"mirror nodes do not see lights without size ({', '.join(lights)}): a part of their light is missing on",
              ", ".join(materials), flush=True)


@bpy.app.handlers.persistent
def use_our_materials(*_):
    document = cycles_textures.Document(sys.argv[sys.argv.index("--") + 1])
    cycles_textures.add_default_materials()
    mirrors = []
    for material in bpy.data.materials:
        if cycles_textures.INDEX not in material:
            continue
        try:
            ours = Material(document, material)
            if ours.is_glossy and os.environ.get("HALFLIGHT_IMPORTED_GLOSSY"):
                continue
            reason = ours.why_not()
            if not reason:
                n = Nodes(material.node_tree)
                put(material.node_tree, ours.shader(n), ours.absorption(n))
        except Exception as error:  # for example a missing image, which must not keep the other materials
            reason = f"{type(error).__name__}: {error}".strip()
        if reason:
            print(f"left as imported: {material.name} ({reason})", flush=True)
        elif ours.has_rough_mirror:
            mirrors.append(material.name)
    warn_of_lights(mirrors)


@bpy.app.handlers.persistent
def use_our_sizes(*_):
    """Takes the sizes of lights from the extras of the glTF file. Cameras do not see lights."""
    for object in bpy.data.objects:
        if object.type == "LIGHT":
            object.visible_camera = False
            for key, name in (("radius", "shadow_soft_size"), ("angle", "angle")):
                if key in object.data and hasattr(object.data, name):
                    setattr(object.data, name, object.data[key])


@bpy.app.handlers.persistent
def use_our_lens(*_):
    """Sets lens and focus of the camera by the extras of the glTF file, which the importer makes custom properties."""
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


cycles_textures.watch_importer()
bpy.app.handlers.render_init.append(use_our_sizes)
bpy.app.handlers.render_init.append(use_our_materials)
bpy.app.handlers.render_init.append(use_our_lens)
bpy.app.handlers.render_init.append(begin)
bpy.app.handlers.render_complete.append(tell_cpu_time)
