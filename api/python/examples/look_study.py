"""look_study.py SCENE.glb FOLDER [SAMPLES]: pictures of a scene under edited light and materials, as .png files."""
import pathlib
import sys

import halflight as hl


def main(path, folder, samples=16):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    scene = hl.load(path)
    renderer = hl.Renderer(scene, layers=[], width=160, samples=samples)
    reference = renderer.render()["beauty"][..., :3].mean()

    def save(name):
        picture = renderer.render()
        picture.save(folder / f"{name}.png")
        mean = picture["beauty"][..., :3].mean()
        print(f"{name}: {mean / reference:.2f} times as bright, {picture.stats['seconds']['total']:.2f} s")

    save("original")
    for roughness in (0.1, 0.4):
        for material in range(len(scene.materials)):
            scene.edit_material(material, roughness=roughness)
        save(f"roughness-{roughness}")
    scene.reset_edits()
    for light in range(len(scene.lights)):
        scene.edit_light(light, color=(1, 0.6, 0.3))
    scene.edit_emission(0.5)
    scene.edit_environment(intensity=0.5)
    save("evening")
    scene.reset_edits()
    scene.set_clay()
    save("clay")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], *map(int, sys.argv[3:]))
