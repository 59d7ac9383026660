"""Files that SDF and Drake's directives name."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import unquote


def resolved(uri: str, beside: Path) -> Path:
    """Returns the path of a file that the file `beside` names.

    A package is a folder above that file: one with its name, or one whose `package.xml` has the name. Any other name of a
    package stands for the nearest folder above that has the file.

    Raises:
        ValueError: If there is no such file.
    """
    uri = unquote(uri.strip())
    scheme, separator, rest = uri.partition("://")
    if not separator:
        candidates = [beside.parent / uri]
    elif scheme == "file":
        candidates = [Path(rest)]
    elif scheme in ("package", "model"):
        package, _, path = rest.partition("/")
        above = list(beside.resolve().parents)
        named = [folder for folder in above if folder.name == package or package_name(folder) == package]
        candidates = [*(folder / path for folder in named), *(folder / package / path for folder in above)]
        candidates += [folder / path for folder in above]
    else:
        raise ValueError(f"{beside}: {uri}: only paths, file://, package:// and model:// are read")
    for candidate in candidates:
        if candidate.is_dir():
            models = sorted(candidate.glob("*.sdf"))
            if models:
                return models[0]
        elif candidate.is_file():
            return candidate
    raise ValueError(f"{beside}: there is no file {uri}")


def package_name(folder: Path) -> str | None:
    manifest = folder / "package.xml"
    found = re.search(r"<name>\s*(.*?)\s*</name>", manifest.read_text(encoding="utf-8")) if manifest.is_file() else None
    return found[1] if found else None
