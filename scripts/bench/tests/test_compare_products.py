"""Checks of scripts/compare-products without any program of ours."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "compare-products"
PAGE = """<table>
<thead><tr><th scope="col">program</th><th scope="col" class="number">CPU s</th>
<th scope="col">PSNR</th></tr></thead>
<tbody><tr><th scope="row">fit</th><td class="number">{cpu}</td><td>{psnr}</td></tr></tbody>
</table>"""


def folder(root, name, seconds=1.0, psnr=20.0, cpu="1.0", version="1.1"):
    """A folder of products."""
    made = pathlib.Path(root, name)
    (made / "scene").mkdir(parents=True)
    document = {"format": "motes/x", "version": version, "psnr_db": psnr, "seconds": seconds}
    document["step_times"] = [{"step": "light", "seconds": seconds}]
    (made / "scene/x.json").write_text(json.dumps(document))
    (made / "scene.run.json").write_text(str(seconds))
    (made / "report.html").write_text(PAGE.format(cpu=cpu, psnr=psnr))
    (made / "a.ply").write_bytes(bytes([1, 2, 3]))
    return made


def compared(*arguments):
    done = subprocess.run(
        [sys.executable, "-B", SCRIPT, *map(str, arguments)], capture_output=True, text=True
    )
    return done.returncode, done.stdout


class CompareProducts(unittest.TestCase):
    def test_times_and_minor_versions_are_no_difference(self):
        with tempfile.TemporaryDirectory() as root:
            a = folder(root, "a")
            b = folder(root, "b", seconds=2.5, cpu="7.5", version="1.2")
            code, text = compared(a, b)
            self.assertEqual(code, 0, text)
            self.assertIn("3 products on both sides: the same", text)
            code, text = compared("--exact", a, b)
            self.assertEqual(code, 1)
            self.assertIn("differs: scene.run.json", text)

    def test_values_files_and_bytes_are(self):
        with tempfile.TemporaryDirectory() as root:
            a, b = folder(root, "a"), folder(root, "b", psnr=20.5)
            (b / "a.ply").write_bytes(bytes([1, 2, 4]))
            (b / "more.png").write_bytes(b"x")
            code, text = compared(a, b)
            self.assertEqual(code, 1)
            self.assertIn("differs: a.ply (byte 2 of 3 and 3)", text)
            self.assertIn("differs: scene/x.json (/psnr_db: 20.0 and 20.5)", text)
            self.assertIn("differs: report.html", text)
            self.assertIn("only after: more.png", text)

    def test_wrong_folders_are_refused(self):
        with tempfile.TemporaryDirectory() as root:
            a = folder(root, "a")
            self.assertEqual(compared(a, a / "nothing")[0], 2)
            empty = pathlib.Path(root, "empty")
            empty.mkdir()
            self.assertNotEqual(compared(empty, empty)[0], 0)


if __name__ == "__main__":
    unittest.main()
