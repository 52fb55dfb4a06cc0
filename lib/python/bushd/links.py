"""Ways to the daemon: the control socket of this PC, or LCM. None of them blocks."""

from __future__ import annotations

import errno
import grp
import os
import select
import socket
import struct
from collections.abc import Iterator
from typing import Protocol

from . import udpm
from .errors import NoDaemon

SYSTEM_PATH = "/run/bushd/control"
DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0"
DEFAULT_PREFIX = "BUSHD"
MAX_CHANNEL = 63  # on the control socket
PACKETS_AT_ONCE = 256
CONNECT_WITHIN_S = 3
ENDS_WITHIN_MS = 200
IP_MULTICAST_ALL = 49  # of Linux; the module socket does not name it


class LinkEnded(Exception):
    """The daemon has closed the connection."""


class Link(Protocol):
    loses: bool
    remedy: str  # what has to be there for a daemon to answer

    def fileno(self) -> int:
        """Readable while messages wait."""

    def send(self, channel: str, payload: bytes) -> None:
        """Raises BlockingIOError while there is no room, LinkEnded when there will be none."""

    def receive(self) -> Iterator[tuple[str, bytes]]:
        """What waits, at most PACKETS_AT_ONCE messages. Raises LinkEnded behind the last message."""

    def close(self) -> None: ...


class SocketLink:
    loses = False

    def __init__(self, path: str) -> None:
        self._path = path
        self.remedy = f"bushd does not answer at {path}; its log may tell why"
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        # connect() waits for room among those that a daemon has not taken yet.
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, struct.pack("@ll", CONNECT_WITHIN_S, 0))
        try:
            self._socket.connect(path)
        except OSError as error:
            self._socket.close()
            if isinstance(error, PermissionError):
                raise NoDaemon(no_right(path)) from error
            raise NoDaemon(no_daemon(path, error)) from error
        self._socket.setblocking(False)

    def fileno(self) -> int:
        return self._socket.fileno()

    def send(self, channel: str, payload: bytes) -> None:
        try:
            self._socket.send(channel.encode("ascii") + b"\0" + payload)
        except (BlockingIOError, InterruptedError):
            raise BlockingIOError from None
        except OSError as error:
            raise LinkEnded(f"the daemon does not take messages at {self._path}: {error.strerror}") from error

    def receive(self) -> Iterator[tuple[str, bytes]]:
        for _ in range(PACKETS_AT_ONCE):
            try:
                packet, _, flags, _ = self._socket.recvmsg(65536)
            except (BlockingIOError, InterruptedError):
                return
            except OSError:
                packet, flags = b"", 0
            if not packet:
                raise LinkEnded(why_closed(self._path))
            name, nul, payload = packet.partition(b"\0")
            if nul and 0 < len(name) <= MAX_CHANNEL and name.isascii() and not flags & socket.MSG_TRUNC:
                yield name.decode("ascii"), payload

    def close(self) -> None:
        self._socket.close()


