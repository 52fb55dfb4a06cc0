"""Who may put: hosts, by their addresses. What a client says of its host counts for nothing."""

from __future__ import annotations

import ipaddress
import logging
import socket
from collections.abc import Iterable

LOG = logging.getLogger("bushd-epics")
LOCAL = ("127.0.0.1",)


class Access:
    def __init__(self, hosts: Iterable[str], read_only: bool = False) -> None:
        """`hosts`: names, addresses and networks ("10.0.5.0/24"); names are looked up now."""
        self._read_only = read_only
        self._networks: list[ipaddress.IPv4Network | ipaddress.IPv6Network] = []
        for host in hosts:
            self._networks.extend(_networks(host))

    def may_put(self, address: str) -> bool:
        if self._read_only:
            return False
        try:
            peer = ipaddress.ip_address(address)
        except ValueError:
            return False
        return any(peer in network for network in self._networks)


def _networks(host: str) -> list[ipaddress.IPv4Network | ipaddress.IPv6Network]:
    try:
        return [ipaddress.ip_network(host, strict=False)]
    except ValueError:
        pass
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)
    except OSError as error:
        LOG.warning("[allow] %s: %s; it may not put", host, error)
        return []
    return [ipaddress.ip_network(address[4][0]) for address in found]
