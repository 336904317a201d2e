"""Checks of the sweep without any program: python3 -m unittest discover -s scripts/bench/tests"""

import json
import math
import pathlib
import random
import sys
import tempfile
import unittest
import xml.etree.ElementTree

sys.dont_write_bytecode = True
BENCH = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(BENCH))
from sweep import captures, declaration, front, page, plot, record, runner  # noqa: E402


def beats(a, b):
    return a[0] <= b[0] and a[1] >= b[1] and a != b


class Front(unittest.TestCase):
    def test_a_beaten_point_is_not_on_the_front(self):
        points = [(1.0, 10.0), (2.0, 9.0), (3.0, 12.0), (3.0, 11.0), (4.0, 12.0)]
        self.assertEqual(front.pareto(points), [0, 2])

    def test_equal_points_appear_once_and_nan_never(self):
        points = [(2.0, 5.0), (2.0, 5.0), (math.nan, 9.0), (1.0, math.nan), (math.inf, 99.0)]
        self.assertEqual(front.pareto(points), [0])

    def test_it_equals_the_definition_on_random_points(self):
        draw = random.Random(7)
        for _ in range(200):
            # Few distinct values, so that ties are common.
            points = [(draw.randrange(6), draw.randrange(6)) for _ in range(draw.randrange(1, 30))]
            found = {points[i] for i in front.pareto(points)}
            self.assertEqual(found, {p for p in points if not any(beats(q, p) for q in points)})

    def test_spread_is_the_sample_deviation(self):
        self.assertIsNone(front.spread([3.0]))
        self.assertAlmostEqual(front.spread([1.0, 2.0, 3.0]), 1.0)

    def test_exponents_see_a_steep_end_behind_a_fixed_cost(self):
        xs = [1.0, 10.0, 100.0, 1000.0]
        whole, steepest = front.exponents(xs, [3.0 * x for x in xs])
        self.assertAlmostEqual(whole, 1.0)
        self.assertAlmostEqual(steepest, 1.0)
        whole, steepest = front.exponents(xs, [5000.0 + x ** 2 for x in xs])
        self.assertLess(whole, 1.05)
        self.assertGreater(steepest, 1.5)


class Declarations(unittest.TestCase):
    def good(self):
        return {"stage": "s", "command": [], "metrics": {"q": {}, "c": {}}, "quality": "q",
                "base": ["--a=1"], "dials": [
                    {"name": "b", "flag": "--b", "default": "0", "values": [1, 2], "buys": "",
                     "costs": "", "when": ""}]}

    def test_all_declarations_of_the_repository_are_valid(self):
        for plan in declaration.PLANS:
            for stage in declaration.load(BENCH / "dials").values():
                ids = [s.id for s in declaration.settings(stage, plan)]
                self.assertEqual(len(ids), len(set(ids)), stage["stage"])

    def test_unknown_keys_and_missing_rules_are_refused(self):
        declaration.check(self.good(), "s.json")
        for change in ({"bogus": 1}, {"dials": [{"name": "b"}]}, {"quality": "z"}):
            with self.assertRaises(declaration.DeclarationError):
                declaration.check({**self.good(), **change}, "s.json")

    def test_another_file_adds_dials_and_must_find_its_stage(self):
        more = {"extends": "s", "dials": [{**self.good()["dials"][0], "name": "z"}]}
        joined = declaration.extended(self.good(), more, "s-more.json")
        self.assertEqual([d["name"] for d in joined["dials"]], ["b", "z"])
        for bad in ({"extends": "s", "base": []}, {"extends": "s", "dials": self.good()["dials"]}):
            with self.assertRaises(declaration.DeclarationError):
                declaration.extended(self.good(), bad, "s-more.json")
        with self.assertRaises(declaration.DeclarationError):
            declaration.extended(None, more, "s-more.json")

    def test_a_flag_that_no_help_lists_is_named(self):
        settings = declaration.settings(self.good(), "quick")
        self.assertEqual(declaration.unknown_flags(settings, {"s": {"--a", "--b"}}), [])
        self.assertEqual(declaration.unknown_flags(settings, {"s": {"--a"}}), [("s/b", "--b")])

    def test_later_flags_win_in_the_place_of_the_first(self):
        self.assertEqual(declaration.merge(["--a=1", "--b=2"], ["--a=3"]), ["--a=3", "--b=2"])

    def test_a_grid_has_every_corner_and_multiplies_costs(self):
        grid = {"axes": {"--a": [{"value": 1, "factor": 2}, 2], "--b": [{"value": 3, "factor": 5}]}}
        self.assertEqual(list(declaration.corners(grid)),
                         [("1, 3", ["--a=1", "--b=3"], 10.0), ("2, 3", ["--a=2", "--b=3"], 5.0)])

    def test_a_dial_on_few_views_is_compared_with_a_base_there(self):
        stage = self.good()
        stage["dials"][0]["capture"] = "few"
        settings = declaration.settings(stage, "quick")
        dial = next(s for s in settings if s.kind == "dial")
        self.assertEqual(declaration.base_of(dial, settings).variant, "few")


