"""Numbers as CAD files write them. Python's own reading takes more than that: 1_000 for one."""

_SHOWN = 40  # characters of what is no number


def real(word: str) -> float:
    """A coordinate; ValueError shows what is none. NaN and infinity pass: read.checked counts them."""
    try:
        if "_" not in word:
            return float(word)
    except ValueError:
        pass
    raise ValueError(f"{word[:_SHOWN]!r} is no number")


def index(word: str) -> int:
    """An index or a count, which may be negative; ValueError shows what is none."""
    try:
        if "_" not in word and len(word) < 20:  # more digits than 64 bits have
            return int(word)
    except ValueError:
        pass
    raise ValueError(f"{word[:_SHOWN]!r} is no integer")


def count(word: str, what: str) -> int:
    """A number of things, from 0."""
    number = index(word)
    if number < 0:
        raise ValueError(f"{number} {what}")
    return number
