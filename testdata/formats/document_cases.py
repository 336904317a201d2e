"""Camera paths, metrics and run records."""

import json

from cases import changed, invalid, valid
from capture_cases import IDENTITY


def camera_path():
    return {"format": "motes/camera-path", "version": "1.0", "width": 64, "height": 48,
            "fps": 24.0, "vertical_fov_deg": 50.0,
            "poses": [{"camera_from_world": dict(IDENTITY)} for _ in range(2)]}


def camera_paths():
    c = "camera-path"
    valid(c, "plain.json", json.dumps(camera_path()))
    ok = lambda name, change: valid(c, name + ".json", changed(camera_path, change))
    ok("zoom", lambda d: d["poses"][1].update(vertical_fov_deg=20.5))
    ok("defaults", lambda d: d.pop("fps"))

    def bad(name, expect, change):
        invalid(c, name + ".json", expect, changed(camera_path, change))
    bad("no-poses", "the path has no poses", lambda d: d.update(poses=[]))
    bad("fov-zero", "an angle of view of 0 degrees", lambda d: d.update(vertical_fov_deg=0))
    bad("fov-180", "an angle of view of 180 degrees (poses[1].vertical_fov_deg)",
        lambda d: d["poses"][1].update(vertical_fov_deg=180))
    bad("fps-zero", "0 frames per second", lambda d: d.update(fps=0))
    bad("width-1e18", "a frame of 1000000000000000000 x 48", lambda d: d.update(width=10**18))
    bad("rotation-zero", "(poses[0].camera_from_world.rotation_wxyz)",
        lambda d: d["poses"][0]["camera_from_world"].update(rotation_wxyz=[0, 0, 0, 0]))
    bad("a-capture", "this is not a motes/camera-path document", lambda d: d.update(format="motes/capture"))


def metrics():
    scores = {"psnr": 25.5, "psnr_float": 25.51, "psnr_color_corrected": 26.0, "ssim": 0.8,
              "lpips": None}
    return {
        "format": "motes/metrics", "version": "1.0", "split": "test", **scores, "gap": 3.25,
        "protocol": {
            "split_rule": "every 8th view by name", "size_px": [640, 480], "resize_filter": "none",
            "background": [0.0, 0.0, 0.0], "masks": "left out", "mean": "mean of the views' scores",
            "psnr": {"peak": 1.0, "encoding": "sRGB", "bits": 8, "cap_db": 128.0,
                     "color_correction": "affine RGB, least squares"},
            "ssim": {"window_px": 11, "sigma_px": 1.5, "k1": 0.01, "k2": 0.03, "border": "same"},
            "lpips": None, "lpips_reason": "no weights were given"},
        "gaussians": 1000,
        "views": [{"name": "a.jpg", "split": "test", **scores, "counted_share": 1.0}],
        "train": {**scores, "psnr": 28.75}, "test": scores, "seeds": None,
    }


def metrics_files():
    m = "metrics"
    valid(m, "plain.json", json.dumps(metrics()))
    row = {"seed": 1, "gaussians": "a.ply", "psnr": 25.0, "gap": None}
    valid(m, "seeds.json", changed(metrics, lambda d: d.update(
        seeds={"rows": [row, {**row, "seed": None}], "mean": {"psnr": 25.0}, "deviation": {}})))
    valid(m, "lpips.json", changed(metrics, lambda d: d["protocol"].update(
        lpips={"network": "vgg", "input_range": "[-1, 1]", "weights_sha256": "00"},
        lpips_reason=None)))

    def bad(name, expect, change):
        invalid(m, name + ".json", expect, changed(metrics, change))
    bad("no-protocol", "missing field `protocol`", lambda d: d.pop("protocol"))
    bad("split-unknown", "unknown variant `val`", lambda d: d.update(split="val"))
    bad("psnr-text", "invalid type: string \"25\"", lambda d: d["views"][0].update(psnr="25"))
    bad("version-2", "version 2.1 of motes/metrics is not known", lambda d: d.update(version="2.1"))


def run_record():
    return {
        "format": "motes/run", "version": "1.0", "tool": "train-splat", "tool_version": "0.1.0",
        "git": None, "argv": ["train-splat", "--seed", "7"], "config": {"seed": 7, "list": [1.5]},
        "seed": 7, "threads": 2,
        "inputs": [{"role": "capture", "path": "capture.json", "sha256": "0" * 64}],
        "outputs": ["gaussians.ply"], "warnings": [], "start": "2026-01-02T03:04:05Z",
        "wall_s": 1.5, "cpu_s": 2.75, "peak_memory_bytes": 123456789, "report": {"psnr": 20.25},
    }


def run_records():
    r = "run"
    valid(r, "plain.json", json.dumps(run_record()))

    def sparse(d):
        for key in ("tool_version", "git", "seed", "cpu_s", "peak_memory_bytes", "warnings"):
            del d[key]
        del d["inputs"][0]["sha256"]
    valid(r, "sparse.json", changed(run_record, sparse))
    invalid(r, "no-argv.json", "missing field `argv`", changed(run_record, lambda d: d.pop("argv")))
    invalid(r, "threads-negative.json", "invalid value: integer `-1`",
            changed(run_record, lambda d: d.update(threads=-1)))
    invalid(r, "nested.json", "recursion limit",
            json.dumps(run_record()).replace("[1.5]", "[" * 5000 + "]" * 5000))


