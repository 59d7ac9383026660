"""Reading of replies: JSON's values as instances of the contract's classes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import cache
from types import UnionType
from typing import Any, TypeVar, Union, cast, get_args, get_origin, get_type_hints

ReplyT = TypeVar("ReplyT", bound="Reply")
Reader = Callable[[Any], Any]


class Reply:
    """A part of a reply. Fields that were left out have their defaults, and unknown ones are ignored."""

    @classmethod
    def of(cls: type[ReplyT], value: Mapping[str, Any]) -> ReplyT:
        """Reads a JSON object.

        Raises:
            TypeError: A required field is missing.
        """
        return cls(**{name: read(value[wire]) for wire, name, read in _readers(cls) if wire in value})


@cache
def _readers(of: type[Reply]) -> list[tuple[str, str, Reader]]:
    """JSON's name of each field, Python's, and its reader."""
    hints = get_type_hints(of)
    named = [field.name for field in fields(cast(Any, of))]
    # Names that are words of Python end in an underscore.
    return [(name.rstrip("_"), name, _reader(hints[name]) or _unchanged) for name in named]


def _unchanged(value: Any) -> Any:
    return value


def _reader(kind: Any) -> Reader | None:
    """The reader of a type; None if JSON has its values."""
    origin, of = get_origin(kind), get_args(kind)
    if origin is tuple:
        item = _reader(of[0])
        return tuple if item is None else lambda value: tuple(item(one) for one in value)
    if origin in (Union, UnionType):
        (read,) = {_reader(one) for one in of if one is not type(None)}
        return None if read is None else lambda value: None if value is None else read(value)
    if isinstance(kind, type) and issubclass(kind, Reply):
        return kind.of
    return None
