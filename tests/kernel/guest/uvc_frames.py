"""Reads frames of the simulated USB video camera as the kernel wrote them into a file: prints what each was taken with,
and fails if a single sample is not what those settings make of the light (sim/wire/uvc_picture.h).
Usage: uvc_frames.py FILE WIDTH HEIGHT GREY|Y12|Y16|RGGB"""
import sys

FORMATS = {"GREY": (8, 1), "Y12": (12, 2), "Y16": (16, 2), "RGGB": (8, 1)}
FIELDS = (32, 32, 16, 16, 16)


def main():
    name, width, height, pixels = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
    bits, step = FORMATS[pixels]
    with open(name, "rb") as file:
        data = file.read()
    size = width * height * step
    if not data or len(data) % size:
        sys.exit(f"{len(data)} bytes are no frames of {size}")
    for start in range(0, len(data), size):
        frame = data[start:start + size]
        print(*read(frame, width, height, bits, step, pixels == "RGGB"))


def read(frame, width, height, bits, step, bayer):
    values = []
    place = 0
    for field in FIELDS:
        value = 0
        for bit in range(field):
            sample = int.from_bytes(frame[place * step:(place + 1) * step], "little")
            if sample not in (1 << bits - 2, 3 << bits - 2):
                sys.exit(f"sample {place} of row 0 is {sample}, which is no bit")
            value |= (sample == 3 << bits - 2) << bit
            place += 1
        values.append(value)
    _, exposure, gain, brightness, light = values

    def level(x, y):
        gathered = exposure * gain * (1 + 8 * x // width) * light // 256
        if bayer and x % 2 == y % 2:
            gathered //= 4 if y % 2 else 2
        return min(65535, 16 * brightness + gathered) >> (16 - bits)

    rows = [b"".join(level(x, y).to_bytes(step, "little") for x in range(width)) for y in (0, 1)]
    for y in range(height):
        begin = place * step if y == 0 else 0
        found = frame[y * width * step + begin:(y + 1) * width * step]
        if found != rows[y % 2][begin:]:
            sys.exit(f"row {y} is not what exposure {exposure} and gain {gain} make")
    return values


main()
