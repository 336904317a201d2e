"""Where the cases of the corpus are put."""

import json
import os

HERE = os.path.dirname(os.path.abspath(__file__))


def put(document, kind, name, data):
    path = os.path.join(HERE, document, "v1", kind, name)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "wb") as file:
        file.write(data.encode() if isinstance(data, str) else data)


def valid(document, name, data):
    put(document, "valid", name, data)


def invalid(document, name, expect, data):
    put(document, "invalid", name, data)
    put(document, "invalid", name + ".expect", expect + "\n")


def changed(make, change):
    document = make()
    change(document)
    return json.dumps(document, indent=1, ensure_ascii=False)
