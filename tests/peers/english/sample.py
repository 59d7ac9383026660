"""Draws comments of the Rust sources and sentences of the documents for somebody to read.

    python3 tests/peers/english/sample.py --seed 7

prints 100 comments and 60 sentences, each with its place. The same seed draws the same sample of the same files.
"""

from __future__ import annotations

import argparse
import random
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

COMMENT = re.compile(r"^\s*//[/!]?\s?(.*)$")
FENCE = re.compile(r"^\s*(```|~~~)")
NO_PROSE = re.compile(r"^\s*([|#<>]|!\[|\$|---|- \[.*\]\(.*\)$)")
END = re.compile(r"(?<=[.!?])\s+(?=[A-Z`\[*])")
MIN_WORDS = 4


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, required=True, help="seed of the draw")
    parser.add_argument("--comments", type=int, default=100, help="number of comments (100)")
    parser.add_argument("--sentences", type=int, default=60, help="number of sentences (60)")
    asked = parser.parse_args()
    draw = random.Random(asked.seed)
    comments = [one for file in tracked("*.rs") for one in comments_of(file)]
    sentences = [one for file in tracked("README.md", "docs/src/*.md") for one in sentences_of(file)]
    for title, count, texts in (("comments", asked.comments, comments), ("sentences", asked.sentences, sentences)):
        print(f"# {count} of {len(texts)} {title}\n")
        for place, text in sorted(draw.sample(texts, count)):
            print(f"{place}\n    {text}\n")


def tracked(*patterns: str) -> list[Path]:
    """Returns the repository's files that match one of these patterns, in order."""
    listed = subprocess.run(["git", "ls-files", "-z", *patterns], check=True, capture_output=True, text=True)
    return [Path(name) for name in sorted(listed.stdout.split("\0")) if name]


def comments_of(file: Path) -> Iterator[tuple[str, str]]:
    """Yields each run of comment lines as one text, with the place of its first line."""
    lines: list[str] = []
    for number, line in enumerate([*file.read_text(encoding="utf-8").splitlines(), ""], start=1):
        if found := COMMENT.match(line):
            lines.append(found.group(1))
        elif lines:
            text = " / ".join(part for part in lines if part)
            if len(text.split()) >= MIN_WORDS:
                yield f"{file}:{number - len(lines)}", text
            lines = []


def sentences_of(file: Path) -> Iterator[tuple[str, str]]:
    """Yields the sentences of a document's paragraphs and items, without code, tables, headings and images."""
    paragraph: list[str] = []
    first, fenced = 1, False
    for number, line in enumerate([*file.read_text(encoding="utf-8").splitlines(), ""], start=1):
        is_fence = bool(FENCE.match(line))
        if is_fence or fenced or not line.strip() or NO_PROSE.match(line) or line.lstrip().startswith(("* ", "- ")):
            yield from ((f"{file}:{first}", one) for one in END.split(" ".join(paragraph)) if len(one.split()) >= MIN_WORDS)
            paragraph = []
        fenced ^= is_fence
        if not (is_fence or fenced or NO_PROSE.match(line)) and line.strip():
            first = first if paragraph else number
            paragraph.append(line.strip().removeprefix("* ").removeprefix("- "))


if __name__ == "__main__":
    main()
