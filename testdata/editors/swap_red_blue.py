"""An editor that does the same to every picture: red and blue change places."""

import sys

import png

width, height, rows = png.read(sys.argv[1])
for row in rows:
    row[0::3], row[2::3] = row[2::3], row[0::3]
png.write(sys.argv[2], width, height, rows)