def why_closed(path: str) -> str:
    """The connection is over; whether somebody listens there still, and goes on, tells why.

    A process that ends closes its descriptors one after the other, and what waits at the socket with it.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as another:
        another.setblocking(False)
        ended = another.connect_ex(path) != 0
        if not ended:
            poll = select.poll()
            poll.register(another, select.POLLIN)
            ended = any(event & select.POLLHUP for _, event in poll.poll(ENDS_WITHIN_MS))
        if ended:
            return f"the daemon has ended; it was at {path}"
    return (
        f"bushd has closed this connection at {path}: too many clients are connected, this one did not read what it "
        "was sent, or the daemon has restarted; its log tells why"
    )


class LcmLink:
    loses = True

    def __init__(self, url: str, prefix: str) -> None:
        self._url = udpm.Url.parse(url)
        self._prefix = prefix + "_"
        self.remedy = (
            f"no bushd answers on channels {prefix}_... of {url}. Start `bushd --config FILE`, with "
            f'url = "{url}" and prefix = "{prefix}" in [lcm] of that file'
        )
        self._sequence = 0
        self._receiver = udpm.Receiver()
        self._in = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._open(url)
        except BaseException:
            self.close()
            raise

    def _open(self, url: str) -> None:
        address = self._url.address
        self._in.setblocking(False)
        self._out.setblocking(False)
        self._in.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        # As much as the machine allows: one answer of a large installation is hundreds of datagrams.
        self._in.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, self._url.receive_buffer_bytes)
        self._out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, self._url.ttl)
        self._out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
        try:
            group = struct.pack("4sI", socket.inet_aton(address), socket.INADDR_ANY)
            if self._url.ttl == 0:
                # Whatever the route is, now and later: a TTL of 0 keeps no packet on this PC by itself (lib/lcm/loopback_only.h).
                loopback = socket.inet_aton("127.0.0.1")
                group = socket.inet_aton(address) + loopback
                self._in.setsockopt(socket.IPPROTO_IP, IP_MULTICAST_ALL, 0)
                self._out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, loopback)
            self._in.bind((address, self._url.port))
            self._in.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group)
            self._out.connect((address, self._url.port))
        except OSError as error:
            raise NoDaemon(
                f'LCM cannot use the URL "{url}" ({error.strerror or error}): the address is wrong or there is no '
                f"route to it. For this machine only: ip route replace {address}/32 dev lo (as root)"
            ) from error

    def fileno(self) -> int:
        return self._in.fileno()

    def send(self, channel: str, payload: bytes) -> None:
        self._sequence += 1
        try:
            self._out.send(udpm.datagram(self._sequence, self._prefix + channel, payload))
        except OSError as error:
            # A lost datagram is sent again. What else it is does not pass by itself.
            if error.errno not in (errno.EAGAIN, errno.EINTR, errno.ENOBUFS, errno.ECONNREFUSED):
                raise LinkEnded(f"LCM cannot send: {error.strerror}; is the network up?") from error

    def receive(self) -> Iterator[tuple[str, bytes]]:
        for _ in range(PACKETS_AT_ONCE):
            try:
                data, sender = self._in.recvfrom(65536)
            except OSError:
                return
            message = self._receiver.take(data, sender)
            if message is not None and message[0].startswith(self._prefix):
                yield message[0][len(self._prefix) :], message[1]

    def close(self) -> None:
        self._in.close()
        self._out.close()


def no_daemon(path: str, error: OSError) -> str:
    """There is no daemon behind this path, as connect() says."""
    start = (
        "Start it with 'sudo systemctl start bushd', or 'bushd --config FILE'; for another daemon use "
        "connect(PATH) ($BUSHD_CONTROL), or connect(lcm=True)"
    )
    if isinstance(error, (FileNotFoundError, NotADirectoryError)):
        return f"no control socket at {path}: bushd is not running. {start}"
    if isinstance(error, ConnectionRefusedError):
        return f"nobody listens at the control socket {path}: bushd has ended. {start}"
    if isinstance(error, BlockingIOError):
        return f"bushd takes no connection at {path}: it hangs, or others take all of its time; its log may tell why"
    return f"no bushd at the control socket {path}: {error.strerror or error}. {start}"


def no_right(path: str) -> str:
    """Who has a right to this socket, and how one becomes one of them."""
    text = f"{path}: this user has no right to the control socket"
    try:
        group = grp.getgrgid(os.stat(path).st_gid).gr_name
    except (OSError, KeyError):
        return text
    if group == "root":
        return f"{text}: it is for root only. Set [control] group in bushd.toml, and restart bushd"
    return f"{text}: it is for the group {group}. Run 'sudo usermod -aG {group} USER', then log in again"


def default_paths() -> list[str]:
    """Where a daemon's control socket may be, the likeliest first."""
    named = os.environ.get("BUSHD_CONTROL")
    if named:
        return [named]
    runtime = os.environ.get("XDG_RUNTIME_DIR", "")
    return [SYSTEM_PATH] + ([f"{runtime}/bushd/control"] if runtime.startswith("/") else [])


def open_link(path: str | os.PathLike[str] | None, lcm: bool | str, prefix: str) -> Link:
    """As `connect()` of the two faces says. Raises NoDaemon."""
    if path is not None and lcm:
        raise ValueError("give a socket or LCM, not both")
    if path is not None:
        return SocketLink(os.fspath(path))
    named_url = os.environ.get("LCM_DEFAULT_URL", "")
    if lcm:
        return LcmLink(lcm if isinstance(lcm, str) else named_url or DEFAULT_URL, prefix)
    first: NoDaemon | None = None
    barred: NoDaemon | None = None  # there is a socket, and this user has no right to it: that is why LCM is tried
    for candidate in default_paths():
        try:
            return SocketLink(candidate)
        except NoDaemon as error:
            first = first or error
            if isinstance(error.__cause__, PermissionError):
                barred = barred or error
    if first is not None and barred is None and not named_url:
        raise first
    why = f" ({barred})" if barred is not None else ""
    try:
        link = LcmLink(named_url or DEFAULT_URL, prefix)
    except NoDaemon as error:
        if barred is not None and not named_url:  # who has not asked for LCM has the socket in mind
            raise barred from error
        raise NoDaemon(f"{error}{why}") from error
    link.remedy += why
    return link
