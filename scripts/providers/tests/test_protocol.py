"""The protocol of the providers in Python, by a provider without a model. Standard library only."""

import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(FOLDER))

PROVIDER = '''
import os, shutil, sys
sys.path.insert(0, FOLDER)
from provider_kit.protocol import BadInput, Failed, Provider, main

class Copy(Provider):
    name = "copy"
    kinds = ("relight", "predict")
    quantities = ("normal",)

    def add_options(self, parser):
        parser.add_argument("--bad", default="")

    def described(self):
        print("Loading pipeline components...")
        return {"deterministic": True}

    def answer(self, request):
        bad = self.options.bad
        print("step 1 of 20")
        os.write(1, b"from a library in C\\n")
        if bad == "memory": raise RuntimeError("CUDA out of memory. Tried to allocate 2 GiB\\nmore lines")
        if bad == "package": import no_such_package
        if bad == "odd": return 1 / 0
        if bad == "input": raise BadInput("the mask is\\nempty", "paint it")
        if request.kind == "predict": return {"maps": []}
        shutil.copyfile(request.file(request.task["picture"]), request.output("relit.png"))
        request.warn("a sentence"); request.warn("a sentence")
        return {"picture": "relit.png"}

sys.exit(main(Copy()))
'''


class Case(unittest.TestCase):
    """A folder with a provider and a picture."""

    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.folder = Path(self.temporary.name)
        (self.folder / "copy.py").write_text(PROVIDER.replace("FOLDER", repr(str(FOLDER))), encoding="utf-8")
        (self.folder / "a.png").write_bytes(b"picture")

    def run_with(self, *arguments, given=""):
        """Runs the provider."""
        line = [sys.executable, str(self.folder / "copy.py"), *map(str, arguments)]
        return subprocess.run(line, input=given, capture_output=True, text=True, timeout=60, check=False)

    def request(self, task, **more):
        """Writes a request; its path."""
        document = {"format": "motes/provider-request", "version": "1.0", "task": task, **more}
        path = self.folder / "request.json"
        path.write_text(json.dumps(document), encoding="utf-8")
        return path

    def reply(self):
        """The reply beside the request."""
        return json.loads((self.folder / "reply.json").read_text(encoding="utf-8"))


class TheProtocol(Case):
    """What every provider does alike."""

    def test_a_description_is_all_that_is_printed(self):
        done = self.run_with("--describe")
        self.assertEqual(done.returncode, 0, done.stderr)
        found = json.loads(done.stdout)
        self.assertEqual((found["format"], found["name"], found["deterministic"]), ("motes/provider", "copy", True))
        self.assertEqual(found["quantities"], ["normal"])

    def test_a_request_is_answered_and_nothing_is_printed(self):
        done = self.run_with("--request", self.request({"relight": {"picture": "a.png"}}))
        self.assertEqual((done.returncode, done.stdout), (0, ""), done.stderr)
        self.assertIn("from a library in C", done.stderr)
        self.assertEqual(self.reply()["result"], {"relight": {"picture": "relit.png"}})
        self.assertEqual(self.reply()["warnings"], ["a sentence"])

    def test_bad_requests_end_with_2_and_one_line(self):
        path = self.request({"relight": {"picture": "a.png"}})
        for text in ("", "{", "[]", "[" * 100000, '{"format": "motes/provider-request", "version": "2.0", "task": {}}'):
            path.write_text(text, encoding="utf-8")
            self.refused(path)
        many = {"relight": {"picture": "a.png"}, "predict": {}}
        for task in ({"dream": {}}, {}, many, {"relight": {}}, {"relight": {"picture": "../a.png"}}, {"relight": {"picture": "/etc/hosts"}},
                     {"relight": {"picture": "b.png"}}, {"relight": {"picture": 1}}, {"environment": {"picture": "a.png"}},
                     {"predict": {"pictures": ["a.png"], "quantities": ["depth"]}}, {"predict": {"pictures": [], "quantities": ["normal"]}}):
            self.refused(self.request(task))
        self.refused(self.request({"relight": {"picture": "a.png"}}, seed=-1))
        self.refused(self.folder / "no-such.json")

    def test_a_link_out_of_the_folder_is_refused(self):
        with tempfile.NamedTemporaryFile() as outside:
            (self.folder / "link.png").symlink_to(outside.name)
            self.refused(self.request({"relight": {"picture": "link.png"}}))

    def refused(self, path):
        """Runs a bad request."""
        done = self.run_with("--request", path)
        lines = [line for line in done.stderr.splitlines() if not line.startswith("help:")]
        self.assertEqual((done.returncode, len(lines), done.stdout), (2, 1, ""), done.stderr)
        self.assertFalse((self.folder / "reply.json").exists())

    def test_what_goes_wrong_is_one_line_with_a_remedy(self):
        path = self.request({"relight": {"picture": "a.png"}})
        for bad, code, says, remedy in (
                ("memory", 1, "copy: out of memory: CUDA out of memory. Tried to allocate 2 GiB", "--size"),
                ("package", 1, "copy: the Python package no_such_package is not installed", "pip install -r"),
                ("odd", 1, "copy: ZeroDivisionError: division by zero", "--trace"),
                ("input", 3, "copy: the mask is empty", "paint it")):
            done = self.run_with("--request", path, "--bad", bad)
            last = done.stderr.splitlines()[-2:]
            self.assertEqual((done.returncode, last[0]), (code, says), done.stderr)
            self.assertTrue(last[1].startswith("help: ") and remedy in last[1], last)
            self.assertFalse((self.folder / "reply.json").exists())

    def test_serving_goes_on_after_an_error(self):
        path = self.request({"relight": {"picture": "a.png"}})
        good = json.dumps({"request": str(path)})
        bad = json.dumps({"request": str(self.folder / "none.json")})
        done = self.run_with("--serve", given="\n".join([bad, "nonsense", "[]", good, ""]))
        said = [json.loads(line) for line in done.stdout.splitlines()]
        self.assertEqual((done.returncode, [entry.get("exit_code") for entry in said]), (0, [2, 2, 2, None]), done.stderr)
        self.assertEqual(said[3], {"reply": str(self.folder / "reply.json")})

    def test_views_and_noise_are_looked_at(self):
        from provider_kit import requests

        def task(**more):
            return {"prompt": "x", "views": [{"original": "a"}], **more}

        requests.instruct_edit(task(noise=0.5))
        for odd in (task(noise=1.5), task(noise="all"), task(noise=True), task(views=[]), task(views=[{}]), task(prompt="")):
            with self.assertRaises(ValueError):
                requests.instruct_edit(odd)
        both = requests.files("instruct-edit", task(views=[{"original": "a", "start": "b"}]))
        self.assertEqual(both, ["a", "b"])


if __name__ == "__main__":
    unittest.main()
