#!/usr/bin/env python3
"""A provider of the kinds relight and instruct-edit that has a ComfyUI server run a workflow of yours. Standard library only.

    comfyui.py --workflow workflow-api.json --kind relight

The workflow is what ComfyUI exports as "API". Texts in it stand for what the request holds:

    %prompt% %picture% %foreground% %background% %start% %seed% %noise% %width% %height%

docs/stages/providers-python.md is the manual.
"""

import hashlib
import json
import re
import sys
import time
import urllib.error
import urllib.parse
import urllib.request
import uuid
from pathlib import Path

from provider_kit import png
from provider_kit.protocol import BadInput, BadRequest, Failed, Provider, main

LOOPBACK = ("127.0.0.1", "localhost", "::1")
POLL_S = 0.25
MOST_BYTES = 256 << 20


class ComfyUi(Provider):
    """One run of the workflow per picture."""

    name = "comfyui"
    kinds = ("relight", "instruct-edit")
    purpose = "Pictures by a workflow of yours on a ComfyUI server."

    def __init__(self):
        super().__init__()
        self.workflow = None

    def add_options(self, parser):
        add = parser.add_argument
        add("--workflow", type=Path, required=True, metavar="FILE", help="workflow in the format API of ComfyUI")
        add("--kind", choices=["relight", "instruct-edit"], required=True, help="what the workflow does")
        add("--url", default="http://127.0.0.1:8188", help="base of the server (http://127.0.0.1:8188)")
        add("--remote", action="store_true", help="let pictures go to a server that is not this computer")
        add("--output-node", metavar="ID", help="node whose picture is the answer; the only one with pictures when left out")
        add("--license", default="as the models of the workflow say", metavar="TEXT", help="license of the weights, for run records")
        add("--timeout", type=float, default=600.0, metavar="SECONDS", help="longest time for a picture (600)")

    def loaded(self):
        """The workflow, and what it takes."""
        if self.workflow is None:
            o = self.options
            address = urllib.parse.urlsplit(o.url)
            if address.scheme not in ("http", "https") or not address.hostname:
                raise BadRequest(f"--url {o.url} is no address", "--url http://127.0.0.1:8188")
            if address.hostname not in LOOPBACK and not o.remote:
                raise BadRequest(f"{address.hostname} is not this computer", "--remote lets pictures go there")
            try:
                document = json.loads(o.workflow.read_text(encoding="utf-8"))
            except (OSError, ValueError) as error:
                raise BadInput(f"the workflow cannot be read ({error}): {o.workflow}", "export it from ComfyUI as API") from error
            nodes = document.values() if isinstance(document, dict) else []
            if not nodes or not all(isinstance(node, dict) and "class_type" in node for node in nodes):
                raise BadInput(f"no workflow in the format API: {o.workflow}", "ComfyUI: Workflow, Export (API)")
            if "%picture%" not in json.dumps(document):
                raise BadInput(f"no %picture% in the workflow: {o.workflow}", "write %picture% as the image of a node LoadImage")
            self.workflow = document
        return self.workflow

    def described(self):
        text = json.dumps(self.loaded(), sort_keys=True)
        entry = {"id": self.options.workflow.name, "sha256": hashlib.sha256(text.encode()).hexdigest(), "license": self.options.license}
        return {"kinds": [self.options.kind], "models": [entry], "deterministic": False}

    def prepare(self):
        self.loaded()

    def answer(self, request):
        if request.kind != self.options.kind:
            raise BadRequest(f"the workflow does {self.options.kind}, not {request.kind}")
        if request.kind == "relight":
            files = {key: request.task.get(key) for key in ("picture", "foreground", "background")}
            return {"picture": self.made(request, files, request.task.get("prompt") or "", "relit.png")}
        names = []
        for i, view in enumerate(request.task["views"]):
            files = {"picture": view["original"], "start": view.get("start") or view["original"]}
            names.append(self.made(request, files, request.task["prompt"], f"edited-{i}.png"))
        return {"pictures": names}

    def made(self, request, files, prompt, name):
        """Runs the workflow for one picture; the name of the answer."""
        picture = request.file(files["picture"])
        size = png.size(picture)
        values = {"%prompt%": prompt, "%seed%": request.seed % (1 << 32), "%noise%": request.task.get("noise", 1.0)}
        values.update({"%width%": size[0], "%height%": size[1]})
        asked = json.dumps(self.loaded())
        for key, file in files.items():
            if f"%{key}%" not in asked:
                if file is not None and key in ("foreground", "background"):
                    request.warn(f"the workflow has no %{key}%, which the request brings")
                continue
            if file is None:
                raise BadInput(f"the workflow takes %{key}%, which the request does not bring", "use a workflow without it")
            values[f"%{key}%"] = self.uploaded(request.file(file))
        content = self.run(filled(self.loaded(), values))
        request.output(name).write_bytes(content)
        try:
            found = png.size(request.output(name))
        except BadInput as error:
            raise Failed(f"the server answers no PNG: {error}", "end the workflow with a node SaveImage") from error
        if found != size:
            a, b = "x".join(map(str, found)), "x".join(map(str, size))
            raise Failed(f"the workflow makes {a} pixels of {b}", "end it with a node ImageScale to %width% and %height%")
        return name

    def call(self, path, data=None, headers=None):
        """What the server answers, as bytes."""
        url = self.options.url.rstrip("/") + path
        try:
            sent = urllib.request.Request(url, data=data, headers=headers or {})
            with urllib.request.urlopen(sent, timeout=self.options.timeout) as answer:
                content = answer.read(MOST_BYTES + 1)
        except urllib.error.HTTPError as error:
            said = " ".join(error.read(400).decode("utf-8", "replace").split())
            raise Failed(f"{url} answers {error.code}: {said}", "look into the log of ComfyUI; open the workflow there") from error
        except (OSError, ValueError) as error:
            raise Failed(f"{url} does not answer: {getattr(error, 'reason', error)}", "start ComfyUI, or check --url and --timeout") from error
        if len(content) > MOST_BYTES:
            raise Failed(f"{url} answers more than {MOST_BYTES} bytes", "make smaller pictures")
        return content

    def answered(self, path, data=None, headers=None):
        """What the server answers, as JSON."""
        try:
            document = json.loads(self.call(path, data, headers))
        except ValueError as error:
            raise Failed(f"{self.options.url} answers something else than ComfyUI", "check --url") from error
        if not isinstance(document, dict):
            raise Failed(f"{self.options.url} answers something else than ComfyUI", "check --url")
        return document

    def uploaded(self, path):
        """Uploads a picture; what it is called there."""
        mark = uuid.uuid4().hex
        name = f"motes-{mark}{path.suffix}"
        head = f'--{mark}\r\nContent-Disposition: form-data; name="image"; filename="{name}"\r\nContent-Type: image/png\r\n\r\n'
        body = head.encode() + path.read_bytes() + f"\r\n--{mark}--\r\n".encode()
        said = self.answered("/upload/image", body, {"Content-Type": f"multipart/form-data; boundary={mark}"})
        if not isinstance(said.get("name"), str):
            raise Failed(f"{self.options.url} does not say where the picture went", "check the version of ComfyUI")
        return "/".join(part for part in (said.get("subfolder"), said["name"]) if part)

    def run(self, workflow):
        """Runs a filled workflow; the bytes of its picture."""
        body = json.dumps({"prompt": workflow, "client_id": uuid.uuid4().hex}).encode()
        said = self.answered("/prompt", body, {"Content-Type": "application/json"})
        job = said.get("prompt_id")
        if not isinstance(job, str):
            raise Failed(f"ComfyUI refuses the workflow: {json.dumps(said.get('node_errors') or said)[:200]}", "open the workflow in ComfyUI")
        until = time.monotonic() + self.options.timeout
        while True:
            entry = self.answered(f"/history/{urllib.parse.quote(job)}").get(job)
            if entry:
                break
            if time.monotonic() > until:
                raise Failed(f"no picture within {self.options.timeout:g} s", "--timeout SECONDS, and --provider-time-limit of the stage")
            time.sleep(POLL_S)
        status = entry.get("status", {})
        if status.get("status_str") == "error":
            said = [m[1].get("exception_message", "") for m in status.get("messages", []) if m[0] == "execution_error"]
            raise Failed(f"the workflow failed: {' '.join(said)[:200] or 'no more is known'}", "open the workflow in ComfyUI")
        return self.fetched(entry.get("outputs", {}))

    def fetched(self, outputs):
        """The bytes of the picture among the outputs of a run."""
        wanted = self.options.output_node
        found = {node: made["images"] for node, made in outputs.items() if made.get("images") and wanted in (None, node)}
        if len(found) != 1:
            which = "no node has pictures" if not found else f"the nodes {', '.join(sorted(found))} have pictures"
            raise Failed(f"{which}: which one is the answer?", "end the workflow with one SaveImage, or name it with --output-node")
        (images,) = found.values()
        keys = {key: images[-1].get(key, "") for key in ("filename", "subfolder", "type")}
        return self.call("/view?" + urllib.parse.urlencode(keys))


def filled(value, values):
    """A workflow with values for the texts that stand for them."""
    if isinstance(value, dict):
        return {key: filled(entry, values) for key, entry in value.items()}
    if isinstance(value, list):
        return [filled(entry, values) for entry in value]
    if not isinstance(value, str):
        return value
    if value in values:
        return values[value]
    return re.sub(r"%[a-z]+%", lambda found: str(values.get(found[0], found[0])), value)


if __name__ == "__main__":
    sys.exit(main(ComfyUi()))
