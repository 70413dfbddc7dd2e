"""Changes of a text, collected in any order and applied at once."""


class Edits:
    """Replacements and insertions by character index."""

    def __init__(self) -> None:
        self._list: list[tuple[int, int, int, str]] = []

    def __len__(self) -> int:
        return len(self._list)

    def replace(self, begin: int, end: int, new: str) -> None:
        """Replace characters `begin` to `end` by `new`."""
        self._list.append((begin, len(self._list), end, new))

    def insert(self, at: int, new: str, first: bool = False) -> None:
        """Insert `new` before character `at`; several at one index keep their order, `first` goes before them."""
        self._list.append((at, -1 if first else len(self._list), at, new))

    def apply(self, string: str) -> str:
        """The changed text."""
        pieces: list[str] = []
        done = 0
        for begin, _, end, new in sorted(self._list):
            pieces.append(string[done:begin])
            pieces.append(new)
            done = max(done, end)
        pieces.append(string[done:])
        return "".join(pieces)
