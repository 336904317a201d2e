"""OpenEXR files, read back and damaged. Standard library only."""

import array
import struct
import sys
import tempfile
import unittest
import zlib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from provider_kit import exr  # noqa: E402


def packed(data):
    """A zip block: halves apart, differences, deflate."""
    apart = data[0::2] + data[1::2]
    differences = bytes([apart[0]]) + bytes((b - a + 128) & 0xFF for a, b in zip(apart, apart[1:]))
    return zlib.compress(differences)


class OpenExr(unittest.TestCase):
    """A file of two channels."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.path = Path(temporary.name) / "a.exr"
        self.planes = {name: array.array("f", [0.25 * i + k for i in range(15)]).tobytes() for k, name in enumerate("YA")}

    def test_a_file_is_read_as_it_was_written(self):
        exr.write(self.path, 5, 3, self.planes)
        self.assertEqual(exr.read(self.path), (5, 3, self.planes))

    def test_blocks_of_zip_and_halves_are_read(self):
        for compression in (exr.ZIP, exr.ZIPS):
            self.path.write_bytes(self.compressed(compression))
            width, height, planes = exr.read(self.path)
            self.assertEqual((width, height), (5, 3))
            self.assertEqual(planes, {name: self.planes[name] for name in "AY"})

    def compressed(self, compression):
        """The file with channel A in 16 bits, compressed."""
        exr.write(self.path, 5, 3, self.planes)
        data = self.path.read_bytes()
        head, _ = exr.attributes(data)
        head["compression"] = bytes([compression])
        halves = b"".join(n + b"\0" + struct.pack("<iB3xii", kind, 0, 1, 1) for n, kind in ((b"A", exr.HALF), (b"Y", exr.FLOAT)))
        head["channels"] = halves + b"\0"
        out = data[:8] + b"".join(exr.attribute(name, "x", value) for name, value in head.items()) + b"\0"
        rows = 16 if compression == exr.ZIP else 1
        lines = []
        for y in range(3):
            values = struct.unpack("<5f", self.planes["A"][20 * y:20 * y + 20])
            lines.append(struct.pack("<5e", *values) + self.planes["Y"][20 * y:20 * y + 20])
        blocks = [(y, packed(b"".join(lines[y:y + rows]))) for y in range(0, 3, rows)]
        at = len(out) + 8 * len(blocks)
        for _, block in blocks:
            out += struct.pack("<Q", at)
            at += 8 + len(block)
        return out + b"".join(struct.pack("<ii", y, len(block)) + block for y, block in blocks)

    def test_damage_is_an_error_and_not_a_crash(self):
        whole = self.compressed(exr.ZIP)
        for cut in range(0, len(whole) - 1, 7):
            self.path.write_bytes(whole[:cut])
            with self.assertRaises(ValueError):
                exr.read(self.path)
        for at in range(0, len(whole), 3):
            self.path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x55]) + whole[at + 1:])
            try:
                exr.read(self.path)
            except ValueError:
                pass

    def test_planes_of_another_size_are_refused(self):
        with self.assertRaises(ValueError):
            exr.write(self.path, 4, 3, self.planes)


if __name__ == "__main__":
    unittest.main()