def decomposition():
    return {
        "format": "motes/decomposition", "version": "1.0", "made_by": "motes 0.1.0",
        "gaussians": "gaussians.ply", "surface": "surface.ply", "environment": "environment.exr",
        "environment_convention": "blender", "up_in_world": [0.0, 0.0, 1.0],
        "lobes": "principled", "indirect": True,
        "scale_anchor": {"kind": "albedo-anchor", "explanation": "a base color was given",
                         "factor_rgb": [0.5, 1.0, 1.5]},
        "terms": [{"name": "specular", "kept": False, "evidence": "it explains nothing",
                   "numbers": {"gain_db": 0.01, "probes": None}}],
        "views": [{"name": "a.png", "split": "test", "psnr_db": 25.5},
                  {"name": "b.png", "split": "train", "psnr_db": None}],
        "counts": {"gaussians": 3, "unobserved_gaussians": 1, "vertices": 4, "triangles": 2},
        "seconds": 12.5,
    }


def decompositions():
    d = "decomposition"
    valid(d, "plain.json", json.dumps(decomposition()))

    def short(document):
        for key in ("made_by", "terms", "views", "counts", "seconds"):
            document.pop(key)
    valid(d, "short.json", changed(decomposition, short))
    valid(d, "folders.json", changed(decomposition, lambda c: c.update(surface="parts/mesh.ply")))

    def bad(name, expect, change):
        invalid(d, name + ".json", expect, changed(decomposition, change))
    bad("absolute", "the file name \"/etc/passwd\" is absolute (surface)",
        lambda c: c.update(surface="/etc/passwd"))
    bad("upwards", "leads out of the folder of the document (environment)",
        lambda c: c.update(environment="../sky.exr"))
    bad("no-gaussians", "missing field `gaussians`", lambda c: c.pop("gaussians"))
    bad("convention-unknown", "unknown variant `maya`",
        lambda c: c.update(environment_convention="maya"))
    bad("lobes-unknown", "unknown variant `phong`", lambda c: c.update(lobes="phong"))
    bad("up-zero", "(up_in_world)", lambda c: c.update(up_in_world=[0, 0, 0]))
    bad("up-long", "(up_in_world)", lambda c: c.update(up_in_world=[0, 0, 2]))
    bad("factor-zero", "(scale_anchor.factor_rgb)",
        lambda c: c["scale_anchor"].update(factor_rgb=[1, 0, 1]))
    bad("version-2", "version 2.0 of motes/decomposition is not known",
        lambda c: c.update(version="2.0"))
    bad("a-capture", "this is not a motes/decomposition document",
        lambda c: c.update(format="motes/capture"))


def edit_plan():
    return {"format": "motes/edit-plan", "version": "1.0", "seed": 7, "ops": [
        {"op": "select", "id": "a", "steps": [
            {"combine": "set", "by": "sphere", "center": [0.0, 1.0, 2.0], "radius": 0.5},
            {"post": "invert"}]},
        {"op": "transform", "target": "a", "translate": [0.5, 0.0, -1.25], "pivot": "base", "fill": "plane"},
        {"op": "duplicate", "as": "b", "translate": [1.0, 0.0, 0.0], "count": 3},
        {"op": "set_material", "target": "b", "name": "brass", "roughness": 0.25},
        {"op": "delete", "target": "a", "fill": "none"},
        {"op": "undo", "steps": 1}]}


def edit_plans():
    p = "edit-plan"
    valid(p, "plain.json", json.dumps(edit_plan()))
    valid(p, "nothing.json", changed(edit_plan, lambda d: d.update(ops=[])))
    valid(p, "log.json", changed(edit_plan, lambda d: d.update(record={
        "made_by": "motes edit 0.1.0", "gaussians_sha256": "0" * 64,
        "applied": [{"at": "/ops/0", "op": "select", "gaussians": 5, "total": 9,
                     "numbers": {"height": 0.5, "none": None}}],
        "skipped": [{"at": "/ops/4", "op": "delete", "why": "taken back by /ops/5"}],
        "warnings": []})))

    def bad(name, expect, change):
        invalid(p, name + ".json", expect, changed(edit_plan, change))
    bad("scale-zero", "0 is not a number above 0 (/ops/1/scale)", lambda d: d["ops"][1].update(scale=0))
    bad("op-unknown", "(/ops/4/op)", lambda d: d["ops"][4].update(op="explode"))
    bad("key-unknown", "unknown field `rotate`", lambda d: d["ops"][1].update(rotate=3))
    bad("later", "is made by a later operation (/ops/1/target)", lambda d: d["ops"][1].update(target="b"))
    bad("itself", "refers to itself (/ops/2/target)", lambda d: d["ops"][2].update(target="b"))
    bad("copies-1e9", "1000000000 is not from 1 to 10000 (/ops/2/count)", lambda d: d["ops"][2].update(count=10**9))
    bad("undo-9", "9 steps cannot be undone, 5 were done (/ops/5/steps)", lambda d: d["ops"][5].update(steps=9))
    bad("version-2", "version 2.0 of motes/edit-plan is not known", lambda d: d.update(version="2.0"))
    bad("a-capture", "this is not a motes/edit-plan document", lambda d: d.update(format="motes/capture"))
    text = json.dumps(edit_plan()).replace("-1.25", "NaN")
    invalid(p, "nan.json", "(/ops/1/translate/2 line 1", text)
