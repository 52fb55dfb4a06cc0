"""LCM over UDP multicast, as LCM documents it, without I/O: datagrams of whole messages and of fragments.

Debian has no LCM for Python, and what this package needs of it is small.
"""

from __future__ import annotations

import dataclasses
import struct
import urllib.parse

WHOLE = 0x4C433032  # "LC02"
FRAGMENT = 0x4C433033  # "LC03"
MAX_CHANNEL = 63
MAX_WHOLE_BYTES = 65499  # of channel, NUL and payload; LCM fragments what is longer
DEFAULT_ADDRESS = "239.255.76.67"
DEFAULT_PORT = 7667

_WHOLE_HEADER = struct.Struct(">II")
_FRAGMENT_HEADER = struct.Struct(">IIIIHH")


@dataclasses.dataclass(frozen=True)
class Url:
    """`udpm://ADDRESS:PORT?ttl=0&recv_buf_size=BYTES`; what is left out has LCM's default."""

    address: str = DEFAULT_ADDRESS
    port: int = DEFAULT_PORT
    ttl: int = 0  # 0: packets stay on the machine
    receive_buffer_bytes: int = 4 * 1024 * 1024

    @staticmethod
    def parse(url: str) -> Url:
        parts = urllib.parse.urlsplit(url)
        if parts.scheme != "udpm":
            raise ValueError(f'the URL "{url}" is none of LCM; one that works is "udpm://239.255.76.67:7667?ttl=0"')
        options = dict(urllib.parse.parse_qsl(parts.query))
        return Url(
            address=parts.hostname or DEFAULT_ADDRESS,
            port=parts.port or DEFAULT_PORT,
            ttl=int(options.get("ttl", "0")),
            receive_buffer_bytes=int(options.get("recv_buf_size", "4194304")),
        )


def datagram(sequence: int, channel: str, payload: bytes) -> bytes:
    name = channel.encode("ascii")
    if not 0 < len(name) <= MAX_CHANNEL:
        raise ValueError(f'channel name "{channel}" has {len(name)} characters; LCM allows 1 to {MAX_CHANNEL}')
    if len(name) + 1 + len(payload) > MAX_WHOLE_BYTES:
        raise ValueError(f"a message of {len(payload)} bytes does not fit a datagram")
    return _WHOLE_HEADER.pack(WHOLE, sequence & 0xFFFFFFFF) + name + b"\0" + payload


class Receiver:
    """Puts messages together from datagrams. What is no message of LCM is dropped.

    bushd itself never fragments; an LCM between may. Memory is bounded, whatever comes: at most `MAX_MESSAGES`
    unfinished messages of at most `MAX_BYTES`; the oldest goes first.
    """

    MAX_MESSAGES = 16
    MAX_BYTES = 64 * 1024

    def __init__(self) -> None:
        self._unfinished: dict[tuple[object, int], _Fragments] = {}

    def take(self, data: bytes, sender: object) -> tuple[str, bytes] | None:
        """(channel, payload) once a message is whole."""
        if len(data) < _WHOLE_HEADER.size:
            return None
        magic, sequence = _WHOLE_HEADER.unpack_from(data)
        if magic == WHOLE:
            return _split(data[_WHOLE_HEADER.size :])
        if magic == FRAGMENT and len(data) >= _FRAGMENT_HEADER.size:
            return self._take_fragment(data, (sender, sequence))
        return None

    def _take_fragment(self, data: bytes, key: tuple[object, int]) -> tuple[str, bytes] | None:
        _, _, size, offset, number, count = _FRAGMENT_HEADER.unpack_from(data)
        piece = data[_FRAGMENT_HEADER.size :]
        if not 0 < size <= self.MAX_BYTES or not 0 <= number < count <= size + 1:
            return None
        fragments = self._unfinished.get(key)
        if fragments is None or (fragments.size, fragments.count) != (size, count):
            self._unfinished.pop(key, None)
            while len(self._unfinished) >= self.MAX_MESSAGES:
                del self._unfinished[next(iter(self._unfinished))]
            fragments = self._unfinished[key] = _Fragments(size, count)
        message = fragments.take(offset, number, piece)
        if fragments.over:
            del self._unfinished[key]
        return message


class _Fragments:
    """One message that comes in fragments; the first one has the channel before its piece."""

    def __init__(self, size: int, count: int) -> None:
        self.size = size
        self.count = count
        self.over = False
        self._channel: str | None = None
        self._pieces: dict[int, tuple[int, bytes]] = {}

    def take(self, offset: int, number: int, piece: bytes) -> tuple[str, bytes] | None:
        if number == 0:
            first = _split(piece)
            if first is None:
                self.over = True
                return None
            self._channel, piece = first
        if offset + len(piece) > self.size:
            self.over = True
            return None
        self._pieces[number] = (offset, piece)
        if len(self._pieces) < self.count:
            return None
        self.over = True
        whole = b"".join(piece for _, piece in sorted(self._pieces.values(), key=lambda placed: placed[0]))
        return (self._channel, whole) if self._channel is not None and len(whole) == self.size else None


def _split(data: bytes) -> tuple[str, bytes] | None:
    name, nul, payload = data.partition(b"\0")
    if not nul or not 0 < len(name) <= MAX_CHANNEL or not name.isascii():
        return None
    return name.decode("ascii"), payload
