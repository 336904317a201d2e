"""Cost curves: fits of growth, their table, their picture."""

import math

from . import front, plot

# What is fitted against what: (name, unit).
MEASURES = {"step_cpu_ms": ("training step", "CPU ms"), "fixed_cpu_s": ("besides steps", "CPU s"),
            "frame_cpu_ms": ("render frame", "CPU ms"), "train_peak_mb": ("training memory", "MB"),
            "render_peak_mb": ("render memory", "MB")}
TITLES = {"pixels": "pixels of a photo", "gaussians": "Gaussians", "views": "training views"}
LINEAR = 1.05


def of_curve(points, curve):
    return sorted((p for p in points if p["curve"] == curve), key=lambda p: p["sizes"][curve])


def fits(points):
    """Powers of every measure along every curve, bytes per size, and the gain of threads."""
    found = {}
    for curve in TITLES:
        along = of_curve(points, curve)
        if len(along) < 2:
            continue
        xs = [p["sizes"][curve] for p in along]
        for measure in MEASURES:
            ys = [p[measure] for p in along]
            whole, steepest = front.exponents(xs, ys)
            per_unit, rest = front.slope(xs, ys)
            found[f"{curve}/{measure}"] = {
                "power": finite(whole), "steepest_power": finite(steepest),
                "per_unit": finite(per_unit), "rest": finite(rest)}
    threads = of_curve(points, "threads")
    if len(threads) > 1:
        one, more = threads[0], threads[-1]
        found["threads/step"] = {
            "threads": more["sizes"]["threads"],
            "speed_up": finite(ratio(one["step_wall_ms"], more["step_wall_ms"])),
            "cpu_factor": finite(ratio(more["step_cpu_ms"], one["step_cpu_ms"]))}
    return found


def ratio(a, b):
    """NaN where noise made a difference of two runs negative."""
    return a / b if a > 0.0 and b > 0.0 else math.nan


def finite(value):
    """JSON has no NaN."""
    return value if math.isfinite(value) else None


def sentences(record):
    """What the fits say, one line each."""
    lines = []
    for name, fit in record["fits"].items():
        curve, measure = name.split("/")
        if curve == "threads":
            said = "too short to tell"
            if fit["speed_up"] is not None and fit["cpu_factor"] is not None:
                said = (f"{fit['speed_up']:.2f} times as fast, {fit['cpu_factor']:.2f} times the CPU "
                        "time")
            lines.append(f"a step with {fit['threads']} threads: {said}")
            continue
        if fit["power"] is None:
            continue
        title, unit = MEASURES[measure]
        text = (f"{title} grows with {TITLES[curve]} to the power {fit['power']:.2f}, steepest "
                f"{fit['steepest_power']:.2f}: "
                + ("no super-linear term" if fit["steepest_power"] <= LINEAR else "super-linear"))
        if unit == "MB":
            text += (f"; {1e6 * fit['per_unit']:.0f} bytes for each of the {TITLES[curve]}"
                     f" and {fit['rest']:.0f} MB")
        lines.append(text)
    return lines


