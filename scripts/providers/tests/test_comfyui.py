"""The provider for ComfyUI against a server of a few lines. Standard library only."""

import json
import struct
import subprocess
import sys
import tempfile
import threading
import unittest
import zlib
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent


def png(width, height, value):
    """A gray PNG."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = (b"\0" + bytes([value]) * width) * height
    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


class Server(BaseHTTPRequestHandler):
    """Keeps what is uploaded, and answers with the first picture."""

    def log_message(self, *_):
        """Says nothing."""

    def say(self, content, code=200):
        """An answer."""
        self.send_response(code)
        self.end_headers()
        self.wfile.write(content if isinstance(content, bytes) else json.dumps(content).encode())

    def do_POST(self):
        """Uploads and workflows."""
        body, state = self.rfile.read(int(self.headers["Content-Length"])), self.server.state
        if self.path == "/upload/image":
            name = body.split(b'filename="')[1].split(b'"')[0].decode()
            state["files"][name] = body.split(b"\r\n\r\n", 1)[1].rsplit(b"\r\n--", 1)[0]
            self.say({"name": name, "subfolder": "in"})
        elif state["bad"] == "refuses":
            self.say({"error": {"message": "no such node"}}, 400)
        else:
            state["asked"].append(json.loads(body)["prompt"])
            self.say({"prompt_id": "job 1"})

    def do_GET(self):
        """History and pictures."""
        state = self.server.state
        if self.path.startswith("/history/"):
            images = [] if state["bad"] == "empty" else [{"filename": "a.png", "subfolder": "", "type": "output"}]
            entry = {"outputs": {"9": {"images": images}}, "status": {"status_str": "success"}}
            if state["bad"] == "fails":
                entry["status"] = {"status_str": "error", "messages": [["execution_error", {"exception_message": "no model"}]]}
            state["polls"] += 1
            self.say({"job 1": entry} if state["polls"] % 2 == 0 and state["bad"] != "late" else {})
        elif state["bad"] == "size":
            self.say(png(8, 8, 1))
        elif state["bad"] == "html":
            self.say(b"<html>")
        else:
            self.say(next(iter(state["files"].values())))


class ComfyUi(unittest.TestCase):
    """Whole runs of the provider."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)
        self.server = HTTPServer(("127.0.0.1", 0), Server)
        self.server.state = {"files": {}, "asked": [], "polls": 0, "bad": ""}
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        self.addCleanup(self.server.server_close)
        self.addCleanup(self.server.shutdown)
        self.url = f"http://127.0.0.1:{self.server.server_port}"
        (self.folder / "p.png").write_bytes(png(6, 4, 9))
        self.workflow({"1": {"class_type": "LoadImage", "inputs": {"image": "%picture%"}},
                       "2": {"class_type": "Text", "inputs": {"text": "photo, %prompt%", "seed": "%seed%", "denoise": "%noise%"}}})

    def workflow(self, nodes):
        """Writes the workflow."""
        (self.folder / "w.json").write_text(json.dumps(nodes), encoding="utf-8")

    def run_with(self, task, *more, url=None):
        """Runs the provider on a request."""
        path = self.folder / "request.json"
        document = {"format": "motes/provider-request", "version": "1.0", "seed": 7, "task": task}
        path.write_text(json.dumps(document), encoding="utf-8")
        (kind,) = task
        line = [sys.executable, str(FOLDER / "comfyui.py"), "--workflow", str(self.folder / "w.json"), "--kind", kind]
        line += ["--url", url or self.url, "--timeout", "3", "--request", str(path), *more]
        return subprocess.run(line, capture_output=True, text=True, timeout=60, check=False)

    def test_a_workflow_is_filled_and_its_picture_comes_back(self):
        done = self.run_with({"relight": {"picture": "p.png", "prompt": "sun at %seed%"}})
        self.assertEqual(done.returncode, 0, done.stderr)
        (asked,) = self.server.state["asked"]
        (name,) = self.server.state["files"]
        self.assertEqual(asked["1"]["inputs"]["image"], f"in/{name}")
        self.assertEqual(asked["2"]["inputs"], {"text": "photo, sun at %seed%", "seed": 7, "denoise": 1.0})
        self.assertEqual((self.folder / "relit.png").read_bytes(), (self.folder / "p.png").read_bytes())

    def test_each_view_is_a_run(self):
        done = self.run_with({"instruct-edit": {"prompt": "snow", "noise": 0.5, "views": [{"original": "p.png"}, {"original": "p.png"}]}})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([asked["2"]["inputs"]["denoise"] for asked in self.server.state["asked"]], [0.5, 0.5])
        reply = json.loads((self.folder / "reply.json").read_text(encoding="utf-8"))
        self.assertEqual(reply["result"]["instruct-edit"]["pictures"], ["edited-0.png", "edited-1.png"])

    def test_what_goes_wrong_is_one_line_with_a_remedy(self):
        task = {"relight": {"picture": "p.png", "prompt": "sun"}}
        for bad, says in (("refuses", "answers 400"), ("fails", "the workflow failed: no model"), ("empty", "no node has pictures"),
                          ("late", "no picture within 3 s"), ("size", "makes 8x8 pixels of 6x4"), ("html", "answers no PNG")):
            self.server.state["bad"] = bad
            self.refused(self.run_with(task), 1, says)
        self.refused(self.run_with(task, url="http://127.0.0.1:9"), 1, "does not answer")

    def test_pictures_stay_on_this_computer_unless_told_otherwise(self):
        self.refused(self.run_with({"relight": {"picture": "p.png"}}, url="http://192.0.2.1:8188"), 2, "is not this computer")
        self.assertEqual(self.server.state["files"], {})

    def test_a_workflow_that_is_none_is_refused(self):
        for nodes, says in (({"nodes": []}, "no workflow in the format API"), ({"1": {"class_type": "X"}}, "no %picture%")):
            self.workflow(nodes)
            self.refused(self.run_with({"relight": {"picture": "p.png"}}), 3, says)
        self.workflow({"1": {"class_type": "LoadImage", "inputs": {"image": "%picture%", "mask": "%background%"}}})
        self.refused(self.run_with({"relight": {"picture": "p.png"}}), 3, "takes %background%")

    def refused(self, done, code, says):
        """A run that ended with an error."""
        lines = done.stderr.splitlines()
        self.assertEqual((done.returncode, len(lines)), (code, 2), done.stderr)
        self.assertIn(says, lines[0])
        self.assertTrue(lines[1].startswith("help: "))


if __name__ == "__main__":
    unittest.main()
