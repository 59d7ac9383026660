Json: TypeAlias = bool | int | float | str | Sequence["Json"] | Mapping[str, "Json"] | None
"""What JSON can say."""

Numbers: TypeAlias = Sequence[float] | Sequence[Sequence[float]] | NDArray[np.floating[Any] | np.integer[Any]]
"""Numbers in the shape that the description names, as a sequence or as an array."""


def plain(value: Any) -> Any:
    """What JSON has in place of classes and arrays; a field that is None is left out."""
    if is_dataclass(value) and not isinstance(value, type):
        return plain({field.name.rstrip("_"): getattr(value, field.name) for field in fields(value)})
    if isinstance(value, np.ndarray | np.generic):
        return cast(Any, value).tolist()
    if isinstance(value, Mapping):
        named = cast(Mapping[str, Any], value)
        return {name: plain(of) for name, of in named.items() if of is not None}
    if isinstance(value, list | tuple):
        return [plain(item) for item in cast(Sequence[Any], value)]
    return value
