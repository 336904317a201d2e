"""An editor that cannot make up its mind: every view gets a tint of its own, from its name."""

import sys
import zlib

import png

width, height, rows = png.read(sys.argv[1])
number = zlib.crc32(sys.argv[3].encode())
gains = [0.6 + 0.8 * ((number >> shift) & 255) / 255 for shift in (0, 8, 16)]
for row in rows:
    for channel, gain in enumerate(gains):
        row[channel::3] = bytes(min(255, round(value * gain)) for value in row[channel::3])
png.write(sys.argv[2], width, height, rows)