class Running(unittest.TestCase):
    def test_cpu_time_of_a_busy_process_is_measured_and_failure_is_said(self):
        busy = "import time\nwhile time.process_time() < 0.2: pass"
        cost = runner.measured([sys.executable, "-c", busy])
        self.assertGreater(cost["cpu_seconds"], 0.19)
        with tempfile.TemporaryDirectory() as folder:
            log = pathlib.Path(folder) / "log"
            with self.assertRaisesRegex(runner.Failed, "exit code 3"):
                runner.measured([sys.executable, "-c", "raise SystemExit(3)"], log=log)
            with self.assertRaisesRegex(runner.Failed, "exit code -9"):
                runner.measured([sys.executable, "-c", "import time; time.sleep(60)"], timeout=0.2)

    def test_what_the_budget_refuses_is_returned_and_shorter_runs_still_start(self):
        done = []
        refused = runner.side_by_side([5, 1, 7, 2], done.append, 2, lambda task: task < 3)
        self.assertEqual((sorted(done), sorted(refused)), ([1, 2], [5, 7]))

    def test_an_error_in_a_worker_ends_the_sweep(self):
        with self.assertRaises(ZeroDivisionError):
            runner.side_by_side([0], lambda task: 1 / task, 1, lambda task: True)

    def test_half_a_cache_file_counts_as_none(self):
        with tempfile.TemporaryDirectory() as folder:
            cache = runner.Cache(pathlib.Path(folder))
            cache.put("a", {"x": 1})
            self.assertEqual(cache.get("a"), {"x": 1})
            (pathlib.Path(folder) / "a.json").write_text('{"x":')
            self.assertIsNone(cache.get("a"))

    def test_few_views_are_spread_and_keep_the_ends(self):
        self.assertEqual(captures.evenly(list("abcdefghi"), 3), ["a", "e", "i"])


def made_up_record():
    def row(name, kind, cost, quality, seeds=1, spread=None):
        return {"id": name, "base": "draft", "stage": "train-splat", "kind": kind,
                "name": "base" if name == "draft" else name, "label": name, "data": "d",
                "capture": "all", "flags": [f"--x={name}"], "quality": "q", "front": False,
                "seeds": list(range(seeds)), "metrics": {"c": {"mean": cost, "spread": None},
                                                         "q": {"mean": quality, "spread": spread}}}
    found = {"format": "motes/tradeoff", "date": "2000-01-01", "machine": "m", "commit": "0", "command": "tradeoff", "load": 0.0,
             "jobs": 2, "threads": 1, "long_side": 512, "captures": ["d"], "failed": [], "missing": [],
             "stages": {"train-splat": {"what": "", "quality": "q", "cost": "c", "metrics": {
                 "c": {"title": "CPU s", "digits": 1}, "q": {"title": "test dB", "digits": 2}},
                 "dials": [{"name": "sh", "flag": "--sh", "default": "3", "buys": "b", "costs": "c",
                            "when": "w", "capture": None}]}},
             "rows": [row("draft", "preset", 20.0, 19.9, 3, 0.1), row("sh", "dial", 15.0, 19.95),
                      row("high", "preset", 300.0, 21.0)]}
    record.compare(found)
    return found


class Pages(unittest.TestCase):
    def test_the_front_and_the_noise_are_in_the_record(self):
        draft, sh, high = made_up_record()["rows"]
        self.assertEqual([r["front"] for r in (draft, sh, high)], [False, True, True])
        self.assertAlmostEqual(sh["difference"], 0.05)
        self.assertAlmostEqual(sh["noise"], 0.2 * math.sqrt(1.0 + 1.0 / 3.0))
        self.assertAlmostEqual(sh["cost_factor"], 0.75)

    def test_a_page_goes_stale_when_a_number_changes_and_update_heals_it(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            found = made_up_record()
            record.write(found, folder, "r-tradeoff", page.pages(found, "r-tradeoff"))
            sheet = folder / "page.md"
            blocks = ["plot", "source", "presets", "front", "dials train-splat"]
            sheet.write_text("# x\n" + "\n".join(
                f"<!-- tradeoff:{b} r-tradeoff.json -->\n<!-- /tradeoff -->\n" for b in blocks))
            self.assertTrue(page.stale(sheet))
            sheet.write_text(page.update(sheet))
            self.assertEqual(page.stale(sheet), [])
            text = sheet.read_text()
            self.assertIn("draft (by sh sh, +0.05 dB)", text)
            self.assertIn("~+0.05 dB, ×0.75", text)
            sheet.write_text(text.replace("+0.05", "+0.50"))
            self.assertTrue(page.stale(sheet))
            sheet.write_text(text)
            found["rows"][1]["metrics"]["q"]["mean"] = 20.4
            (folder / "r-tradeoff.json").write_text(json.dumps(found))
            self.assertEqual(len(page.stale(sheet)), 3)

    def test_the_plot_marks_presets_labels_the_front_and_is_well_formed(self):
        found = made_up_record()
        svg = plot.tradeoff(found, record.panels(found))
        xml.etree.ElementTree.fromstring(svg)
        self.assertEqual(svg.count('class="preset"'), 2)
        for text in (">draft<", ">high<", ">sh sh<", "CPU s, logarithmic", "prefers-color-scheme"):
            self.assertIn(text, svg)

    def test_the_page_of_the_repository_equals_its_record(self):
        sheet = BENCH.parents[1] / "docs/benchmarks/speed-accuracy.md"
        self.assertEqual(page.stale(sheet), [])


if __name__ == "__main__":
    unittest.main()
