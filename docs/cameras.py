"""Makes docs/src/pictures/cameras.png: what an ideal camera and a D435i see of the same moment of a recording.

    tandem replay RECORDING --render DIR/ideal --rate 10 --cameras A --camera-model ideal
    tandem replay RECORDING --render DIR/d435i --rate 10 --cameras A --camera-model d435i
    python docs/cameras.py DIR STEP

Colours are above, depth below: white is near, black far, blue without depth. It needs Pillow and NumPy.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

NEAR_M, FAR_M = 0.3, 3.0


def grey(path: Path) -> Image.Image:
    """Returns an image of depth, linear in 1 / depth."""
    depth_m = np.asarray(Image.open(path)).astype(float) / 1000.0
    share = (1.0 / np.maximum(depth_m, 1e-3) - 1.0 / FAR_M) / (1.0 / NEAR_M - 1.0 / FAR_M)
    value = (255.0 * np.clip(share, 0.0, 1.0)).astype(np.uint8)
    image = np.stack([value] * 3, axis=-1)
    image[depth_m == 0.0] = (40, 60, 160)
    return Image.fromarray(image)


def main() -> None:
    folder, step = Path(sys.argv[1]), int(sys.argv[2])
    page = Image.new("RGB", (2 * 320, 2 * 240))
    for column, model in enumerate(("ideal", "d435i")):
        camera = folder / model / "A"
        page.paste(Image.open(camera / "rgb" / f"{step:06}.png"), (320 * column, 0))
        page.paste(grey(camera / "depth" / f"{step:06}.png"), (320 * column, 240))
    page.quantize(128, dither=Image.Dither.NONE).save(Path(__file__).parent / "src/pictures/cameras.png", optimize=True)


if __name__ == "__main__":
    main()
