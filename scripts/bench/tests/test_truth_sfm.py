"""Checks of truth-sfm on captures made of numbers: python3 -m unittest discover -s scripts/bench/tests"""

import importlib.machinery
import importlib.util
import json
import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
BENCH = pathlib.Path(__file__).resolve().parents[1]
try:
    import numpy as np
except ImportError:
    np = None


def script():
    loader = importlib.machinery.SourceFileLoader("truth_sfm", str(BENCH / "truth-sfm"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("truth_sfm", loader))
    loader.exec_module(module)
    return module


@unittest.skipUnless(np, "numpy is not installed")
class Alignment(unittest.TestCase):
    def setUp(self):
        self.tool = script()
        self.temporary = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.temporary.name)
        random = np.random.default_rng(5)
        self.rotations = [np.linalg.qr(random.normal(size=(3, 3)))[0] for _ in range(6)]
        self.rotations = [r * np.sign(np.linalg.det(r)) for r in self.rotations]
        self.centers = random.normal(size=(6, 3))
        self.points = random.normal(size=(7, 3)).astype(np.float32)

    def tearDown(self):
        self.temporary.cleanup()

    def view(self, number, similarity, split):
        """A camera of the truth as another world has it: x' = scale R x + shift."""
        scale, rotation, shift = similarity
        turned = rotation @ self.rotations[number]
        center = scale * rotation @ self.centers[number] + shift
        name = f"{split}_{number:03}.png"
        return {"name": name, "camera": 0, "image": f"images/{name}", "split": split,
                "camera_from_world": {"rotation_wxyz": self.tool.quaternion(turned.T).tolist(),
                                      "translation": (-turned.T @ center).tolist()}}

    def capture(self, name, views, camera, points=None):
        folder = self.root / name
        (folder / "images").mkdir(parents=True)
        for view in views:
            (folder / view["image"]).write_bytes(name.encode())
        document = {"views": views, "cameras": [camera], "points": points and "points.ply"}
        (folder / "capture.json").write_text(json.dumps(document))
        return folder

    def test_a_model_comes_back_into_the_world_of_the_truth_and_test_views_join_it(self):
        turn = self.tool.TOOL.quaternion_to_matrix(0.3, -0.5, 0.7, 0.2)
        other, same = (0.37, turn, np.array([4.0, -2.0, 9.0])), (1.0, np.eye(3), np.zeros(3))
        # One photo is lost.
        found = self.capture("found", [
            *(self.view(i, other, "train") for i in (0, 1, 3)), self.view(4, other, "test")], "f", True)
        rows = np.zeros(len(self.points), self.tool.POINT)
        rows["position"], rows["color"] = 0.37 * self.points @ turn.T + other[2], 7
        (found / "points.ply").write_bytes(b"ply\nend_header\n" + rows.tobytes())
        views = [self.view(i, same, "train") for i in range(4)]
        views += [self.view(i, same, "test") for i in (4, 5)]
        known = self.capture("known", views, "k")
        even = self.capture("even", json.loads((found / "capture.json").read_text())["views"], "f")

        printed = self.tool.join(found, even, known, self.root / "out")
        self.assertEqual((printed["photos"], printed["registered"]), (4, 3))
        self.assertEqual(printed["test_views_lost"], 1)
        self.assertLess(printed["center_error_percent"]["max"], 1e-6)
        joined = json.loads((self.root / "out/capture.json").read_text())
        self.assertEqual(joined["cameras"], ["f", "k"])
        self.assertEqual([v["split"] for v in joined["views"]], ["train"] * 3 + ["test"] * 2)
        self.assertEqual(joined["views"][4]["camera"], 1)
        for view in joined["views"]:
            number = int(view["name"][-7:-4])
            rotation, center = self.tool.rotation_and_center(view)
            np.testing.assert_allclose(center, self.centers[number], atol=1e-6)
            np.testing.assert_allclose(rotation, self.rotations[number], atol=1e-6)
            # Only photos have dark corners that were taken off.
            source = {5: "known", 4: "even"}.get(number, "found")
            self.assertEqual((self.root / "out" / view["image"]).read_text(), source)
        body = (self.root / "out/points.ply").read_bytes().split(b"end_header\n")[1]
        points = np.frombuffer(body, self.tool.POINT)
        np.testing.assert_allclose(points["position"], self.points, atol=1e-5)
        self.assertTrue((points["color"] == 7).all())

    def test_two_photos_are_too_few(self):
        same = (1.0, np.eye(3), np.zeros(3))
        views = [self.view(i, same, "train") for i in range(2)]
        with self.assertRaisesRegex(SystemExit, "registers 2 photos"):
            self.tool.aligned({"views": views}, {"views": views})


if __name__ == "__main__":
    unittest.main()
