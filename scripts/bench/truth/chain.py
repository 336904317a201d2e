"""From a ground-truth folder to scores: import, train, decompose, relight, score.

Every step keeps its product in a folder that is named by a hash of what determines it (program,
flags, inputs), with cost.json beside it, so that settings share what they have in common and a
stopped run goes on.
"""

import json
import os
import shutil
from pathlib import Path

from sweep import captures, runner


class Truth:
    """A ground-truth folder and what is already there for it."""

    def __init__(self, name, folder):
        self.name, self.folder = name, Path(folder)
        scene = json.loads((self.folder / "scene.json").read_text())
        self.exposure, self.lights = scene["exposure"], scene["relight_lights"]
        self.capture_light = self.folder / scene["lights"][scene["capture_light"]]["file"]
        self.given = {}
        # Photos and documents stand for the folder: its other files are scored, not learned from.
        files = sorted([self.folder / "scene.json", *(self.folder / "images").iterdir(),
                        *self.folder.glob("transforms_*.json")])
        self.key = captures.text_hash(name, *map(captures.file_hash, files))

    def fill(self, flags):
        """Flags with {exposure}, {capture_light} and {truth} filled in."""
        return [f.format(exposure=self.exposure, capture_light=self.capture_light,
                         truth=self.folder) for f in flags]


