"""Checks of the relighting benchmark with stand-ins for programs: python3 -m unittest discover -s scripts/bench/tests"""

import json
import pathlib
import stat
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
BENCH = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(BENCH))
from truth import chain, made, page  # noqa: E402

# A program that notes that it ran and writes whatever its -o names.
PROGRAM = """#!/bin/sh
echo "$0" >> "{log}"
while [ $# -gt 0 ]; do [ "$1" = -o ] && out="$2"; [ "$1" = --page ] && page="$2"; shift; done
case "$0" in
*score-relight) echo '{{"relit_mean": {{"none": {{"psnr_db": 20.5}}}}}}' > "$out"; echo page > "$page";;
*decompose) mkdir -p "$out"; echo '{{"terms": [{{"name": "specular", "kept": false}}]}}' > "$out/decomposition.json";;
*) mkdir -p "$(dirname "$out")"; echo made > "$out";;
esac
"""
# Lists its scenes as clap does in a narrow terminal, and makes an empty one.
SCENES = """#!/bin/sh
echo "$0" >> "{log}"
if [ "$1" = -h ]; then
    echo "  <SCENE>  Which scene [possible values: matte, hall,"
    echo "           figure]"
    exit
fi
while [ $# -gt 0 ]; do [ "$1" = -o ] && out="$2"; shift; done
mkdir -p "$out"; echo '{{}}' > "$out/scene.json"
"""
STEPS = ["import-colmap", "train-splat", "render", "decompose", "relight", "score-relight"]


class Benchmark(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        root = pathlib.Path(self.temporary.name)
        self.log, self.bin, self.work = root / "log", root / "bin", root / "work"
        self.bin.mkdir()
        for name in STEPS:
            program = self.bin / name
            program.write_text(PROGRAM.format(log=self.log))
            program.chmod(program.stat().st_mode | stat.S_IXUSR)
        truth = root / "truth"
        (truth / "images").mkdir(parents=True)
        (truth / "images/train_000.png").write_bytes(b"photo")
        (truth / "transforms_test.json").write_text('{"frames": [1, 2]}')
        (truth / "scene.json").write_text(json.dumps(
            {"exposure": 0.5, "relight_lights": ["dusk"], "capture_light": "noon",
             "lights": {"noon": {"file": "env/noon.exr"}}}))
        self.truth = chain.Truth("t", truth)
        self.chain = chain.Chain(self.bin, self.work, 1, 0, "standard", lambda text: None)

    def tearDown(self):
        self.temporary.cleanup()

    def ran(self):
        lines = self.log.read_text().split() if self.log.exists() else []
        self.log.unlink(missing_ok=True)
        return [pathlib.Path(line).name for line in lines]

    def test_steps_are_kept_and_settings_share_what_they_have_in_common(self):
        result = self.chain.run(self.truth, {"name": "default"})
        self.assertEqual(self.ran(), ["import-colmap", "train-splat", "render", "decompose",
                                      "relight", "relight", "score-relight"])
        self.assertEqual(result["terms"], {"specular": False})
        self.chain.run(self.truth, {"name": "again"})
        self.assertEqual(self.ran(), [])
        self.chain.run(self.truth, {"name": "other", "decompose": ["--indirect", "off"]})
        self.assertEqual(self.ran(), ["decompose", "relight", "relight", "score-relight"])

    def test_given_products_are_taken_and_their_content_counts(self):
        scene = pathlib.Path(self.temporary.name) / "scene"
        scene.mkdir()
        (scene / "surface.ply").write_text("one")
        self.truth.given["scene"] = scene
        self.chain.run(self.truth, {})
        self.assertNotIn("decompose", self.ran())
        (scene / "surface.ply").write_text("two")
        self.chain.run(self.truth, {})
        self.assertEqual(self.ran(), ["relight", "relight", "score-relight"])

    def test_poses_by_colmap_take_the_place_of_the_import(self):
        script = self.bin / "truth-sfm"
        script.write_text(PROGRAM.format(log=self.log))
        self.chain.sfm = ["/bin/sh", script]
        self.chain.run(self.truth, {})
        self.assertEqual(self.ran()[:2], ["truth-sfm", "train-splat"])
        self.chain.run(self.truth, {"name": "again"})
        self.assertEqual(self.ran(), [])

    def test_scenes_are_made_once(self):
        program = self.bin / "truth-scene"
        program.write_text(SCENES.format(log=self.log))
        program.chmod(0o755)
        self.assertEqual(made.names(program), ["matte", "hall", "figure"])
        self.ran()
        for runs in (["truth-scene"] * 4, ["truth-scene"]):
            pairs = [*made.scenes(["all"], self.bin, self.work, 1, lambda text: None)]
            self.assertEqual([name for name, _ in pairs], ["matte", "hall", "figure"])
            self.assertTrue(all((folder / "scene.json").exists() for _, folder in pairs))
            self.assertEqual(self.ran(), runs)
        self.assertEqual([*made.scenes([], self.bin / "none", self.work, 1, print)], [])

    def test_a_step_that_fails_leaves_no_product(self):
        (self.bin / "decompose").write_text("#!/bin/sh\necho no light >&2\nexit 3\n")
        with self.assertRaisesRegex(chain.runner.Failed, "no light"):
            self.chain.run(self.truth, {})
        self.assertEqual([p for p in (self.work / "t").glob("decompose-*")
                          if not p.name.endswith(".partial")], [])

    def test_flags_know_the_truth(self):
        words = self.truth.fill(["--environment", "{capture_light}", "{exposure}"])
        self.assertTrue(words[1].endswith("env/noon.exr") and words[2] == "0.5")

    def test_the_page_names_what_was_not_run(self):
        result = self.chain.run(self.truth, {"name": "default"})
        record = {"date": "d", "machine": "m", "command": "c", "commit": None, "load": 0.1,
                  "settings": [{"name": "default"}],
                  "truths": {"t": {"views": 2, "results": {"default": result},
                                   "not_run": {"rays": "decompose has no --rays"}}}}
        text = page.page(record)
        self.assertIn("| default | 20.50 |", text)
        self.assertIn("`rays` was not run: decompose has no --rays", text)

    def test_the_ablation_has_names_and_reasons(self):
        settings = json.loads((BENCH / "relight-ablation.json").read_text())
        names = [s["name"] for s in settings]
        self.assertEqual(len(names), len(set(names)))
        self.assertTrue(all(s["what"] and (i == 0 or s.get("decompose") or s.get("relight"))
                            for i, s in enumerate(settings)))


if __name__ == "__main__":
    unittest.main()
