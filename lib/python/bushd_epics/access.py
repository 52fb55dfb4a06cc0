"""Who may put: hosts, by their addresses. What a client says of its host counts for nothing."""

from __future__ import annotations

import ipaddress
import logging
import socket
from collections.abc import Callable, Iterable

LOG = logging.getLogger("bushd-epics")
LOCAL = ("127.0.0.1",)


LookUp = Callable[[str], Iterable[str]]


def addresses(host: str) -> list[str]:
    """The addresses of this name. Raises OSError."""
    return [str(found[4][0]) for found in socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)]


class Access:
    def __init__(self, hosts: Iterable[str], read_only: bool = False, look_up: LookUp = addresses) -> None:
        """`hosts`: names, addresses and networks ("10.0.5.0/24"); names are looked up now."""
        self._read_only = read_only
        self._addresses = look_up
        self._networks: list[ipaddress.IPv4Network | ipaddress.IPv6Network] = []
        self.unknown: list[str] = []  # names that were not found
        for host in hosts:
            try:
                self._networks.append(ipaddress.ip_network(host, strict=False))
            except ValueError:
                self.unknown.append(host)
        self.look_up(tell=True)

    def look_up(self, tell: bool = False) -> bool:
        """Names that were not found until now, which may take seconds; whether one was found. `tell`: of those that were not."""
        unknown = []
        for host in self.unknown:
            try:
                found = [ipaddress.ip_network(address) for address in self._addresses(host)]
            except OSError as error:
                unknown.append(host)
                if tell:
                    LOG.warning(
                        "[allow] %s: %s; it may not put until it is found, which is tried every 10 s. Correct the name, or write its address", host, error
                    )
                continue
            LOG.info("[allow] %s is %s", host, ", ".join(str(one.network_address) for one in found))
            self._networks.extend(found)
        was, self.unknown = self.unknown, unknown
        return len(unknown) < len(was)

    def may_put(self, address: str) -> bool:
        if self._read_only:
            return False
        try:
            peer = ipaddress.ip_address(address)
        except ValueError:
            return False
        return any(peer in network for network in self._networks)
