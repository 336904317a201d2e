"""Finished runs to a dated record: rows with mean and spread, the front, the Markdown page."""

import datetime
import json
import os
import pathlib
import platform
import subprocess

from . import declaration, front

ROOT = pathlib.Path(__file__).resolve().parents[3]


def processor():
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{names[0]}, {len(names)} cores" if names else platform.machine()


def commit():
    """Short name of the commit, with + when the tree differs from it; null outside a checkout."""
    def git(*words):
        return subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True)
    try:
        head = git("rev-parse", "--short", "HEAD")
        changed = git("status", "--porcelain", "--untracked-files=no", "--", "crates").stdout
    except OSError:
        return None
    return head.stdout.strip() + ("+" if changed else "") if head.returncode == 0 else None


def load_average():
    try:
        return round(os.getloadavg()[0], 2)
    except OSError:
        return None


def head(kind):
    """What every record of ours starts with."""
    return {"format": f"motes/{kind}", "version": "1.0",
            "date": datetime.date.today().isoformat(), "machine": processor(), "commit": commit()}


def build(declarations, settings, rows, missing, facts):
    """The record. `rows` are finished and failed runs, `missing` runs that did not start."""
    record = {**facts, "stages": {}, "rows": [], "failed": [], "missing": []}
    for stage, d in declarations.items():
        if any(s.stage == stage for s in settings):
            record["stages"][stage] = {
                "what": d.get("what", ""), "quality": d["quality"],
                "cost": d.get("cost", "cpu_seconds"), "metrics": d["metrics"],
                "dials": [{k: dial.get(k) for k in
                           ("name", "flag", "default", "buys", "costs", "when", "capture")}
                          for dial in d["dials"]]}
    done = {}
    for row in rows:
        if "failed" in row:
            record["failed"].append({k: row[k] for k in ("setting", "data", "seed", "failed")})
        else:
            done.setdefault((row["setting"], row["data"]), []).append(row)
    record["missing"] = [{"setting": r.setting.id, "data": r.data, "seed": r.seed}
                         for r in missing]
    for data in facts["captures"]:
        for setting in settings:
            runs = sorted(done.get((setting.id, data), []), key=lambda r: r["seed"])
            if runs:
                record["rows"].append(aggregate(setting, data, runs, settings))
    compare(record)
    return record


def aggregate(setting, data, runs, settings):
    metrics = {}
    for name in runs[0]["metrics"]:
        values = [r["metrics"][name] for r in runs]
        if all(v is not None for v in values):
            metrics[name] = {"mean": front.mean(values), "spread": front.spread(values)}
    base = declaration.base_of(setting, settings)
    return {"id": setting.id, "base": base.id if base else None, "stage": setting.stage,
            "kind": setting.kind, "name": setting.name, "label": setting.label, "data": data,
            "capture": setting.variant, "flags": setting.flags, "quality": setting.quality,
            "seeds": [r["seed"] for r in runs], "metrics": metrics, "front": False}


def compare(record):
    """Adds to each row its difference from the base, and whether it lies on the front."""
    found = {(r["id"], r["data"]): r for r in record["rows"]}
    for row in record["rows"]:
        stage, base = record["stages"][row["stage"]], found.get((row["base"], row["data"]))
        if base is None or base is row:
            continue
        quality, cost = row["quality"], stage["cost"]
        if quality in row["metrics"] and quality in base["metrics"]:
            a, b = row["metrics"][quality], base["metrics"][quality]
            # A difference of two means of n and m runs scatters by s sqrt(1/n + 1/m).
            noise = None if b["spread"] is None else 2.0 * b["spread"] * (
                1.0 / len(row["seeds"]) + 1.0 / len(base["seeds"])) ** 0.5
            row["difference"] = a["mean"] - b["mean"]
            row["noise"] = noise
        if row["metrics"].get(cost) and base["metrics"].get(cost):
            row["cost_factor"] = row["metrics"][cost]["mean"] / base["metrics"][cost]["mean"]
    for panel in panels(record):
        for i in front.pareto([(p["cost"], p["quality"]) for p in panel["points"]]):
            panel["points"][i]["row"]["front"] = True


