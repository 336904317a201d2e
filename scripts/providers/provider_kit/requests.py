"""The form of requests: what each kind has to hold. Errors are ValueError with a sentence."""

QUANTITIES = ("normal", "depth", "base-color", "roughness", "metallic")


def needs(condition, sentence):
    """Raises the sentence unless the condition holds."""
    if not condition:
        raise ValueError(sentence)


def text(task, key, required=True):
    """A string of a task."""
    value = task.get(key)
    needs(isinstance(value, str) or (value is None and not required), f"{key} is not a text")
    needs(not required or value != "", f"{key} is empty")


def strings(task, key):
    """A list of strings that is not empty."""
    value = task.get(key)
    fits = isinstance(value, list) and value and all(isinstance(item, str) and item for item in value)
    needs(fits, f"{key} is not a list of texts")


def relight(task):
    """A picture under another light."""
    text(task, "picture")
    for key in ("foreground", "background", "prompt"):
        text(task, key, required=False)


def instruct_edit(task):
    """Views edited as a text says."""
    text(task, "prompt")
    noise = task.get("noise", 1.0)
    fits = isinstance(noise, (int, float)) and not isinstance(noise, bool) and 0 <= noise <= 1
    needs(fits, "noise is not a number from 0 to 1")
    views = task.get("views")
    needs(isinstance(views, list) and views, "there are no views")
    for view in views:
        needs(isinstance(view, dict), "a view is not an object")
        text(view, "original")
        text(view, "start", required=False)


def predict(task):
    """Maps of pictures."""
    strings(task, "pictures")
    strings(task, "quantities")
    odd = [name for name in task["quantities"] if name not in QUANTITIES]
    needs(not odd, f"there is no quantity {odd[0] if odd else ''}")


def environment(task):
    """The light around a picture."""
    text(task, "picture")


def camera(value):
    """A pinhole camera with its pose."""
    needs(isinstance(value, dict), "a camera is not an object")
    for key, count in (("focal_px", 2), ("center_px", 2), ("rotation_wxyz", 4), ("translation", 3)):
        numbers = value.get(key)
        fits = isinstance(numbers, list) and len(numbers) == count
        fits = fits and all(isinstance(n, (int, float)) and not isinstance(n, bool) for n in numbers)
        needs(fits, f"{key} of a camera has not {count} numbers")


def novel_view(task):
    """A picture from where no photo was taken."""
    text(task, "rendering")
    camera(task.get("camera"))
    references = task.get("references")
    needs(isinstance(references, list) and references, "there are no references")
    for reference in references:
        needs(isinstance(reference, dict), "a reference is not an object")
        text(reference, "picture")
        camera(reference.get("camera"))


KINDS = {"relight": relight, "instruct-edit": instruct_edit, "predict": predict, "environment": environment, "novel-view": novel_view}


def checked(document):
    """Kind and task of a request document."""
    needs(isinstance(document, dict), "the document is not an object")
    needs(document.get("format") == "motes/provider-request", "format is not motes/provider-request")
    version = document.get("version")
    needs(isinstance(version, str) and version.split(".")[0] == "1", f"version {version!r} is not 1.x")
    seed = document.get("seed", 0)
    needs(isinstance(seed, int) and not isinstance(seed, bool) and 0 <= seed < 1 << 64, "seed is not a count")
    task = document.get("task")
    needs(isinstance(task, dict) and len(task) == 1, "task has not one key")
    ((kind, asked),) = task.items()
    needs(kind in KINDS, f"there is no answer to {kind!r} here")
    needs(isinstance(asked, dict), f"{kind} is not an object")
    KINDS[kind](asked)
    return kind, asked


def files(kind, task):
    """The files that a task names."""
    if kind == "relight":
        names = [task["picture"], task.get("foreground"), task.get("background")]
    elif kind == "instruct-edit":
        names = [view.get(key) for view in task["views"] for key in ("original", "start")]
    elif kind == "novel-view":
        names = [task["rendering"], *(reference["picture"] for reference in task["references"])]
    elif kind == "predict":
        names = task["pictures"]
    else:
        names = [task["picture"]]
    return [name for name in names if name is not None]
