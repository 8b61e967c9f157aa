"""Replaces the materials of a glTF scene by those of shaders/SHADING.md before Cycles renders it:

    blender -b --factory-startup -P tools/cycles_materials.py -P .../cycles_render.py -- SCENE OUT.exr ...

Blender 3.4 imports every material as a Principled node, whose models differ from ours:
- Its diffuse lobe is Disney's, which is brighter than Lambert's at grazing angles, and it ignores KHR_materials_specular. A
  purely diffuse Cornell box becomes 9 % too bright. Materials without metal and emission become a Diffuse node here.
- Its metal is single-scattering GGX with separable Smith terms, G_1 G_1, and the Fresnel curve of an ior of 1.5. Ours has
  the height-correlated G_2, Schlick's F and Turquin's gain M for multiple scattering. In the imported Cornell box with
  metals, blocks of 16x16 pixels are up to 4 % darker because of M. G_2 and F make less than 0.3 % each.
  A metal becomes the sum of two nodes. The first is Cycles' own Glossy node in the base colour, D G_1 G_1 / (4 mu_o mu_i) c.
  The second is the remainder of our model, D / (4 mu_o mu_i) (G_2 F M - G_1 G_1 c) >= 0. No node of Cycles has this shape.
  It is therefore a mirror (sharp Glossy node) whose normal h is drawn per hit by D cos(h, n), with a colour that compensates
  for the density: its mean is the term. If HALFLIGHT_IMPORTED_METALS is set in the environment, metals stay as imported.
Materials with textures and partly metallic ones stay as imported, and their names are printed.

Prints the CPU seconds of the render, all threads, as a line of JSON in addition to that of cycles_render.py.

Cycles does not count the first reflection as a bounce: its --bounces N are our --bounces N + 1.
"""
import json
import os
import time

import bpy
import numpy


def smith_root(cosine, alpha):
    """Returns the root in Lambda = (root / cosine - 1) / 2 (Heitz 2014, eq. 72)."""
    return (alpha**2 + (1 - alpha**2) * cosine**2)**0.5


def albedo(mu, alpha, steps=256):
    """Returns E_1 by the midpoint rule over the two numbers that choose h. The first is 1 - s^4, because its tail is long."""
    s, phi = numpy.meshgrid((numpy.arange(steps) + 0.5) / steps, (numpy.arange(steps) + 0.5) * numpy.pi / steps)
    h_z = (s**4 / (alpha**2 + (1 - alpha**2) * s**4))**0.5
    x = (1 - mu**2)**0.5 * (1 - h_z**2)**0.5 * numpy.cos(phi) + mu * h_z
    mu_i = 2 * x * h_z - mu
    seen = (x > 0) & (mu_i > 0)
    weight = 2 * x * mu_i / (h_z * (mu * smith_root(mu_i, alpha) + mu_i * smith_root(mu, alpha)))
    return numpy.mean(numpy.where(seen, weight * 4 * s**3, 0))


class Nodes:
    """Builds arithmetic in the node tree of a material. Operands are sockets or constants."""

    def __init__(self, tree):
        self.tree = tree

    def node(self, kind, *operands, **settings):
        node = self.tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        for socket, operand in zip(node.inputs, operands):
            if isinstance(operand, bpy.types.NodeSocket):
                self.tree.links.new(operand, socket)
            else:
                socket.default_value = operand
        return node

    def math(self, operation, *operands):
        return self.node("ShaderNodeMath", *operands, operation=operation).outputs[0]

    def product(self, first, *others):
        for other in others:
            first = self.math("MULTIPLY", first, other)
        return first

    def vector(self, operation, *operands):
        outputs = self.node("ShaderNodeVectorMath", *operands, operation=operation).outputs
        return outputs["Value" if operation == "DOT_PRODUCT" else "Vector"]

    def scaled(self, vector, factor):
        node = self.node("ShaderNodeVectorMath", vector, operation="SCALE")
        self.tree.links.new(factor, node.inputs["Scale"])
        return node.outputs["Vector"]

    def smith_root(self, cosine, alpha):
        squared = self.math("MULTIPLY", cosine, cosine)
        return self.math("SQRT", self.math("MULTIPLY_ADD", squared, 1 - alpha**2, alpha**2))

    def albedo(self, mu, alpha):
        """Returns E_1 as a curve over sqrt(mu), which spreads the steep part near 0."""
        node = self.node("ShaderNodeFloatCurve", 1.0, self.math("SQRT", mu))
        curve = node.mapping.curves[0]
        places = numpy.linspace(0, 1, 129)
        while len(curve.points) < len(places):
            curve.points.new(0.5, 0.5)
        for point, place in zip(curve.points, places):
            point.location = (place, albedo(max(place**2, 1e-6), alpha))
            point.handle_type = "VECTOR"
        node.mapping.update()
        return node.outputs[0]