def markdown(record, stem):
    flags = f" with `{' '.join(record['options'])}`" if record["options"] else ""
    lines = [f"# Cost curves: {record['date']}, {record['machine']}", "",
             f"Made by `{record['command']}`{flags} at commit {record['commit']}, load average "
             f"{record['load']} at the start. `scripts/bench/cost --help` says what is measured: made-up "
             "scenes, SH degree 3, full resolution, the number of Gaussians fixed; CPU times are of "
             "one thread but for the thread curve. A power of at most 1.05 between all neighbors "
             "means that no term grows faster than in proportion; a noisy small point can raise it.",
             "", f"![Cost curves]({stem}.svg)", ""]
    lines += [f"- {sentence}" for sentence in sentences(record)] + [""]
    for curve in [*TITLES, "threads"]:
        along = of_curve(record["points"], curve)
        if not along:
            continue
        lines += [f"## Against {TITLES.get(curve, curve)}", "",
                  "| pixels | Gaussians | views | threads | step CPU ms | step wall ms | besides steps "
                  "CPU s | frame CPU ms | training MB | render MB | file MB |", "|---" * 11 + "|"]
        for p in along:
            s = p["sizes"]
            lines.append(f"| {s['pixels']} | {s['gaussians']} | {s['views']} | {s['threads']} "
                         f"| {p['step_cpu_ms']:.1f} | {p['step_wall_ms']:.1f} | {p['fixed_cpu_s']:.2f} "
                         f"| {p['frame_cpu_ms']:.1f} | {p['train_peak_mb']:.0f} "
                         f"| {p['render_peak_mb']:.0f} | {p['file_mb']:.1f} |")
        lines.append("")
    for title in ("failed", "missing"):
        if record[title]:
            lines += [f"## {title.capitalize()}", ""] + [
                f"- {e['curve']} {e['sizes']}: {e['why'].splitlines()[0]}" for e in record[title]] + [""]
    return "\n".join(lines).rstrip() + "\n"


def svg(record):
    """One panel per curve: cost relative to its smallest point; the dashed line is proportion."""
    panels = []
    for curve, title in TITLES.items():
        along = of_curve(record["points"], curve)
        if len(along) > 1:
            panels.append(lambda top, a=along, c=curve, t=title: panel(top, a, c, t))
    return plot.document(f"Cost curves, {record['date']}", panels)


def panel(top, along, curve, title):
    xs = [p["sizes"][curve] for p in along]
    series = []
    for measure, (name, unit) in MEASURES.items():
        ys = [p[measure] for p in along]
        # A training run of few steps is noisy where it takes no time at all.
        if measure != "render_peak_mb" and all(y > 0.0 for y in ys):
            ends = [f"{y:.0f}" if y >= 100.0 else f"{y:.3g}" for y in (ys[0], ys[-1])]
            series.append((f"{name}: {ends[0]} to {ends[1]} {unit}", [y / ys[0] for y in ys]))
    highest = max([xs[-1] / xs[0]] + [max(ys) for _, ys in series])
    lowest = min([1.0] + [min(ys) for _, ys in series])
    # Room at the right for the names.
    right = plot.WIDTH - plot.RIGHT - 230
    x = plot.Axis(xs[0], xs[-1], plot.LEFT, right, log=True)
    bottom = top + plot.PANEL - plot.BOTTOM
    y = plot.Axis(lowest, highest, bottom, top + plot.TOP, log=True)
    out = plot.frame(x, y, top, f"Cost against {title}", f"{title}, logarithmic",
                     "cost over that of the smallest, logarithmic", right)
    out.append(f'<path class="ideal" d="M{x.at(xs[0]):.1f} {y.at(1.0):.1f}'
               f'L{x.at(xs[-1]):.1f} {y.at(xs[-1] / xs[0]):.1f}"/>')
    ends = [(y.at(xs[-1] / xs[0]), "in proportion", None)]
    for i, (name, ys) in enumerate(series):
        path = "L".join(f"{x.at(a):.1f} {y.at(b):.1f}" for a, b in zip(xs, ys))
        out.append(f'<path class="curve c{i}" d="M{path}"/>')
        out += [f'<circle class="f{i}" cx="{x.at(a):.1f}" cy="{y.at(b):.1f}" r="3.5"/>'
                for a, b in zip(xs, ys)]
        ends.append((y.at(ys[-1]), name, i))
    # Names beside the ends of their curves, pushed apart where they would overlap.
    at = top + plot.TOP - 20
    for where, name, i in sorted(ends, key=lambda end: end[0]):
        at = max(where, at + 17)
        css = "ideal" if i is None else f"curve c{i}"
        out.append(f'<path class="{css}" d="M{x.at(xs[-1]) + 7:.1f} {where:.1f}L{right + 20} {at:.1f}h8"/>'
                   f'<text class="small" x="{right + 32}" y="{at + 4:.1f}">{plot.escape(name)}</text>')
    return out
