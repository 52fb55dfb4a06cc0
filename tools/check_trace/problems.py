"""What is found to be wrong, and what cannot be read."""

from collections import Counter

SHOWN_OF_A_KIND = 3  # problems of one kind and motor; the rest is counted


class InputError(Exception):
    """What was given to read cannot be read; the text says where and why."""


class Problems:
    def __init__(self):
        self._shown = []
        self._counts = Counter()

    def add(self, who, kind, text, time_ns=None):
        self._counts[str(who), kind] += 1
        if self._counts[str(who), kind] <= SHOWN_OF_A_KIND:
            at = "" if time_ns is None else f" at {time_ns / 1e6:.6f} ms"
            self._shown.append(f"{who}{at}: {text}")

    def none(self):
        return not self._shown

    def lines(self):
        yield from self._shown
        for (who, kind), count in self._counts.items():
            if count > SHOWN_OF_A_KIND:
                yield f"{who}: {count - SHOWN_OF_A_KIND} more of the kind '{kind}'"
