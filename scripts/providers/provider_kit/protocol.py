"""The protocol provider-v1 for providers in Python (docs/formats/provider.md). Standard library only.

A provider is a subclass of `Provider` whose `answer` turns a checked `Request` into a result; `main` does the rest: --describe,
--request, --serve, exit codes, and one line for whatever goes wrong.
"""

import argparse
import json
import os
import sys
import traceback
from pathlib import Path

from . import requests

DESCRIPTION_VERSION = "1.1"
REPLY_VERSION = "1.1"


class ProviderError(Exception):
    """A cause in one line, and the remedy. `exit_code` is that of the protocol."""

    exit_code = 1

    def __init__(self, cause, remedy=None):
        super().__init__(" ".join(str(cause).split()))
        self.remedy = " ".join(remedy.split()) if remedy else None


class Failed(ProviderError):
    """The work went wrong: memory, a package that is not installed, a server that does not answer."""


class BadRequest(ProviderError):
    """The request is none, or asks for what the provider does not do."""

    exit_code = 2


class BadInput(ProviderError):
    """Weights or pictures that cannot be used."""

    exit_code = 3


class Request:
    """A request whose form was checked, and the folder of its files."""

    def __init__(self, path):
        self.path = Path(path)
        self.folder = self.path.parent
        self.warnings = []
        try:
            document = json.loads(self.path.read_text(encoding="utf-8"))
            self.kind, self.task = requests.checked(document)
            self.seed = document.get("seed", 0)
            for name in requests.files(self.kind, self.task):
                self.file(name)
        except OSError as error:
            raise BadRequest(f"the request cannot be read: {error.strerror}: {path}") from error
        except (ValueError, RecursionError) as error:
            raise BadRequest(f"not a request: {error}: {path}", "docs/formats/provider.md says what one is") from error

    def file(self, name):
        """The path of a file that the request names, which lies below its folder."""
        path = self.folder / name
        below = Path(os.path.realpath(self.folder))
        if Path(name).is_absolute() or below not in Path(os.path.realpath(path)).parents:
            raise BadRequest(f"the request names a file outside of its folder: {name}")
        if not path.is_file():
            raise BadRequest(f"the request names a file that is not there: {name}")
        return path

    def output(self, name):
        """The path of a file of the answer."""
        return self.folder / name

    def warn(self, sentence):
        """A sentence for the user, said once."""
        if sentence not in self.warnings:
            self.warnings.append(sentence)


class Provider:
    """A provider. Subclasses set the names and implement what raises here."""

    name = "nameless"
    version = "1"
    kinds = ()
    """Kinds of requests that are answered."""
    quantities = None
    """Of `predict`: the maps that it makes; None for the other kinds."""
    purpose = ""
    """A line for --help."""

    def __init__(self):
        self.options = None

    def add_options(self, parser):
        """Adds flags to those of the protocol."""

    def described(self):
        """Further keys of the description, such as `models`. Raises BadInput where weights are missing."""
        return {}

    def prepare(self):
        """Called once before the first answer, after its request was checked: loads what is needed."""

    def answer(self, request):
        """The result of a request, a dictionary without the key of its kind."""
        raise NotImplementedError

    def description(self):
        """What --describe prints."""
        document = {
            "format": "motes/provider",
            "version": DESCRIPTION_VERSION,
            "name": self.name,
            "program_version": self.version,
            "kinds": list(self.kinds),
        }
        if self.quantities is not None:
            document["quantities"] = list(self.quantities)
        document.update(self.described())
        return document


def answered(provider, path):
    """Answers the request at `path`; the path of the reply."""
    request = Request(path)
    if request.kind not in provider.kinds:
        raise BadRequest(f"{provider.name} answers {', '.join(provider.kinds)}, not {request.kind}")
    wanted = request.task.get("quantities", []) if request.kind == "predict" else []
    odd = [quantity for quantity in wanted if quantity not in (provider.quantities or [])]
    if odd:
        raise BadRequest(f"{provider.name} predicts {', '.join(provider.quantities or [])}, not {', '.join(odd)}")
    provider.prepare()
    result = provider.answer(request)
    reply = {
        "format": "motes/provider-reply",
        "version": REPLY_VERSION,
        "result": {request.kind: result},
        "warnings": request.warnings,
    }
    written = request.folder / "reply.json"
    draft = request.folder / "reply.json.draft"
    draft.write_text(json.dumps(reply), encoding="utf-8")
    os.replace(draft, written)
    return written


