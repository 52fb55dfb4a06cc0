"""A WebSocket client as small as tests need (RFC 6455): over one socket, blocking. It sends what it is told, also what no browser would."""

import base64
import json
import os
import socket
import struct

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10


class Refused(Exception):
    """No WebSocket, but this status and text."""

    def __init__(self, status, text):
        super().__init__(f"{status}: {text}")
        self.status = status


class Ended(Exception):
    pass


class WebSocket:
    def __init__(self, port, path="/api/live", protocol="bushd", host=None, origin=None, cookie=None, timeout_s=30):
        self._socket = socket.create_connection(("127.0.0.1", port), timeout=timeout_s)
        self._bytes = b""
        key = base64.b64encode(os.urandom(16)).decode()
        headers = {"Host": host or f"127.0.0.1:{port}", "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Key": key,
                   "Sec-WebSocket-Version": "13"}
        headers |= {name: value for name, value in
                    (("Sec-WebSocket-Protocol", protocol), ("Origin", origin), ("Cookie", cookie)) if value}
        lines = [f"GET {path} HTTP/1.1", *(f"{name}: {value}" for name, value in headers.items()), "", ""]
        self._socket.sendall("\r\n".join(lines).encode())
        try:
            self._await_upgrade()
        except (Ended, Refused, OSError):
            self.close()
            raise

    def _await_upgrade(self):
        while b"\r\n\r\n" not in self._bytes:
            self._receive()
        head, _, self._bytes = self._bytes.partition(b"\r\n\r\n")
        status = int(head.split()[1])
        if status != 101:
            raise Refused(status, head.decode() + self._bytes.decode(errors="replace"))

    def close(self):
        self._socket.close()

    def _receive(self):
        try:
            more = self._socket.recv(1 << 20)
        except ConnectionResetError:
            more = b""
        if not more:
            raise Ended("the connection has ended")
        self._bytes += more

    def _take(self, count):
        while len(self._bytes) < count:
            self._receive()
        taken, self._bytes = self._bytes[:count], self._bytes[count:]
        return taken

    def send_frame(self, kind, payload, final=True):
        mask = os.urandom(4)
        length = len(payload)
        head = bytes([(0x80 if final else 0) | kind])
        if length < 126:
            head += bytes([0x80 | length])
        elif length < 65536:
            head += bytes([0x80 | 126]) + struct.pack(">H", length)
        else:
            head += bytes([0x80 | 127]) + struct.pack(">Q", length)
        # As one number: byte by byte it would take seconds of what is too large.
        masks = (mask * (length // 4 + 1))[:length]
        masked = (int.from_bytes(payload, "little") ^ int.from_bytes(masks, "little")).to_bytes(length, "little")
        self._socket.sendall(head + mask + masked)

    def send(self, message):
        """`message`: a text, or what becomes one as JSON."""
        text = message if isinstance(message, str) else json.dumps(message)
        self.send_frame(TEXT, text.encode())

    def receive(self):
        """The next message, as an object. Raises Ended."""
        text = b""
        while True:
            first, second = self._take(2)
            length = second & 0x7F
            if length >= 126:
                length = struct.unpack(">H" if length == 126 else ">Q", self._take(2 if length == 126 else 8))[0]
            payload = self._take(length)
            kind = first & 0x0F
            if kind == CLOSE:
                raise Ended("closed by bushd-web")
            if kind == PING:
                self.send_frame(PONG, payload)
                continue
            if kind == PONG:
                continue
            text += payload
            if first & 0x80:
                return json.loads(text)
