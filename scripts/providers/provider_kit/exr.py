"""OpenEXR files of 32-bit floats in single scan lines: what maps and panoramas are handed over in. Standard library only."""

import struct
import zlib
from pathlib import Path

NONE, ZIPS, ZIP = 0, 2, 3
HALF, FLOAT = 1, 2


def attribute(name, kind, value):
    """An attribute of a header."""
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value


def write(path, width, height, planes):
    """Writes channels, each `width * height * 4` bytes of little-endian floats from the upper left, not compressed."""
    names = sorted(planes)
    for name in names:
        if len(planes[name]) != 4 * width * height:
            raise ValueError(f"channel {name} has {len(planes[name])} bytes for {width}x{height} pixels")
    channels = b"".join(n.encode() + b"\0" + struct.pack("<iB3xii", FLOAT, 0, 1, 1) for n in names) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    header = struct.pack("<ii", 20000630, 2)
    header += attribute("channels", "chlist", channels)
    header += attribute("compression", "compression", bytes([NONE]))
    header += attribute("dataWindow", "box2i", window) + attribute("displayWindow", "box2i", window)
    header += attribute("lineOrder", "lineOrder", b"\0")
    header += attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    header += attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
    header += attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0"
    row, size = 4 * width, 4 * width * len(names)
    first = len(header) + 8 * height
    with open(path, "wb") as file:
        file.write(header)
        file.write(b"".join(struct.pack("<Q", first + y * (size + 8)) for y in range(height)))
        for y in range(height):
            file.write(struct.pack("<ii", y, size))
            for name in names:
                file.write(planes[name][y * row:(y + 1) * row])


def text_at(data, start):
    """A text that ends with a zero byte, and where the next thing begins."""
    end = data.index(b"\0", start)
    return data[start:end].decode("latin-1"), end + 1


def attributes(data):
    """The header as a dictionary, and where the table of offsets begins."""
    magic, version = struct.unpack_from("<iI", data)
    if magic != 20000630:
        raise ValueError("it is no OpenEXR file")
    if version & ~0xFF & ~0x400:
        raise ValueError("it is tiled, deep or of several parts")
    found, at = {}, 8
    while data[at] != 0:
        name, at = text_at(data, at)
        _, at = text_at(data, at)
        (length,) = struct.unpack_from("<i", data, at)
        if length < 0 or at + 4 + length > len(data):
            raise ValueError("it is cut short")
        found[name] = data[at + 4:at + 4 + length]
        at += 4 + length
    return found, at + 1


def channel_list(value):
    """Names and kinds of channels, in file order."""
    found, at = [], 0
    while value[at] != 0:
        name, at = text_at(value, at)
        (kind,) = struct.unpack_from("<i", value, at)
        if kind not in (HALF, FLOAT) or struct.unpack_from("<ii", value, at + 8) != (1, 1):
            raise ValueError(f"channel {name} is not of 16 or 32 bit floats at every pixel")
        found.append((name, kind))
        at += 16
    return found


def unpacked(block, size):
    """A zip block as it was before the predictor and the split into halves."""
    if len(block) == size:
        return block
    data = bytearray(zlib.decompress(block))
    if len(data) != size:
        raise ValueError("a block has another size than its rows")
    for i in range(1, size):
        data[i] = (data[i - 1] + data[i] - 128) & 0xFF
    joined = bytearray(size)
    half = (size + 1) // 2
    joined[0::2], joined[1::2] = data[:half], data[half:]
    return bytes(joined)


def read(path):
    """Width, height, and channels as bytes of little-endian 32-bit floats. ValueError says what is wrong."""
    data = Path(path).read_bytes()
    try:
        return parsed(data)
    except (struct.error, IndexError, KeyError, zlib.error) as error:
        raise ValueError(f"it is cut short or damaged ({error})") from error


def parsed(data):
    """As `read`, of the bytes of a file."""
    header, table = attributes(data)
    left, top, right, bottom = struct.unpack("<4i", header["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    if not (0 < width <= 65536 and 0 < height <= 65536):
        raise ValueError(f"it has {width}x{height} pixels")
    compression = header["compression"][0]
    if compression not in (NONE, ZIPS, ZIP):
        raise ValueError("it is compressed in another way than zip")
    channels = channel_list(header["channels"])
    rows = 16 if compression == ZIP else 1
    line = width * sum(2 if kind == HALF else 4 for _, kind in channels)
    blocks = (height + rows - 1) // rows
    if 8 * blocks > len(data) - table:
        raise ValueError("it is cut short")
    lines = {name: [b""] * height for name, _ in channels}
    for offset in struct.unpack_from(f"<{blocks}Q", data, table):
        first, size = struct.unpack_from("<ii", data, offset)
        count = min(rows, bottom + 1 - first)
        if size < 0 or offset + 8 + size > len(data) or not top <= first <= bottom:
            raise ValueError("it is cut short")
        block = unpacked(data[offset + 8:offset + 8 + size], line * count)
        at = 0
        for y in range(first - top, first - top + count):
            for name, kind in channels:
                length = width * (2 if kind == HALF else 4)
                values = block[at:at + length]
                if kind == HALF:
                    values = struct.pack(f"<{width}f", *struct.unpack(f"<{width}e", values))
                lines[name][y] = values
                at += length
    return width, height, {name: b"".join(found) for name, found in lines.items()}
