#!/usr/bin/env python3
"""Shows the channels of a parameter map as one picture, and prints its header.

Usage: show_parameters.py MAP.exr OUT.png

Needs OpenImageIO, numpy and matplotlib (Debian: python3-openimageio, python3-matplotlib). The format:
docs/file-formats.md.
"""

import sys

import matplotlib
import numpy as np
import OpenImageIO as oiio

matplotlib.use("Agg")
import matplotlib.pyplot as plt

NEWEST_FORMAT = 1


def main(path, out):
    image = oiio.ImageInput.open(path)
    if not image:
        sys.exit(f"{path}: {oiio.geterror()}")
    spec = image.spec()
    if spec.getattribute("rigd.kind") != "rigd parameter map":
        sys.exit(f"{path}: is no parameter map")
    if spec.getattribute("rigd.format") > NEWEST_FORMAT:
        sys.exit(f"{path}: format {spec.getattribute('rigd.format')} is newer than this script reads")
    pixels = image.read_image(oiio.FLOAT)
    image.close()
    # Found by name: a reader may order them as it likes. Scan line 0 is the top of the sample.
    channels = {name: pixels[:, :, i] for i, name in enumerate(spec.channelnames)}

    print(f"{path}: model {spec.getattribute('rigd.model')}, {spec.width} x {spec.height} texels, "
          f"{1e3 * spec.getattribute('rigd.width_m'):g} x {1e3 * spec.getattribute('rigd.height_m'):g} mm")
    for attribute in spec.extra_attribs:
        if attribute.name.startswith("rigd.attribute."):
            print(f"  {attribute.name[len('rigd.attribute.'):]}: {attribute.value}")

    shown = [n for n in channels if n[-2:] not in (".R", ".G", ".B")]
    colours = sorted({n[:-2] for n in channels if n.endswith(".R")})
    panels = len(shown) + len(colours)
    columns = min(4, panels)
    figure, axes = plt.subplots(-(-panels // columns), columns, figsize=(4 * columns, 4 * -(-panels // columns)),
                                squeeze=False)
    for axis in axes.flat:
        axis.axis("off")
    for axis, name in zip(axes.flat, colours + shown):
        if name in colours:
            rgb = np.dstack([channels[f"{name}.{c}"] for c in "RGB"])
            top = np.percentile(rgb, 99) or 1
            axis.imshow(np.clip(rgb / top, 0, 1) ** (1 / 2.2))
            axis.set_title(f"{name}, white = {top:.3g}")
        else:
            low, high = np.percentile(channels[name], (1, 99))
            drawn = axis.imshow(channels[name], vmin=low, vmax=high)
            figure.colorbar(drawn, ax=axis, shrink=0.7)
            axis.set_title(name)
    figure.tight_layout()
    figure.savefig(out, dpi=80)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
