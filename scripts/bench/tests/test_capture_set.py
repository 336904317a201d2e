"""Checks of the list of captures with stand-ins for programs: python3 -m unittest discover -s scripts/bench/tests"""

import json
import pathlib
import random
import stat
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

sys.dont_write_bytecode = True
BENCH = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(BENCH))
from capture_set import page, sheet  # noqa: E402

# A program that notes that it ran and writes what the script reads.
PROGRAM = """#!{python}
import json, pathlib, sys
name, words = pathlib.Path(sys.argv[0]).name, sys.argv[1:]
with open({log!r}, "a") as log:
    log.write(name + "\\n")
value = lambda flag: words[words.index(flag) + 1]
if name == "import-colmap":
    names = [f"p{{i}}.png" for i in range(6)]
    if "--train-list" in words:
        names = [n for s in ("train", "test") for n in open(value(f"--{{s}}-list")).read().split()]
    views = [dict(name=n, image=n, split="test" if n in ("p0.png", "p4.png") else "train") for n in names]
    out = pathlib.Path(value("-o"))
    out.mkdir(parents=True)
    (out / "capture.json").write_text(json.dumps(dict(cameras=[dict(width=8, height=6)], views=views)))
elif name == "train-splat":
    verdict = dict(start="photos", failure="flat-alpha" if value("--preset") == "draft" else None)
    pathlib.Path(value("-o")).write_text("ply")
    pathlib.Path(value("--metrics")).write_text(json.dumps(
        dict(iterations=5, gaussians=9, psnr_train=30.0, verdict=verdict)))
    sys.exit(4 if verdict["failure"] else 0)
elif name == "evaluate":
    protocol = dict(split_rule="by name", background=[0, 0, 0], ssim=dict(border="same"))
    pathlib.Path(value("--metrics")).write_text(json.dumps(
        dict(psnr=25.5, psnr_color_corrected=26.0, ssim=0.9, protocol=protocol)))
"""


def png(path, width, height, pixel, channels, filters):
    """A PNG with the given filter of each row, encoded as the standard says."""
    step, above, raw = channels, bytes(width * channels), b""
    for y in range(height):
        row = bytes(v for x in range(width) for v in pixel(x, y))
        kind = filters[y % len(filters)]
        at = lambda r, i: r[i] if i >= 0 else 0
        guess = [lambda i: 0, lambda i: at(row, i - step), lambda i: above[i],
                 lambda i: (at(row, i - step) + above[i]) // 2,
                 lambda i: sheet.paeth(at(row, i - step), above[i], at(above, i - step))][kind]
        raw += bytes([kind]) + bytes((row[i] - guess(i)) % 256 for i in range(len(row)))
        above = row
    color = {1: 0, 2: 4, 3: 2, 4: 6}[channels]
    chunk = lambda kind, body: struct.pack(">I", len(body)) + kind + body + b"\0\0\0\0"
    header = struct.pack(">IIBBBBB", width, height, 8, color, 0, 0, 0)
    path.write_bytes(sheet.SIGNATURE + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(raw)))


