#!/usr/bin/env python3
"""A provider of the kind chat that answers from a file: a list with its first answer, its second, and so on. For tests.

    scripted_chat.py --answers answers.json

It refuses requests that lack what a real one needs: the schema of the plan and the scene card.
"""

import argparse
import json
import sys
from pathlib import Path

DESCRIPTION = {
    "format": "motes/provider",
    "version": "1.0",
    "name": "scripted-chat",
    "program_version": "1",
    "kinds": ["chat"],
    "models": [{"id": "none", "license": "CC0-1.0"}],
    "deterministic": True,
}


class BadRequest(Exception):
    """What is wrong with a request, in one line."""


def answer(path, answers):
    """Answers a request; the path of the reply."""
    try:
        task = json.loads(path.read_text(encoding="utf-8"))["task"]["chat"]
        said = sum(message["role"] == "assistant" for message in task["messages"])
        if answers is not None:
            if "ops" not in task["schema"]["properties"]:
                raise BadRequest("the schema is not that of plans")
            if "motes/scene-card" not in task["messages"][1]["text"]:
                raise BadRequest("there is no scene card")
            if said and "/ops/" not in task["messages"][-1]["text"]:
                raise BadRequest("there is no pointer to the mistake")
            content = answers[min(said, len(answers) - 1)]
        else:
            content = {"said": said}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        raise BadRequest(f"not a request that is answered here: {error!r}: {path}") from error
    reply = {"format": "motes/provider-reply", "version": "1.0", "result": {"chat": {"content": content}}}
    written = path.parent / "reply.json"
    written.write_text(json.dumps(reply), encoding="utf-8")
    return written


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--describe", action="store_true")
    what.add_argument("--request", type=Path)
    what.add_argument("--serve", action="store_true")
    parser.add_argument("--answers", type=Path)
    arguments = parser.parse_args()
    answers = json.loads(arguments.answers.read_text(encoding="utf-8")) if arguments.answers else None
    if arguments.describe:
        print(json.dumps(DESCRIPTION))
    elif arguments.serve:
        for line in sys.stdin:
            try:
                said = {"reply": str(answer(Path(json.loads(line)["request"]), answers))}
            except BadRequest as error:
                said = {"error": str(error), "exit_code": 2}
            print(json.dumps(said), flush=True)
    else:
        try:
            answer(arguments.request, answers)
        except BadRequest as error:
            sys.stderr.write(f"scripted-chat: {error}\n")
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