def understood(error, options):
    """Any exception as a ProviderError, so that the user reads one line and not a page."""
    if isinstance(error, ProviderError):
        return error
    if options is not None and options.trace:
        traceback.print_exception(type(error), error, error.__traceback__)
    text = str(error).strip().split("\n")[0] or "no more is known"
    if isinstance(error, MemoryError) or "out of memory" in text.lower():
        return Failed(f"out of memory: {text}", "ask for smaller pictures (--size), or use another --device")
    if isinstance(error, ModuleNotFoundError):
        return Failed(
            f"the Python package {error.name} is not installed",
            "pip install -r scripts/providers/requirements-providers.txt, as docs/stages/providers-python.md says",
        )
    return Failed(f"{type(error).__name__}: {text}", "--trace says where")


def serve(provider, out):
    """Answers the requests that standard input names, until it ends."""
    for line in sys.stdin:
        if not line.strip():
            continue
        try:
            try:
                path = json.loads(line)["request"]
                path = Path(path)
            except (ValueError, KeyError, TypeError) as error:
                raise BadRequest(f"not a line of the protocol: {line.strip()[:80]}") from error
            said = {"reply": str(answered(provider, path))}
        except Exception as error:  # every failure is a line, and the next request is read
            error = understood(error, provider.options)
            said = {"error": f"{provider.name}: {error}", "exit_code": error.exit_code}
            if error.remedy:
                said["help"] = error.remedy
        out.write(json.dumps(said) + "\n")
        out.flush()


def only_the_protocol_on_stdout():
    """A stream for the protocol; what libraries print to standard output goes to standard error from here on."""
    sys.stdout.flush()
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    return out


def parser_of(provider):
    """The flags of the protocol and those of the provider."""
    parser = argparse.ArgumentParser(prog=f"motes-provider-{provider.name}", description=provider.purpose)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--describe", action="store_true", help="print what this provider is")
    what.add_argument("--request", type=Path, metavar="FILE", help="answer a request.json")
    what.add_argument("--serve", action="store_true", help="answer requests named on standard input")
    parser.add_argument("--trace", action="store_true", help="say where an unexpected error came from")
    provider.add_options(parser)
    return parser


def main(provider, arguments=None):
    """Runs a provider; the exit code."""
    # No hub is asked, whatever a library would like to fetch.
    for variable in ("HF_HUB_OFFLINE", "TRANSFORMERS_OFFLINE", "HF_HUB_DISABLE_TELEMETRY"):
        os.environ[variable] = "1"
    for variable in ("DIFFUSERS_VERBOSITY", "TRANSFORMERS_VERBOSITY"):
        os.environ.setdefault(variable, "error")
    os.environ.setdefault("TOKENIZERS_PARALLELISM", "false")
    provider.options = parser_of(provider).parse_args(arguments)
    out = only_the_protocol_on_stdout()
    try:
        if provider.options.describe:
            out.write(json.dumps(provider.description()) + "\n")
            out.flush()
        elif provider.options.serve:
            serve(provider, out)
            out.flush()
            sys.stderr.flush()
            # Every file is written. Taking large libraries apart would take seconds that the caller does not wait.
            os._exit(0)
        else:
            answered(provider, provider.options.request)
    except KeyboardInterrupt:
        return 130
    except Exception as error:  # one line instead of a traceback
        error = understood(error, provider.options)
        sys.stderr.write(f"{provider.name}: {error}\n")
        if error.remedy:
            sys.stderr.write(f"help: {error.remedy}\n")
        return error.exit_code
    return 0
