"""Run before a Cycles render of a glTF scene, so that its materials are those of shaders/SHADING.md:

    blender -b --factory-startup -P tools/cycles_materials.py -P .../cycles_render.py -- SCENE OUT.exr ...

Blender 3.4 imports every material as a Principled node, whose models are others:
- Its diffuse lobe is Disney's, brighter than Lambert's at grazing angles, and it ignores KHR_materials_specular: a purely
  diffuse Cornell box comes out 9 % too bright. What is neither metal nor light becomes a Diffuse node here.
- Its metal is single-scattering GGX, ours has Turquin's gain for multiple scattering: without it blocks of 16x16 pixels
  of a Cornell box with metals are up to 4 % darker. A metal's base colour c becomes c M(c), which depends on the angle to
  the viewer alone. What remains different is less than 0.3 % of any block there: the Smith term (separable there,
  height-correlated here) and the Fresnel curve (of an ior of 1.5 there, Schlick's here).
  With HALFLIGHT_IMPORTED_METALS set in the environment metals stay as they are.
What has a texture or is partly metallic is left as imported, and named.

Cycles does not count the first reflection as a bounce: its --bounces N are our --bounces N + 1.
"""
import os

import bpy
import numpy


def smith_root(cosine, alpha):
    """Lambda = (root / cosine - 1) / 2 (Heitz 2014, eq. 72)."""
    return (alpha**2 + (1 - alpha**2) * cosine**2)**0.5


def albedo(mu, alpha, steps=256):
    """E_1 by the midpoint rule over the two numbers that choose h, the first as 1 - s^4: its tail is long."""
    s, phi = numpy.meshgrid((numpy.arange(steps) + 0.5) / steps, (numpy.arange(steps) + 0.5) * numpy.pi / steps)
    h_z = (s**4 / (alpha**2 + (1 - alpha**2) * s**4))**0.5
    x = (1 - mu**2)**0.5 * (1 - h_z**2)**0.5 * numpy.cos(phi) + mu * h_z
    mu_i = 2 * x * h_z - mu
    seen = (x > 0) & (mu_i > 0)
    weight = 2 * x * mu_i / (h_z * (mu * smith_root(mu_i, alpha) + mu_i * smith_root(mu, alpha)))
    return numpy.mean(numpy.where(seen, weight * 4 * s**3, 0))


def add_gain(tree, principled):
    """Base colour c to c M(c) = c + c^2 (1 - E_1) / E_1."""

    def node(kind, *operands, **settings):
        new = tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(new, name, value)
        for socket, operand in zip(new.inputs, operands):
            if isinstance(operand, bpy.types.NodeSocket):
                tree.links.new(operand, socket)
            else:
                socket.default_value = operand
        return new

    geometry = node("ShaderNodeNewGeometry").outputs
    mu = node("ShaderNodeVectorMath", geometry["Normal"], geometry["Incoming"], operation="DOT_PRODUCT").outputs["Value"]
    # E_1 over the root of mu, which spreads its steep part near 0.
    e_1 = node("ShaderNodeFloatCurve", 1.0, node("ShaderNodeMath", mu, operation="SQRT").outputs[0])
    places = numpy.linspace(0, 1, 129)
    points = e_1.mapping.curves[0].points
    while len(points) < len(places):
        points.new(0.5, 0.5)
    alpha = principled.inputs["Roughness"].default_value**2
    for point, place in zip(points, places):
        point.location = (place, albedo(max(place**2, 1e-6), alpha))
        point.handle_type = "VECTOR"
    e_1.mapping.update()
    lost = node("ShaderNodeMath", node("ShaderNodeMath", 1.0, e_1.outputs[0], operation="DIVIDE").outputs[0], 1.0,
                operation="SUBTRACT").outputs[0]
    c = principled.inputs["Base Color"].default_value[:3]
    gained = node("ShaderNodeVectorMath", lost, [v * v for v in c], c, operation="MULTIPLY_ADD").outputs["Vector"]
    tree.links.new(gained, principled.inputs["Base Color"])


def become_lambert(tree, principled):
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = principled.inputs["Base Color"].default_value
    for link in list(principled.outputs["BSDF"].links):
        tree.links.new(diffuse.outputs["BSDF"], link.to_socket)


@bpy.app.handlers.persistent
def use_our_materials(*_):
    for material in bpy.data.materials:
        tree = material.node_tree
        for principled in [node for node in tree.nodes if node.type == "BSDF_PRINCIPLED"] if tree else []:
            inputs = principled.inputs
            metallic = inputs["Metallic"].default_value
            if max(inputs["Emission"].default_value[:3]) > 0:
                continue
            if metallic not in (0, 1) or any(inputs[i].is_linked for i in ("Base Color", "Metallic", "Roughness")):
                print("left as imported:", material.name)
            elif metallic == 0:
                become_lambert(tree, principled)
            elif not os.environ.get("HALFLIGHT_IMPORTED_METALS"):
                add_gain(tree, principled)


bpy.app.handlers.render_init.append(use_our_materials)
