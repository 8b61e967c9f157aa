"""Run before a Cycles render of a glTF scene, so that its diffuse surfaces are glTF's:

    blender -b --factory-startup -P tools/cycles_lambert.py -P .../cycles_render.py -- SCENE OUT.exr ...

Blender 3.4 imports every material as a Principled node, ignores KHR_materials_specular, and the node's diffuse lobe is
Disney's, which is brighter than Lambert's at grazing angles: a purely diffuse Cornell box comes out 9 % too bright. Here
every surface that is neither metal nor light becomes a Diffuse node. Cycles does not count the first reflection as a
bounce: its --bounces N are our --bounces N + 1.
"""
import bpy


@bpy.app.handlers.persistent
def use_lambert(*_):
    for material in bpy.data.materials:
        tree = material.node_tree
        for principled in [node for node in tree.nodes if node.type == "BSDF_PRINCIPLED"] if tree else []:
            inputs = principled.inputs
            if inputs["Metallic"].default_value or max(inputs["Emission"].default_value[:3]):
                continue
            diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
            diffuse.inputs["Color"].default_value = inputs["Base Color"].default_value
            for link in list(principled.outputs["BSDF"].links):
                tree.links.new(diffuse.outputs["BSDF"], link.to_socket)


bpy.app.handlers.render_init.append(use_lambert)
