#!/usr/bin/env python3
"""A provider of the kind chat that forwards to an OpenAI-compatible endpoint: llama-server, Ollama, vLLM, a hosted one.

    openai_chat.py --url http://127.0.0.1:8080/v1 --model NAME

The key of a hosted endpoint is read from the environment variable OPENAI_API_KEY (--key-variable). Standard library only.
"""

import argparse
import base64
import json
import os
import sys
import urllib.error
import urllib.request
from pathlib import Path

VERSION = "1"


class BadRequest(Exception):
    """The request cannot be read: exit code 2."""


class Failed(Exception):
    """The endpoint does not answer: exit code 1. A message and a remedy."""

    def __init__(self, cause, remedy):
        super().__init__(cause)
        self.remedy = remedy


def description(options):
    """What --describe prints."""
    return {
        "format": "motes/provider",
        "version": "1.0",
        "name": "openai-chat",
        "program_version": VERSION,
        "kinds": ["chat"],
        "models": [{"id": options.model, "license": "as the endpoint says"}],
        "deterministic": False,
    }


def content_of(message, folder, with_pictures):
    """Text and pictures of a message, as the endpoint takes them."""
    pictures = message.get("pictures", []) if with_pictures else []
    if not pictures:
        return message["text"]
    parts = [{"type": "text", "text": message["text"]}]
    for name in pictures:
        encoded = base64.b64encode((folder / name).read_bytes()).decode("ascii")
        parts.append({"type": "image_url", "image_url": {"url": f"data:image/png;base64,{encoded}"}})
    return parts


def body_of(request, folder, options):
    """The body for /chat/completions."""
    task = request["task"]["chat"]
    messages = [
        {"role": message["role"], "content": content_of(message, folder, not options.no_pictures)}
        for message in task["messages"]
    ]
    body = {"model": options.model, "messages": messages, "temperature": 0, "seed": request.get("seed", 0)}
    if options.response_format == "schema":
        named = {"name": "answer", "schema": task["schema"]}
        body["response_format"] = {"type": "json_schema", "json_schema": named}
    elif options.response_format == "json":
        body["response_format"] = {"type": "json_object"}
    return body


def completion(body, options):
    """What the endpoint answers, as text."""
    headers = {"Content-Type": "application/json"}
    key = os.environ.get(options.key_variable)
    if key:
        headers["Authorization"] = f"Bearer {key}"
    url = options.url.rstrip("/") + "/chat/completions"
    data = json.dumps(body).encode("utf-8")
    try:
        sent = urllib.request.Request(url, data=data, headers=headers, method="POST")
        with urllib.request.urlopen(sent, timeout=options.timeout) as answer:
            said = json.load(answer)
        return said["choices"][0]["message"]["content"]
    except urllib.error.HTTPError as error:
        said = " ".join(error.read(500).decode("utf-8", "replace").split())
        remedies = {
            401: f"put the key into the environment variable {options.key_variable}",
            404: "check --url, which ends in /v1 for most servers, and --model",
            400: "try --response-format json, or --no-pictures for a model of text alone",
        }
        remedy = remedies.get(error.code, "look into the log of the server")
        raise Failed(f"{url} answers {error.code} {error.reason}: {said}", remedy) from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "reason", error)
        raise Failed(f"{url} does not answer: {reason}", "start the server, or check --url and --timeout") from error
    except (KeyError, IndexError, TypeError) as error:
        raise Failed(f"{url} answers without choices", "check --url: is it an OpenAI-compatible endpoint?") from error


def json_of(text):
    """The JSON of an answer, which some models wrap into a fenced block; the text where there is none."""
    stripped = text.strip()
    if stripped.startswith("```"):
        stripped = stripped.split("\n", 1)[-1].rsplit("```", 1)[0]
    try:
        parsed = json.loads(stripped)
    except ValueError:
        return text
    return text if parsed is None else parsed


def answer(path, options):
    """Answers a request; the path of the reply."""
    try:
        folder = path.parent
        body = body_of(json.loads(path.read_text(encoding="utf-8")), folder, options)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise BadRequest(f"not a request of the kind chat: {error!r}: {path}") from error
    text = completion(body, options)
    if not isinstance(text, str):
        raise Failed("the model answered nothing", "try another --model or --response-format")
    reply = {"format": "motes/provider-reply", "version": "1.0", "result": {"chat": {"content": json_of(text)}}}
    written = folder / "reply.json"
    written.write_text(json.dumps(reply), encoding="utf-8")
    return written


def options_of(arguments):
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--describe", action="store_true", help="print what this provider is")
    what.add_argument("--request", type=Path, help="answer a request.json")
    what.add_argument("--serve", action="store_true", help="answer requests named on standard input")
    parser.add_argument("--url", required=True, help="base of the endpoint, as in http://127.0.0.1:8080/v1")
    parser.add_argument("--model", required=True, help="model, as the endpoint calls it")
    parser.add_argument("--key-variable", default="OPENAI_API_KEY", help="environment variable with the key")
    parser.add_argument("--timeout", type=float, default=600.0, help="seconds to wait for an answer")
    parser.add_argument(
        "--response-format",
        choices=["schema", "json", "none"],
        default="schema",
        help="how the answer is held to JSON: by the schema, as any JSON, by words alone",
    )
    parser.add_argument("--no-pictures", action="store_true", help="send text alone")
    return parser.parse_args(arguments)


def serve(options):
    """Answers the requests that standard input names."""
    for line in sys.stdin:
        try:
            said = {"reply": str(answer(Path(json.loads(line)["request"]), options))}
        except Failed as error:
            said = {"error": str(error), "help": error.remedy, "exit_code": 1}
        except (BadRequest, ValueError, KeyError, TypeError) as error:
            said = {"error": str(error), "exit_code": 2}
        print(json.dumps(said), flush=True)


def main():
    """Runs the provider; the exit code."""
    options = options_of(None)
    if options.describe:
        print(json.dumps(description(options)))
    elif options.serve:
        serve(options)
    else:
        try:
            answer(options.request, options)
        except BadRequest as error:
            sys.stderr.write(f"openai-chat: {error}\n")
            return 2
        except Failed as error:
            sys.stderr.write(f"openai-chat: {error}\nhelp: {error.remedy}\n")
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
