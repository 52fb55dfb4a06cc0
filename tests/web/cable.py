"""A line between a browser and bushd-web that can be cut: nobody is told, and what is sent meanwhile waits, as in a network."""

import contextlib
import selectors
import socket
import threading


class Cable:
    """Connections to `port` are passed on to that of bushd-web, until the line is cut and from when it is mended."""

    def __init__(self, to_port):
        self._to_port = to_port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._others = {}  # by socket: where its bytes go
        self._passes = threading.Lock()  # held while one piece is passed on, and while the line is cut
        self._is_cut = False
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._wake, self._woken = socket.socketpair()
        self._selector.register(self._woken, selectors.EVENT_READ)
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def cut(self):
        """No byte is passed on after this has returned."""
        self._passes.acquire()
        self._is_cut = True

    def mend(self):
        if self._is_cut:
            self._is_cut = False
            self._passes.release()

    def close(self):
        self.mend()
        self._wake.close()
        self._thread.join()
        for one in (self._listener, self._woken, *self._others):
            one.close()
        self._selector.close()

    def _run(self):
        while True:
            for key, _ in self._selector.select():
                if key.fileobj is self._woken:
                    return
                with self._passes:
                    if key.fileobj is self._listener:
                        self._connect()
                    elif key.fileobj in self._others:
                        self._pass_on(key.fileobj)

    def _connect(self):
        near = self._listener.accept()[0]
        try:
            far = socket.create_connection(("127.0.0.1", self._to_port))
        except OSError:
            near.close()
            return
        for one, other in ((near, far), (far, near)):
            self._others[one] = other
            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._selector.register(one, selectors.EVENT_READ)

    def _pass_on(self, one):
        piece = b""
        with contextlib.suppress(OSError):
            piece = one.recv(1 << 16)
            self._others[one].sendall(piece)
        if not piece:
            for end in (one, self._others[one]):
                self._selector.unregister(end)
                del self._others[end]
                end.close()