class Pictures(unittest.TestCase):
    def test_every_filter_and_kind_of_pixel_is_read(self):
        draw = random.Random(3)
        with tempfile.TemporaryDirectory() as root:
            path = pathlib.Path(root, "a.png")
            for channels in (1, 2, 3, 4):
                values = [[[draw.randrange(256) for _ in range(channels)] for _ in range(7)] for _ in range(10)]
                png(path, 7, 10, lambda x, y: values[y][x], channels, [0, 1, 2, 3, 4])
                width, height, rows = sheet.read(path)
                self.assertEqual((width, height), (7, 10))
                for y, row in enumerate(rows):
                    for x in range(7):
                        v = values[y][x]
                        alpha = v[-1] if channels in (2, 4) else 255
                        want = [c * alpha // 255 for c in (v[:3] if channels > 2 else v[:1] * 3)]
                        self.assertEqual(list(row[3 * x:3 * x + 3]), want)

    def test_a_sheet_is_a_grid_of_means(self):
        big = (600, 300, [bytes([10, 20, 30] * 300 + [40, 50, 60] * 300)] * 300)
        small = sheet.shrunk(big)
        self.assertEqual(small[:2], (200, 100))
        self.assertEqual((small[2][0][:3], small[2][99][-3:]), (bytes([10, 20, 30]), bytes([40, 50, 60])))
        width, height, rows = sheet.grid([[small, None], [small, small]])
        self.assertEqual((width, height), (2 * 200 + 3 * sheet.GAP, 2 * 100 + 3 * sheet.GAP))
        with tempfile.TemporaryDirectory() as root:
            path = pathlib.Path(root, "s.png")
            sheet.write(path, width, height, rows)
            self.assertEqual(sheet.read(path), (width, height, [bytes(r) for r in rows]))

    def test_what_is_no_png_says_so(self):
        with tempfile.TemporaryDirectory() as root:
            path = pathlib.Path(root, "a.png")
            path.write_bytes(b"JFIF")
            with self.assertRaises(sheet.Unreadable):
                sheet.read(path)


class Captures(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.temporary.name)
        self.log, self.bin, self.out = self.root / "log", self.root / "bin", self.root / "out"
        self.bin.mkdir()
        for name in ("import-colmap", "train-splat", "evaluate"):
            program = self.bin / name
            program.write_text(PROGRAM.format(python=sys.executable, log=str(self.log)))
            program.chmod(program.stat().st_mode | stat.S_IXUSR)
        (self.root / "scene/images").mkdir(parents=True)
        (self.root / "scene/transforms.json").write_text("{}")

    def tearDown(self):
        self.temporary.cleanup()

    def run_script(self, *words):
        self.log.unlink(missing_ok=True)
        done = subprocess.run(
            [sys.executable, "-B", BENCH / "captures", "--data", self.root / "scene", "-o", self.out,
             "--bin", self.bin, *map(str, words)], capture_output=True, text=True)
        ran = self.log.read_text().split() if self.log.exists() else []
        return done.returncode, ran, done.stderr

    def test_finished_cells_are_not_run_again_and_a_failed_fit_is_a_result(self):
        code, ran, text = self.run_script("--preset", "draft", "--preset", "balanced")
        self.assertEqual(code, 0, text)
        self.assertEqual(ran, ["import-colmap", "train-splat", "evaluate", "train-splat", "evaluate"])
        record = json.loads((self.out / "captures.json").read_text())
        self.assertEqual([r["preset"] for r in record["rows"]], ["draft", "balanced"])
        self.assertEqual([page.verdict(r) for r in record["rows"]], ["failed: flat-alpha", "fine"])
        said = (self.out / "captures.md").read_text()
        self.assertIn("4 training photos, 2 held out (by name)", said)
        self.assertNotIn(str(self.root), said + (self.out / "captures.json").read_text())
        code, ran, text = self.run_script("--preset", "draft", "--preset", "balanced", "--photos", "2")
        self.assertEqual((code, ran), (0, ["import-colmap"] + ["train-splat", "evaluate"] * 2), text)
        rows = json.loads((self.out / "captures.json").read_text())["rows"]
        self.assertEqual([r["train_photos"] for r in rows], [4, 4, 2, 2])
        (self.root / "scene/transforms.json").write_text("{ }")
        code, ran, text = self.run_script("--preset", "balanced")
        self.assertEqual(ran, ["import-colmap", "train-splat", "evaluate"], text)

    def test_a_program_that_fails_is_named_and_run_again_the_next_time(self):
        evaluate = self.bin / "evaluate"
        good = evaluate.read_text()
        evaluate.write_text("#!/bin/sh\necho no room >&2\nexit 1\n")
        code, _, text = self.run_script("--preset", "balanced")
        self.assertEqual(code, 1)
        self.assertIn("no room", text)
        self.assertIn("## Failed", (self.out / "captures.md").read_text())
        evaluate.write_text(good)
        code, ran, text = self.run_script("--preset", "balanced")
        self.assertEqual((code, ran), (0, ["evaluate"]), text)

    def test_bad_words_are_usage(self):
        for words in (["--photos", "0"], ["--relight", "high", "--preset", "draft"],
                      ["--environment", "none.exr"], ["--data", "nowhere"], ["--data", self.root / "scene"]):
            code, ran, text = self.run_script(*words)
            self.assertEqual((code, ran), (2, []), text)


if __name__ == "__main__":
    unittest.main()
