#!/usr/bin/env python3
"""Prints the components of the program as CycloneDX 1.5, from `cargo metadata`; `--check FILE` validates such a file."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def components() -> dict:
    """Returns the document: the program, what it is built from, and which part needs which."""
    command = ["cargo", "metadata", "--locked", "--format-version", "1"]
    metadata = json.loads(subprocess.check_output(command, cwd=ROOT))
    packages = {package["id"]: package for package in metadata["packages"]}
    checksums = {
        (package["name"], package["version"]): package["checksum"]
        for package in tomllib.loads((ROOT / "Cargo.lock").read_text())["package"]
        if "checksum" in package
    }
    needs = {
        node["id"]: sorted({
            other["pkg"]
            for other in node["deps"]
            if any(kind["kind"] != "dev" for kind in other["dep_kinds"])
        })
        for node in metadata["resolve"]["nodes"]
    }
    (program,) = (key for key in packages if packages[key]["name"] == "tandem" and packages[key]["source"] is None)
    used, waiting = {program}, [program]
    while waiting:
        new = [other for other in needs[waiting.pop()] if other not in used]
        used.update(new)
        waiting.extend(new)

    def reference(key: str) -> str:
        return f"pkg:cargo/{packages[key]['name']}@{packages[key]['version']}"

    def component(key: str, kind: str) -> dict:
        package = packages[key]
        found = {
            "type": kind,
            "bom-ref": reference(key),
            "name": package["name"],
            "version": package["version"],
            "purl": reference(key),
        }
        if package["license"]:
            # Older manifests write a slash in place of OR.
            found["licenses"] = [{"expression": package["license"].replace("/", " OR ")}]
        if checksum := checksums.get((package["name"], package["version"])):
            found["hashes"] = [{"alg": "SHA-256", "content": checksum}]
        return found

    others = sorted(used - {program}, key=reference)
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {"component": component(program, "application")},
        "components": [component(key, "library") for key in others],
        "dependencies": [
            {"ref": reference(key), "dependsOn": [reference(other) for other in needs[key]]}
            for key in [program, *others]
        ],
    }


def check(path: str) -> None:
    """Validates a document with the schema of its version."""
    from cyclonedx.schema import SchemaVersion
    from cyclonedx.validation.json import JsonStrictValidator

    text = Path(path).read_text()
    if error := JsonStrictValidator(SchemaVersion.V1_5).validate_str(text):
        raise SystemExit(f"{path}: {error}")
    print(f"{path}: {len(json.loads(text)['components'])} components")


if sys.argv[1:2] == ["--check"]:
    check(sys.argv[2])
else:
    print(json.dumps(components(), indent=2))
