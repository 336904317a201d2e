"""One cell is one program on one capture: import, train, evaluate, decompose, relight.

A cell keeps its product in a folder named by a hash of what determines it (program, flags, inputs),
with cost.json beside it. A finished cell is found again and not run.
"""

import json
from pathlib import Path

from sweep import captures, runner
from truth.chain import Chain

TEST_EVERY = 8
# Exit code of a gate that is not met: train-splat ends so when the fit has failed, and still writes it.
GATE = 4


class Source:
    """A folder of photos, with poses or without."""

    def __init__(self, name, folder):
        self.name, self.folder = name, Path(folder)
        files = sorted(p for p in self.folder.rglob("*") if p.is_file())
        facts = [(p.relative_to(self.folder), p.stat().st_size, p.stat().st_mtime_ns) for p in files]
        self.key = captures.text_hash(name, *facts)

    def words(self):
        """How import-colmap takes it: a folder with poses by itself, photos alone by --photos."""
        has = lambda pattern: next(self.folder.glob(pattern), None) is not None
        posed = has("transforms*.json") or has("sparse*") or has("cameras.*") or has("colmap")
        return [str(self.folder)] if posed else ["--photos", str(self.folder)]


class Bench:
    """Runs the cells of one list of captures."""

    def __init__(self, args, say):
        self.args = args
        self.chain = Chain(args.bin.resolve(), (args.output / "cells").resolve(), args.threads,
                           args.seed, "standard", say)
        self.ran = 0

    def cell(self, source, label, program, words, inputs, allowed=(0,)):
        before = self.chain.started
        folder, key, cost = self.chain.step(source, program, words, inputs, label, allowed)
        self.ran += self.chain.started - before
        records = [json.loads(p.read_text()) for p in folder.rglob("*.run.json")]
        peaks = [r["peak_memory_bytes"] for r in records if r.get("peak_memory_bytes")]
        return folder, key, {"cpu_seconds": cost["cpu_seconds"], "wall_seconds": cost["wall_seconds"],
                             # The kernel's figure holds a child's, too: pycolmap takes most of an import.
                             "peak_bytes": max([*peaks, cost["peak_rss_bytes"]]),
                             "exit_code": cost["exit_code"]}

    def imported(self, source, photos):
        """(capture.json, key, cost) with all training photos, or `photos` of them, evenly chosen."""
        common = ["-o", "{out}/capture", "--threads", self.chain.threads, *self.args.import_flag]
        words = [*source.words(), *common, "--test-every", str(TEST_EVERY)]
        folder, key, cost = self.cell(source, "import", "import-colmap", words, [source.key])
        if photos is None:
            return folder / "capture/capture.json", key, cost
        lists = {"train": [], "test": []}
        for view in json.loads((folder / "capture/capture.json").read_text())["views"]:
            lists[view["split"]].append(view["name"])
        lists["train"] = captures.evenly(lists["train"], photos)
        words = [*source.words(), *common, "--points-from-train"]
        for split, names in lists.items():
            path = folder.with_name(f"{folder.name}-{photos}-{split}.txt")
            path.write_text("\n".join(names) + "\n")
            words += [f"--{split}-list", str(path)]
        folder, key, cost = self.cell(source, f"import-{photos}", "import-colmap", words, [source.key])
        return folder / "capture/capture.json", key, cost

    def row(self, source, photos, preset):
        """Numbers and products of one preset on one capture."""
        capture, key, import_cost = self.imported(source, photos)
        document = json.loads(capture.read_text())
        name = source.name if photos is None else f"{source.name}@{photos}"
        sizes = {(c["width"], c["height"]) for c in document["cameras"]}
        row = {"capture": name, "preset": preset, "sizes": sorted(map(list, sizes)),
               "train_photos": sum(v["split"] == "train" for v in document["views"]),
               "test_photos": sum(v["split"] == "test" for v in document["views"]),
               "stages": {"import": import_cost}, "folders": {"capture": str(capture)}}
        words = ["--capture", str(capture), "-o", "{out}/gaussians.ply", "--preset", preset,
                 "--metrics", "{out}/train.json", *self.chain.common(), *self.args.train_flag]
        fit, fit_key, row["stages"]["train"] = self.cell(
            source, f"train-{name}-{preset}", "train-splat", words, [key], allowed=(0, GATE))
        report = json.loads((fit / "train.json").read_text())
        row.update({k: report.get(k) for k in ("iterations", "gaussians", "psnr_train", "verdict")})
        gaussians = fit / "gaussians.ply"
        words = ["--capture", str(capture), "--gaussians", str(gaussians), "--split", "test",
                 "--metrics", "{out}/scores.json", "--save-renders", "{out}/renders",
                 "--threads", self.chain.threads]
        folder, _, row["stages"]["evaluate"] = self.cell(
            source, f"evaluate-{name}-{preset}", "evaluate", words, [key, fit_key])
        scores = json.loads((folder / "scores.json").read_text())
        row.update({k: scores[k] for k in ("psnr", "psnr_color_corrected", "ssim", "protocol")})
        row["folders"]["renders"] = str(folder / "renders")
        if preset in self.args.relight:
            self.relit(source, row, (capture, key), (gaussians, fit_key))
        return row

    def relit(self, source, row, capture, gaussians):
        """Adds decompose and relight: the held-out views under the scene's own light, scored against
        their photos, and under every --environment."""
        label = f"{row['capture']}-{row['preset']}"
        words = ["--capture", str(capture[0]), "--gaussians", str(gaussians[0]), "-o", "{out}/scene",
                 *self.chain.common()]
        folder, key, row["stages"]["decompose"] = self.cell(
            source, f"decompose-{label}", "decompose", words, [capture[1], gaussians[1]])
        for environment in [None, *self.args.environment]:
            light = environment.stem if environment else "own light"
            words = ["--scene", str(folder / "scene"), "--capture", str(capture[0]), "--split", "test",
                     "-o", "{out}/pictures", *self.chain.common()]
            words += ["--environment", str(environment)] if environment else []
            inputs = [capture[1], key] + ([captures.file_hash(environment)] if environment else [])
            pictures, own_key, row["stages"][f"relight {light}"] = self.cell(
                source, f"relight-{label}-{light.replace(' ', '-')}", "relight", words, inputs)
            row["folders"][f"relit, {light}"] = str(pictures / "pictures")
            if environment is None:
                words = ["--capture", str(capture[0]), "--renders", str(pictures / "pictures"),
                         "--split", "test", "--metrics", "{out}/scores.json"]
                scored, _, _ = self.cell(source, f"score-{label}", "evaluate", words,
                                         [capture[1], own_key])
                scores = json.loads((scored / "scores.json").read_text())
                row["psnr_own_light"] = scores["psnr"]


FAILURES = (runner.Failed, OSError, json.JSONDecodeError, KeyError)
