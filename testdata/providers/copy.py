#!/usr/bin/env python3
"""A provider of the kinds relight, instruct-edit and novel-view that answers with the pictures it gets: where a real one begins.

docs/formats/provider.md describes the protocol. Only the standard library of Python is needed.
"""

import argparse
import json
import shutil
import sys
from pathlib import Path

DESCRIPTION = {
    "format": "motes/provider",
    "version": "1.1",
    "name": "copy",
    "program_version": "1",
    "kinds": ["relight", "instruct-edit", "novel-view"],
    "models": [{"id": "none", "license": "CC0-1.0"}],
    "deterministic": True,
}


class BadRequest(Exception):
    """What is wrong with a request, in one line."""


def answer(path):
    """Answers a request; the path of the reply."""
    try:
        request = json.loads(path.read_text(encoding="utf-8"))
        ((kind, task),) = request["task"].items()
        pictures = {
            "relight": lambda: [task["picture"]],
            "instruct-edit": lambda: [view["original"] for view in task["views"]],
            "novel-view": lambda: [task["rendering"]],
        }[kind]()
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise BadRequest(f"not a request that is answered here: {error!r}: {path}") from error
    names = []
    for k, picture in enumerate(pictures):
        names.append(f"answer-{k}{Path(picture).suffix}")
        shutil.copyfile(path.parent / picture, path.parent / names[-1])
    result = {"pictures": names} if kind == "instruct-edit" else {"picture": names[0]}
    reply = {"format": "motes/provider-reply", "version": "1.1", "result": {kind: result}}
    written = path.parent / "reply.json"
    written.write_text(json.dumps(reply), encoding="utf-8")
    return written


def serve():
    """A line per request until the input ends."""
    for line in sys.stdin:
        try:
            said = {"reply": str(answer(Path(json.loads(line)["request"])))}
        except BadRequest as error:
            said = {"error": str(error), "exit_code": 2}
        print(json.dumps(said), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--describe", action="store_true")
    what.add_argument("--request", type=Path)
    what.add_argument("--serve", action="store_true")
    arguments = parser.parse_args()
    if arguments.describe:
        print(json.dumps(DESCRIPTION))
    elif arguments.serve:
        serve()
    else:
        try:
            answer(arguments.request)
        except BadRequest as error:
            sys.stderr.write(f"copy: {error}\n")
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
