"""Builds arithmetic and normals in the node trees of Blender, for cycles_materials.py."""
import copy
import math

import bpy


def is_socket(value):
    return isinstance(value, bpy.types.NodeSocket)


def largest(value):
    """Returns the largest value that a number, a tuple or a socket may have."""
    return 1 if is_socket(value) else max(value) if isinstance(value, tuple) else value


class Nodes:
    """Builds arithmetic in the node tree of a material. Operands are sockets or constants."""

    def __init__(self, tree):
        self.tree = tree
        geometry = self.node("ShaderNodeNewGeometry").outputs
        self.wo, self.inside, self.position = geometry["Incoming"], geometry["Backfacing"], geometry["Position"]
        self.normal = self.horizon = geometry["Normal"]
        self.mu = self.dot(self.normal, self.wo)

    @property
    def is_mapped(self):
        return self.normal is not self.horizon

    def at(self, normal):
        """Returns these nodes with another normal; the horizon stays."""
        other = copy.copy(self)
        other.normal, other.mu = normal, self.dot(normal, self.wo)
        return other

    def mapped(self, color, scale, uv_map):
        """Returns these nodes with the normal of a normal map, bent towards wo where it points away."""
        x, y, z = self.node("ShaderNodeSeparateXYZ", color).outputs
        # Blender's node takes 2 texel - 1 and has another meaning of a strength.
        x, y = (self.math("MULTIPLY_ADD", v, scale, 0.5 - 0.5 * scale) for v in (x, y))
        normal = self.node("ShaderNodeNormalMap", 1.0, self.node("ShaderNodeCombineXYZ", x, y, z).outputs[0],
                           uv_map=uv_map).outputs[0]
        mu = self.dot(normal, self.wo)
        bend = self.product(self.math("LESS_THAN", mu, 0.0), self.math("SUBTRACT", 1e-3, mu))
        return self.at(self.vector("NORMALIZE", self.sum(normal, self.scaled(self.wo, bend))))

    def mirror_height(self):
        """Returns wo mirrored at the normal, its cosine with the horizon's normal, and the least one of lobes."""
        r = self.vector("SUBTRACT", self.scaled(self.normal, self.product(2.0, self.mu)), self.wo)
        least = self.math("MINIMUM", self.product(0.9, self.dot(self.horizon, self.wo)), 0.01)
        return r, self.dot(r, self.horizon), least

    def above_horizon(self):
        """Returns these nodes with the normal n_s, whose mirror direction is above the horizon."""
        if not self.is_mapped:
            return self
        r, height, e = self.mirror_height()
        along = self.vector("NORMALIZE", self.vector("SUBTRACT", r, self.scaled(self.horizon, height)))
        raised = self.sum(self.wo, self.scaled(along, self.math("SQRT", self.one_less(self.product(e, e)))),
                          self.scaled(self.horizon, e))
        low = self.math("LESS_THAN", height, e)
        return self.at(self.sum(self.scaled(self.normal, self.one_less(low)),
                                self.scaled(self.vector("NORMALIZE", raised), low)))

    def noise(self):
        """Returns three random numbers of a hit."""
        noise = self.node("ShaderNodeTexWhiteNoise", self.position, noise_dimensions="3D").outputs["Color"]
        return self.node("ShaderNodeSeparateXYZ", noise).outputs

    def on_sphere(self, v, w):
        """Returns a uniform direction of two random numbers."""
        z, turn = self.math("MULTIPLY_ADD", v, 2.0, -1.0), self.product(w, 2 * math.pi)
        radius = self.math("SQRT", self.one_less(self.product(z, z)))
        return self.node("ShaderNodeCombineXYZ", self.product(radius, self.math("COSINE", turn)),
                         self.product(radius, self.math("SINE", turn)), z).outputs[0]

    def diffuse(self, color):
        """Returns the nodes of color / pi about the normal."""
        if not self.is_mapped:
            return [self.node("ShaderNodeBsdfDiffuse", color)]
        # Cycles bends normals whose mirror direction is too low, and multiplies by -g^3 + g^2 + g where g < 1 (Chiang,
        # Li, Burley 2019). The mirror has a direction wi that is distributed by its cosine with the normal.
        _, height, least = self.mirror_height()
        bent = self.math("LESS_THAN", height, least)
        _, v, w = self.noise()
        wi = self.vector("NORMALIZE", self.sum(self.normal, self.on_sphere(v, w)))
        up = self.dot(self.horizon, wi)
        g = self.math("DIVIDE", up, self.product(self.dot(self.normal, wi), self.dot(self.horizon, self.normal)))
        g = self.math("MAXIMUM", self.math("MINIMUM", g, 1.0), 0.0)
        kept = self.product(g, self.math("MULTIPLY_ADD", g, self.one_less(g), 1.0))
        missing = self.product(self.math("GREATER_THAN", up, 0.0), self.math("MAXIMUM", bent, self.one_less(kept)))
        h = self.vector("NORMALIZE", self.sum(wi, self.wo))
        return [self.node("ShaderNodeBsdfDiffuse", self.scaled(color, self.one_less(bent)), normal=self.normal),
                self.node("ShaderNodeBsdfGlossy", self.scaled(color, missing), distribution="SHARP", normal=h)]

    def link(self, operand, socket):
        if is_socket(operand):
            self.tree.links.new(operand, socket)
        else:  # Colours have a fourth component.
            socket.default_value = (*operand, 1.0) if socket.type == "RGBA" and len(operand) == 3 else operand

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

    def largest(self, vector):
        """Returns the largest component."""
        x, y, z = self.node("ShaderNodeSeparateXYZ", vector).outputs
        return self.math("MAXIMUM", self.math("MAXIMUM", x, y), z)

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
