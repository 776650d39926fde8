"""Draws the pictures of the page, in small files."""

import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

LARGEST_PICTURE = 150_000  # bytes


def save(figure, path):
    """Saves a PNG with few colours, because speckle compresses badly otherwise."""
    from PIL import Image

    figure.savefig(path, dpi=100, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)
    picture = Image.open(path).convert("RGB")
    for colours in (128, 64, 32, 16):
        picture.quantize(colours, dither=Image.Dither.NONE).save(path, optimize=True)
        if pathlib.Path(path).stat().st_size <= LARGEST_PICTURE:
            return
    raise RuntimeError(f"{path} stays larger than {LARGEST_PICTURE} bytes; draw it smaller")


def draw_fan(axes, ping, level_db, low_db, high_db, title):
    """Draws a ping as a fan: x to starboard, y ahead."""
    import numpy as np

    edges_r = np.concatenate([[ping.range[0]], (ping.range[1:] + ping.range[:-1]) / 2, [ping.range[-1]]])
    a = ping.azimuth
    edges_a = np.concatenate([[a[0]], (a[1:] + a[:-1]) / 2, [a[-1]]])
    r, az = np.meshgrid(edges_r, edges_a, indexing="ij")
    axes.pcolormesh(-r * np.sin(az), r * np.cos(az), level_db, cmap="inferno", vmin=low_db, vmax=high_db, shading="flat",
                    rasterized=True)
    axes.set_aspect("equal")
    axes.set_title(title, fontsize=9)
    axes.tick_params(labelsize=7)