def panels(record):
    """One picture each: points of a stage on a capture, all training views; one is not a picture."""
    found = []
    for stage, d in record["stages"].items():
        for data in record["captures"]:
            points = []
            for row in record["rows"]:
                m = row["metrics"]
                mine = (row["stage"], row["data"], row["capture"]) == (stage, data, "all")
                if mine and d["quality"] in m and d["cost"] in m:
                    points.append({"row": row, "cost": m[d["cost"]]["mean"],
                                   "quality": m[d["quality"]]["mean"],
                                   "spread": m[d["quality"]]["spread"]})
            if len(points) > 1:
                found.append({"stage": stage, "data": data, "points": points,
                              "x": d["metrics"][d["cost"]]["title"],
                              "y": d["metrics"][d["quality"]]["title"]})
    return found


def number(value, digits, spread=None):
    if value is None:
        return ""
    text = f"{value:.{digits}f}"
    return text if spread is None else f"{text} ± {spread:.{digits}f}"


def name_of(row):
    """A setting in few words."""
    if row["kind"] in ("base", "preset", "grid"):
        return row["label"]
    return f"{row['name']} {row['label']}"


def cells(row, stage):
    out = []
    for name, how in stage["metrics"].items():
        m = row["metrics"].get(name) or {"mean": None, "spread": None}
        out.append(number(m["mean"], how["digits"], m["spread"]))
    return out


def table(stage, rows, first):
    """Markdown of rows with all metrics of a stage."""
    titles = [first, "seeds"] + [how["title"] for how in stage["metrics"].values()]
    titles.append("command")
    lines = ["| " + " | ".join(titles) + " |", "|---" * len(titles) + "|"]
    for row in rows:
        name = f"**{name_of(row)}**" if row["front"] else name_of(row)
        command = f"`{row['stage']} {' '.join(row['flags'])}`".replace(" `", "`")
        lines.append("| " + " | ".join([name, str(len(row["seeds"])), *cells(row, stage), command])
                     + " |")
    return lines


def markdown(record, stem):
    lines = [f"# Speed against accuracy: {record['date']}, {record['machine']}", "",
             f"Made by `{record['command']}` at commit {record['commit']}; long side "
             f"{record['long_side']}, every 8th view held out, PSNR of 8-bit renders, mean of views; "
             f"{record['threads']} thread a run, {record['jobs']} runs side by side, load average "
             f"{record['load']} at the start. Values are mean ± sample standard deviation over "
             "seeds. **Bold**: on the Pareto front of its capture.", "",
             f"![Pareto fronts]({stem}.svg)", ""]
    for stage_name, stage in record["stages"].items():
        for data in record["captures"]:
            for capture in ("all", "few"):
                rows = [r for r in record["rows"]
                        if (r["stage"], r["data"], r["capture"]) == (stage_name, data, capture)]
                if rows:
                    lines += [f"## {stage_name}, {data}, {capture} training views", ""]
                    lines += table(stage, rows, "setting") + [""]
    for title, entries in (("Failed", record["failed"]), ("Not run: the budget ended first",
                                                          record["missing"])):
        if entries:
            lines += [f"## {title}", ""]
            lines += [f"- `{e['setting']}` on {e['data']}, seed {e['seed']}"
                      + (f": {e['failed'].splitlines()[0]}" if "failed" in e else "")
                      for e in entries] + [""]
    return "\n".join(lines).rstrip() + "\n"


def write(record, folder, stem, pages):
    """`pages`: suffix to text, beside the JSON."""
    folder.mkdir(parents=True, exist_ok=True)
    for suffix, text in {".json": json.dumps(record, indent=1) + "\n", **pages}.items():
        (folder / (stem + suffix)).write_text(text)
