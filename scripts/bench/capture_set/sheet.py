"""Contact sheets in PNG, with the standard library alone: held-out photos beside their renders."""

import json
import struct
import zlib
from pathlib import Path

SIGNATURE = b"\x89PNG\r\n\x1a\n"
CHANNELS = {0: 1, 2: 3, 4: 2, 6: 4}
TILE, GAP, PAPER, MOST_VIEWS = 256, 4, 24, 4


class Unreadable(Exception):
    """A picture that this reader does not know."""


def chunks(data):
    at = len(SIGNATURE)
    while at + 8 <= len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        yield kind, data[at + 8:at + 8 + length]
        at += length + 12


def paeth(a, b, c):
    pa, pb, pc = abs(b - c), abs(a - c), abs(a + b - 2 * c)
    return a if pa <= pb and pa <= pc else b if pb <= pc else c


def unfilter(kind, row, above, step):
    """Undoes the filter of one row in place."""
    if kind == 2:
        row[:] = bytes((x + b) & 255 for x, b in zip(row, above))
    elif kind:
        for i in range(len(row)):
            a = row[i - step] if i >= step else 0
            c = above[i - step] if i >= step else 0
            guess = (a, (a + above[i]) >> 1, paeth(a, above[i], c))[(1, 3, 4).index(kind)]
            row[i] = (row[i] + guess) & 255


def read(path):
    """(width, height, rows of RGB bytes); 8 bits a channel, alpha over black."""
    data = Path(path).read_bytes()
    parts = list(chunks(data))
    if not data.startswith(SIGNATURE) or not parts or parts[0][0] != b"IHDR":
        raise Unreadable(f"no PNG: {path}")
    width, height, bits, color, _, _, interlaced = struct.unpack(">IIBBBBB", parts[0][1])
    if bits != 8 or color not in CHANNELS or interlaced:
        raise Unreadable(f"not 8 bits a channel in plain rows: {path}")
    pixels = zlib.decompress(b"".join(body for kind, body in parts if kind == b"IDAT"))
    step, rows, above = CHANNELS[color], [], None
    for y in range(height):
        start = y * (width * step + 1)
        row = bytearray(pixels[start + 1:start + 1 + width * step])
        unfilter(pixels[start], row, above or bytes(len(row)), step)
        above = row
        rows.append(rgb(row, step))
    return width, height, rows


def rgb(row, step):
    if step == 3:
        return bytes(row)
    gray = [row[c::step] for c in ((0, 1, 2) if step == 4 else (0, 0, 0))]
    if step in (2, 4):
        alpha = row[step - 1::step]
        gray = [bytes(v * a // 255 for v, a in zip(plane, alpha)) for plane in gray]
    out = bytearray(3 * len(gray[0]))
    for c, plane in enumerate(gray):
        out[c::3] = plane
    return bytes(out)


def shrunk(picture):
    """The mean of k × k pixels, k such that no side exceeds TILE."""
    width, height, rows = picture
    k = max(1, -(-max(width, height) // TILE))
    columns, lines = width // k, height // k
    if k == 1 or not columns or not lines:
        return picture
    found = []
    for y in range(lines):
        line = bytearray(3 * columns)
        for c in range(3):
            sums = [0] * columns
            for row in rows[y * k:(y + 1) * k]:
                for dx in range(k):
                    plane = row[3 * dx + c:3 * columns * k:3 * k]
                    sums = [s + v for s, v in zip(sums, plane)]
            line[c::3] = bytes(s // (k * k) for s in sums)
        found.append(bytes(line))
    return columns, lines, found


def write(path, width, height, rows):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows), 9)
    Path(path).write_bytes(SIGNATURE + chunk(b"IHDR", header) + chunk(b"IDAT", body) + chunk(b"IEND", b""))


def grid(lines):
    """(width, height, rows) of pictures in rows and columns; None leaves a place empty."""
    widths = [max((p[0] for p in column if p), default=0) for column in zip(*lines)]
    width = sum(widths) + GAP * (len(widths) + 1)
    blank = bytes([PAPER]) * (3 * width)
    rows = [blank] * GAP
    for line in lines:
        height = max((p[1] for p in line if p), default=0)
        for y in range(height):
            row, at = bytearray(blank), GAP
            for picture, wide in zip(line, widths):
                if picture and y < picture[1]:
                    row[3 * at:3 * (at + picture[0])] = picture[2][y]
                at += wide + GAP
            rows.append(bytes(row))
        rows += [blank] * GAP
    return width, len(rows), rows


def render_of(folder, name):
    """The picture of a view, whatever suffix its photo had."""
    stem = name.rsplit(".", 1)[0].replace("/", "__")
    found = [Path(folder) / f"{stem}.png", Path(folder) / f"{name.replace('/', '__')}.png"]
    return next((p for p in found if p.exists()), None)


def make(path, capture, folders):
    """Writes the sheet of a capture: a row per held-out view, columns photo, then `folders`."""
    document = json.loads(Path(capture).read_text())
    held = [v for v in document["views"] if v["split"] == "test"]
    take = min(len(held), MOST_VIEWS)
    lines = []
    for view in (held[i * len(held) // take] for i in range(take)):
        sources = [Path(capture).parent / view["image"]] + [render_of(f, view["name"]) for f in folders]
        lines.append([shrunk(read(s)) if s else None for s in sources])
    if lines:
        write(path, *grid(lines))
    return bool(lines)
