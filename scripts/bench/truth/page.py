"""The Markdown page of a record."""

import math


def number(value, digits=2):
    return "-" if value is None or not math.isfinite(value) else f"{value:.{digits}f}"


def look(document, *keys):
    for key in keys:
        document = document.get(key) if isinstance(document, dict) else None
    return document


def cells(result, views):
    """One row of the table of settings."""
    scores, costs = result["scores"], result["costs"]
    relit = lambda align, what: look(scores, "relit_mean", align, what)
    material = lambda region, *keys: look(scores, "materials", region, *keys)
    relights = [c for name, c in costs.items()
                if name.startswith("relight ") and name != "relight own"]
    per_view = sum(c["cpu_seconds"] for c in relights) / max(1, len(relights) * views)
    peak = max((c["peak_rss_bytes"] for c in costs.values()), default=0) / 1e6
    return [
        number(relit("none", "psnr_db")), number(relit("none", "worst_psnr_db")),
        number(relit("scalar", "psnr_db")), number(relit("channel", "psnr_db")),
        number(relit("none", "ssim"), 3),
        number(look(scores, "capture", "aligned", "none", "psnr_db")),
        number(look(scores, "splat", "aligned", "none", "psnr_db")),
        number(material("all", "base_color", "none", "psnr_linear_db")),
        number(material("all", "base_color", "channel", "psnr_linear_db")),
        number(material("objects", "base_color", "channel", "psnr_linear_db")),
        number(material("objects", "roughness_mse"), 4),
        number(material("objects", "metallic_mse"), 4),
        number(material("objects", "normal_mae_deg")), number(material("support", "normal_mae_deg")),
        number(look(costs, "decompose", "cpu_seconds"), 0), number(per_view), number(peak, 0),
    ]


HEADINGS = ["setting", "relit none", "worst", "scalar", "channel", "SSIM", "own light", "splat",
            "base color none", "channel", "objects", "roughness MSE", "metallic MSE",
            "normals objects", "support", "decompose CPU s", "relight CPU s/view", "peak MB"]


def costs_table(costs):
    lines = ["| step | CPU s | wall s | peak MB |", "|---|---|---|---|"]
    for name, cost in costs.items():
        lines.append(f"| {name} | {cost['cpu_seconds']:.1f} | {cost['wall_seconds']:.1f} "
                     f"| {cost['peak_rss_bytes'] / 1e6:.0f} |")
    return lines


def page(record):
    lines = [f"# Relighting, {record['date']}, {record['machine']}", "",
             f"`{record['command']}`, commit {record['commit']}; load at the start {record['load']}.",
             "PSNR in dB of 8-bit sRGB pictures, base color in linear light, normals in degrees. "
             "Objects without the support where it says objects. CPU seconds are the processes'.", ""]
    for name, truth in record["truths"].items():
        lines += [f"## {name}", "", "| " + " | ".join(HEADINGS) + " |",
                  "|---" * len(HEADINGS) + "|"]
        for setting, result in truth["results"].items():
            lines.append("| " + " | ".join([setting, *cells(result, truth["views"])]) + " |")
        for setting, why in truth["not_run"].items():
            lines.append(f"\n`{setting}` was not run: {why}")
        first = next(iter(truth["results"].items()), None)
        if first:
            setting, result = first
            lines += ["", f"### {name}, {setting}", "", *costs_table(result["costs"]), ""]
            terms = {n: k for n, k in result["terms"].items() if not n.startswith("part ")}
            said = ", ".join(n + (" kept" if k else " left out") for n, k in terms.items())
            lines += [f"Terms: {said}; {len(result['terms']) - len(terms)} parts.", ""]
            lines += [line if not line.startswith("## ") else "" for line in
                      result.get("page", "").splitlines()]
        lines.append("")
    lines += ["## Settings", ""]
    lines += [f"- `{s['name']}`: {s.get('what', '')} `{' '.join(s.get('decompose', []) + s.get('relight', []))}`"
              for s in record["settings"]]
    return "\n".join(lines) + "\n"