def metal(tree, color, alpha):
    n = Nodes(tree)
    geometry = n.node("ShaderNodeNewGeometry").outputs
    normal, wo = geometry["Normal"], geometry["Incoming"]
    mu = n.vector("DOT_PRODUCT", normal, wo)

    # Three random numbers for every point that a path hits.
    noise = n.node("ShaderNodeTexWhiteNoise", geometry["Position"], noise_dimensions="3D").outputs["Color"]
    u, v, w = n.node("ShaderNodeSeparateXYZ", noise).outputs

    # h: its angle to n is distributed as D cos(h, n) (Walter 2007, eq. 35), its azimuth as that of a uniform direction.
    one_less = n.math("SUBTRACT", 1.0, u)
    h_z = n.math("SQRT", n.math("DIVIDE", one_less, n.math("MULTIPLY_ADD", u, alpha**2 - 1, 1.0)))
    z = n.math("MULTIPLY_ADD", v, 2.0, -1.0)
    radius = n.math("SQRT", n.math("SUBTRACT", 1.0, n.product(z, z)))
    phi = n.product(w, 2 * numpy.pi)
    sphere = n.node("ShaderNodeCombineXYZ", n.product(radius, n.math("COSINE", phi)),
                    n.product(radius, n.math("SINE", phi)), z).outputs[0]
    along = n.scaled(normal, n.vector("DOT_PRODUCT", normal, sphere))
    tangent = n.vector("NORMALIZE", n.vector("SUBTRACT", sphere, along))
    h_t = n.math("SQRT", n.math("SUBTRACT", 1.0, n.product(h_z, h_z)))
    h = n.vector("ADD", n.scaled(normal, h_z), n.scaled(tangent, h_t))

    # The density of wi is D h_z / (4 x). The term times mu_i is this density times
    # 2 x mu_i / h_z (F M / (mu root_i + mu_i root) - 2 c / ((mu + root) (mu_i + root_i))).
    x = n.vector("DOT_PRODUCT", wo, h)
    mu_i = n.math("SUBTRACT", n.product(2.0, x, h_z), mu)
    seen = n.product(n.math("GREATER_THAN", x, 0.0), n.math("GREATER_THAN", mu_i, 0.0))
    root, root_i = n.smith_root(mu, alpha), n.smith_root(mu_i, alpha)
    correlated = n.math("DIVIDE", 1.0, n.math("ADD", n.product(mu, root_i), n.product(mu_i, root)))
    separable = n.math("DIVIDE", 2.0, n.product(n.math("ADD", mu, root), n.math("ADD", mu_i, root_i)))
    schlick = n.math("POWER", n.math("SUBTRACT", 1.0, x), 5.0)
    e_1 = n.albedo(mu, alpha)
    lost = n.math("DIVIDE", n.math("SUBTRACT", 1.0, e_1), e_1)
    c = tuple(color[:3])
    fresnel = n.vector("ADD", c, n.scaled(tuple(1 - v for v in c), schlick))
    gain = n.vector("ADD", (1.0, 1.0, 1.0), n.scaled(c, lost))
    beyond = n.vector("SUBTRACT", n.scaled(n.vector("MULTIPLY", fresnel, gain), correlated), n.scaled(c, separable))
    weight = n.product(seen, n.math("DIVIDE", n.product(2.0, x, mu_i), h_z))
    mirror = n.node("ShaderNodeBsdfGlossy", n.scaled(beyond, weight), distribution="SHARP")
    tree.links.new(h, mirror.inputs["Normal"])
    own = n.node("ShaderNodeBsdfGlossy", color, alpha**0.5, distribution="GGX")
    return n.node("ShaderNodeAddShader", own.outputs[0], mirror.outputs[0])


def replacement(tree, inputs):
    """Returns the node that replaces a Principled node; None if the latter stays."""
    metallic, color = inputs["Metallic"].default_value, inputs["Base Color"].default_value
    if metallic not in (0, 1) or any(inputs[i].is_linked for i in ("Base Color", "Metallic", "Roughness", "Normal")):
        return None
    if metallic == 0:
        return Nodes(tree).node("ShaderNodeBsdfDiffuse", color)
    return metal(tree, color, inputs["Roughness"].default_value**2)


@bpy.app.handlers.persistent
def use_our_materials(*_):
    for material in bpy.data.materials:
        tree = material.node_tree
        for principled in [node for node in tree.nodes if node.type == "BSDF_PRINCIPLED"] if tree else []:
            inputs = principled.inputs
            is_light = max(inputs["Emission"].default_value[:3]) > 0
            if is_light or inputs["Metallic"].default_value > 0 and os.environ.get("HALFLIGHT_IMPORTED_METALS"):
                continue
            node = replacement(tree, inputs)
            if node is None:
                print("left as imported:", material.name)
                continue
            for link in list(principled.outputs["BSDF"].links):
                tree.links.new(node.outputs[0], link.to_socket)


@bpy.app.handlers.persistent
def begin(*_):
    global begun
    begun = time.process_time()


@bpy.app.handlers.persistent
def tell_cpu_time(*_):
    print(json.dumps({"cpu_seconds": time.process_time() - begun}), flush=True)


bpy.app.handlers.render_init.append(use_our_materials)
bpy.app.handlers.render_init.append(begin)
bpy.app.handlers.render_complete.append(tell_cpu_time)
