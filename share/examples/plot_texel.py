#!/usr/bin/env python3
"""Plots what one texel of an observation map looked like in every pose.

Usage: plot_texel.py MAP.h5 OUT.png [COLUMN ROW]

Needs h5py, numpy and matplotlib (Debian: python3-h5py, python3-matplotlib). The format: docs/file-formats.md.
"""

import sys

import h5py
import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

GOOD, SATURATED, DARK = 1, 2, 3
NEWEST_FORMAT = 1


def directions(points_m, texel_m):
    """Unit vectors from a texel to homogeneous points: w = 1 is a place, w = 0 a direction."""
    d = points_m[:, :3] - points_m[:, 3:] * texel_m
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def main(path, out, column=None, row=None):
    with h5py.File(path, "r") as f:
        if f.attrs.get("kind") != "rigd observation map":
            sys.exit(f"{path}: is no observation map")
        if f.attrs["format"] > NEWEST_FORMAT:
            sys.exit(f"{path}: format {f.attrs['format']} is newer than this script reads ({NEWEST_FORMAT})")
        rows, columns, poses, _ = f["value"].shape
        column = columns // 2 if column is None else int(column)
        row = rows // 2 if row is None else int(row)
        # One texel with all its poses is contiguous in a chunk: this reads a tile, not the file.
        value = f["value"][row, column]
        sigma = np.sqrt(f["variance"][row, column])
        validity = f["validity"][row, column]
        camera = np.hstack([f["pose/camera_m"][:], np.ones((poses, 1))])
        light = f["pose/light_m"][:]
        x = ((column + 0.5) / columns - 0.5) * f.attrs["width_m"]
        y = ((row + 0.5) / rows - 0.5) * f.attrs["height_m"]
        name, quantity, units = f.attrs["name"], f.attrs["quantity"], f.attrs["units"]

    texel = np.array([x, y, 0.0])
    to_light, to_camera = directions(light, texel), directions(camera, texel)
    half = to_light + to_camera
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    from_normal_deg = np.degrees(np.arccos(np.clip(half[:, 2], -1, 1)))

    figure, axes = plt.subplots(figsize=(8, 5))
    for channel, colour in enumerate(("tab:red", "tab:green", "tab:blue")):
        for state, marker, label in ((GOOD, "o", "RGB"[channel]), (DARK, "x", None), (SATURATED, "^", None)):
            use = validity == state
            axes.errorbar(from_normal_deg[use], value[use, channel], sigma[use, channel], fmt=marker,
                          color=colour, markersize=3, linewidth=1, label=label)
    axes.set_xlabel("half vector to normal, degrees")
    axes.set_ylabel(f"{quantity}, {units}")
    axes.set_title(f"{name}: texel ({column}, {row}) at ({1e3 * x:.1f}, {1e3 * y:.1f}) mm, "
                   f"{np.count_nonzero(validity)} of {poses} poses")
    axes.set_ylim(bottom=0)
    axes.legend()
    figure.savefig(out, dpi=120)


if __name__ == "__main__":
    if len(sys.argv) not in (3, 5):
        sys.exit(__doc__)
    main(*sys.argv[1:])
