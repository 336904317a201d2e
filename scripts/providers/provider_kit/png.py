"""Sizes of PNG files, for providers that hand files on. Standard library only."""

import struct

from .protocol import BadInput


def size(path):
    """Width and height of a PNG file."""
    with open(path, "rb") as file:
        head = file.read(24)
    if head[:8] != b"\x89PNG\r\n\x1a\n" or len(head) < 24:
        raise BadInput(f"{path.name} is no PNG", "send PNG")
    width, height = struct.unpack(">II", head[16:24])
    if not (width and height):
        raise BadInput(f"{path.name} has {width}x{height} pixels", "send PNG")
    return width, height
