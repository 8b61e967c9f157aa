"""turntable.py SCENE.glb FILE.npy [SIZE [SAMPLES]]: 24 views around a scene as one numpy array, (24, SIZE, SIZE, 3)."""
import math
import sys

import halflight as hl
import numpy as np

FRAMES = 24


def main(path, output, size=128, samples=16):
    scene = hl.load(path)
    lower, upper = map(np.array, scene.bounds)
    centre, radius = (lower + upper) / 2, np.linalg.norm(upper - lower)
    renderer = hl.Renderer(scene, layers=[], width=size, height=size, samples=samples)
    pictures = np.empty((FRAMES, size, size, 3), np.float32)
    for frame in range(FRAMES):
        angle = 2 * math.pi * frame / FRAMES
        scene.look(centre + radius * np.array([math.sin(angle), 0.4, math.cos(angle)]), centre)
        pictures[frame] = renderer.render(frame)["view"][..., :3]
    np.save(output, pictures)
    print(f"{output}: {pictures.shape}, mean {pictures.mean():.3f}, on {renderer.device}")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], *map(int, sys.argv[3:]))