class Chain:
    def __init__(self, bin_dir, work, threads, seed, quality, say, sfm=None):
        self.bin_dir, self.work, self.say = bin_dir, work, say
        self.threads, self.seed, self.quality = str(threads), str(seed), quality
        # Where COLMAP gives poses and points: the script that asks it, after its interpreter.
        self.sfm = sfm
        self.programs = {}
        self.started = 0

    def command(self, program):
        return self.sfm if program == "truth-sfm" else [self.bin_dir / program]

    def program_hash(self, program):
        if program not in self.programs:
            self.programs[program] = captures.file_hash(self.command(program)[-1])
        return self.programs[program]

    def step(self, truth, program, words, inputs, label, allowed=(0,)):
        """(folder, key, cost) of one program that ends with an allowed exit code; {out} in `words`
        is its folder."""
        key = captures.text_hash(program, self.program_hash(program), *words, *inputs)
        folder = self.work / truth.name / f"{label}-{key}"
        if not (folder / "cost.json").exists():
            self.say(f"{truth.name}: {label}")
            self.started += 1
            partial = folder.with_name(folder.name + ".partial")
            shutil.rmtree(partial, ignore_errors=True)
            partial.mkdir(parents=True)
            command = [*self.command(program), *(w.replace("{out}", str(partial)) for w in words)]
            cost = runner.measured(command, timeout=7200, log=partial / "stderr.txt", allowed=allowed)
            cost["command"] = " ".join([program, *words])
            (partial / "cost.json").write_text(json.dumps(cost, indent=1) + "\n")
            shutil.rmtree(folder, ignore_errors=True)
            os.replace(partial, folder)
        return folder, key, json.loads((folder / "cost.json").read_text())

    def given(self, truth, what):
        """(path, key) of a product that the user named; None when there is none."""
        path = truth.given.get(what)
        if path is None:
            return None
        key = captures.folder_hash(path) if path.is_dir() else captures.file_hash(path)
        return path, key

    def common(self):
        return ["--seed", self.seed, "--threads", self.threads]

    def capture(self, truth, setting, costs):
        if found := self.given(truth, "capture"):
            return found
        words = [str(truth.folder), "-o", "{out}/capture", "--threads", self.threads]
        if self.sfm:
            folder, key, costs["truth-sfm"] = self.step(
                truth, "truth-sfm", [*words, "--bin", str(self.bin_dir)], [truth.key], "sfm")
            return folder / "capture/capture.json", key
        words += truth.fill(setting.get("import", []))
        folder, key, costs["import-colmap"] = self.step(
            truth, "import-colmap", words, [truth.key], "import")
        return folder / "capture/capture.json", key

    def gaussians(self, truth, setting, capture, costs):
        if found := self.given(truth, "gaussians"):
            return found
        words = ["--capture", str(capture[0]), "-o", "{out}/gaussians.ply", *self.common()]
        words += truth.fill(setting.get("train", []))
        folder, key, costs["train-splat"] = self.step(
            truth, "train-splat", words, [capture[1]], "train")
        return folder / "gaussians.ply", key

    def scene(self, truth, setting, capture, gaussians, costs):
        if found := self.given(truth, "scene"):
            return found
        words = ["--capture", str(capture[0]), "--gaussians", str(gaussians[0]), "-o",
                 "{out}/scene", *self.common(), *truth.fill(setting.get("decompose", []))]
        folder, key, costs["decompose"] = self.step(
            truth, "decompose", words, [capture[1], gaussians[1]], "decompose")
        return folder / "scene", key

    def relight(self, truth, setting, capture, scene, light, costs):
        """Pictures and buffers under a light of the truth; under the scene's own for None."""
        words = ["--scene", str(scene[0]), "--capture", str(capture[0]), "--split", "test", "-o",
                 "{out}/pictures", "--quality", self.quality, *self.common()]
        if light is None:
            words += ["--format", "both"]
        else:
            words += ["--environment", str(truth.folder / f"env/{light}.exr"),
                      "--env-convention", "blender", "--env-up", "map",
                      "--env-exposure", str(truth.exposure)]
        words += truth.fill(setting.get("relight", []))
        label = f"relight-{light or 'own'}"
        folder, key, costs[f"relight {light or 'own'}"] = self.step(
            truth, "relight", words, [capture[1], scene[1]], label)
        return folder / "pictures", key

    def splat(self, truth, capture, gaussians, costs):
        words = ["--capture", str(capture[0]), "--gaussians", str(gaussians[0]), "--split",
                 "test", "-o", "{out}/pictures", "--threads", self.threads]
        folder, key, costs["render"] = self.step(
            truth, "render", words, [capture[1], gaussians[1]], "render")
        return folder / "pictures", key

    def run(self, truth, setting):
        """Scores, costs and the folder of sheets of one setting."""
        costs = {}
        capture = self.capture(truth, setting, costs)
        gaussians = self.gaussians(truth, setting, capture, costs)
        splat = self.splat(truth, capture, gaussians, costs)
        scene = self.scene(truth, setting, capture, gaussians, costs)
        own = self.relight(truth, setting, capture, scene, None, costs)
        words = [str(truth.folder), "--splat", str(splat[0]), "--capture", str(own[0]),
                 "--buffers", str(own[0]), "-o", "{out}/scores.json", "--sheet",
                 "{out}/sheet.png", "--components", "{out}/components.png", "--page",
                 "{out}/scores.md"]
        keys = [splat[1], own[1]]
        for light in truth.lights:
            pictures = self.relight(truth, setting, capture, scene, light, costs)
            words += ["--relit", f"{light}={pictures[0]}"]
            keys.append(pictures[1])
        folder, _, _ = self.step(truth, "score-relight", words, keys, "score")
        scores = json.loads((folder / "scores.json").read_text())
        decomposition = scene[0] / "decomposition.json"
        document = json.loads(decomposition.read_text()) if decomposition.exists() else {}
        kept = {t["name"]: t["kept"] for t in document.get("terms", [])}
        return {"scores": scores, "costs": costs, "terms": kept,
                "scale_anchor": document.get("scale_anchor"),
                "decompose_run": run_record(scene[0]), "sheets": str(folder)}


def run_record(scene):
    """What a stage says about itself: CPU seconds and peak memory."""
    for path in [*scene.parent.glob("*.run.json"), *scene.glob("*.run.json")]:
        record = json.loads(path.read_text())
        return {k: record.get(k) for k in ("cpu_s", "wall_s", "peak_memory_bytes")}
    return None
