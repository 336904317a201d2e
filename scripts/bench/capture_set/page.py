"""Rows of a list of captures to a Markdown page and a Pareto plot."""

from sweep import front, plot


def all_told(row):
    """CPU seconds from photos to Gaussians."""
    return row["stages"]["import"]["cpu_seconds"] + row["stages"]["train"]["cpu_seconds"]


def text(value, digits=2):
    return "-" if value is None else f"{value:.{digits}f}"


def seconds(value):
    return text(value, 1 if value < 10.0 else 0)


def verdict(row):
    """The fit's own judgement in a word."""
    failure = (row.get("verdict") or {}).get("failure")
    if not row["stages"]["train"]["exit_code"]:
        return "fine"
    name = failure if isinstance(failure, str) else next(iter(failure or {}), "")
    return f"failed: {name}" if name else "failed"


def panels(rows):
    """Held-out PSNR over the cost of import and training, one picture a capture."""
    found = []
    for name in dict.fromkeys(r["capture"] for r in rows):
        mine = [r for r in rows if r["capture"] == name]
        on_front = front.pareto([(all_told(r), r["psnr"]) for r in mine])
        points = [{"row": {"kind": "preset", "name": r["preset"], "label": r["preset"],
                           "front": i in on_front},
                   "cost": all_told(r), "quality": r["psnr"], "spread": None}
                  for i, r in enumerate(mine)]
        if len(points) > 1:
            found.append({"stage": "import and train", "data": name, "points": points,
                          "x": "CPU s", "y": "held-out PSNR, dB"})
    return found


def protocol(rows):
    """One sentence per capture: what its numbers are."""
    lines = []
    for name in dict.fromkeys(r["capture"] for r in rows):
        row = next(r for r in rows if r["capture"] == name)
        p = row["protocol"]
        sizes = ", ".join(f"{w} × {h}" for w, h in row["sizes"][:3])
        sizes += " and others" if len(row["sizes"]) > 3 else ""
        lines.append(f"- {name}: {row['train_photos']} training photos, {row['test_photos']} held out "
                     f"({p['split_rule']}), {sizes}; background {p['background']}, SSIM border "
                     f"{p['ssim']['border']}, mean over views.")
    return lines


def table(rows):
    heads = ["capture", "preset", "held-out dB", "color-corrected", "SSIM", "training dB", "steps",
             "Gaussians", "start", "CPU s, import and train", "fit says"]
    relit = any("psnr_own_light" in r for r in rows)
    heads += ["own light, relit dB"] if relit else []
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for r in rows:
        cells = [r["capture"], r["preset"], text(r["psnr"]), text(r["psnr_color_corrected"]),
                 text(r["ssim"], 3), text(r["psnr_train"]), str(r["iterations"]), str(r["gaussians"]),
                 (r["verdict"] or {}).get("start") or "-", seconds(all_told(r)), verdict(r)]
        cells += [text(r.get("psnr_own_light"))] if relit else []
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def stages(rows):
    lines = ["| capture | preset | stage | CPU s | wall s | peak MB |", "|---|---|---|---|---|---|"]
    for r in rows:
        for name, cost in r["stages"].items():
            lines.append(f"| {r['capture']} | {r['preset']} | {name} | {text(cost['cpu_seconds'], 1)} | "
                         f"{text(cost['wall_seconds'], 1)} | {text(cost['peak_bytes'] / 1e6, 0)} |")
    return lines


def page(record):
    rows, sheets = record["rows"], record["sheets"]
    lines = [f"# Captures, {record['date']}, {record['machine']}", "",
             f"Made by `{record['command']}` at commit {record['commit']}; load average {record['load']} "
             "at the start. PSNR in dB of 8-bit renders against held-out photos. CPU seconds are user "
             "and system time of the processes; wall times depend on what else the machine did.", "",
             *protocol(rows), "", *table(rows), ""]
    if panels(rows):
        lines += ["![Held-out PSNR over CPU seconds](pareto.svg)", ""]
    lines += ["## Stages", "", *stages(rows), ""]
    if sheets:
        lines += ["## Contact sheets", ""]
        for name, columns in sheets.items():
            lines += [f"{name}: {', '.join(columns)}.", "", f"![{name}](sheets/{name}.png)", ""]
    if record["failed"]:
        lines += ["## Failed", ""] + [f"- {f['capture']}, {f['preset']}: {f['why'].splitlines()[0]}"
                                      for f in record["failed"]] + [""]
    return "\n".join(lines).rstrip() + "\n"


def svg(record):
    drawn = panels(record["rows"])
    return plot.document("Held-out PSNR over CPU seconds",
                         [lambda top, p=p: plot.pareto_panel(p, top) for p in drawn]) if drawn else None
