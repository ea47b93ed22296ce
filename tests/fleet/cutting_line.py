"""A line to a server that breaks after a random number of bytes, again and again."""
import random
import socket
import threading


class CuttingLine:
    """Listens on a port of its own; each connection goes to `target` and ends after so many bytes
    of both directions as chance says, at most `most`."""

    def __init__(self, target, most, seed):
        self._target, self._most, self._random = target, most, random.Random(seed)
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = "127.0.0.1:%d" % self._listener.getsockname()[1]
        self.cuts = 0
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self):
        self._listener.close()

    def _accept(self):
        while True:
            try:
                near, _ = self._listener.accept()
            except OSError:
                return
            try:
                far = socket.create_connection(self._target, timeout=5)
            except OSError:
                near.close()
                continue
            far.settimeout(None)
            left = [self._random.randint(1000, self._most)]
            for source, sink in ((near, far), (far, near)):
                threading.Thread(target=self._carry, args=(source, sink, left),
                                 daemon=True).start()

    def _carry(self, source, sink, left):
        try:
            while left[0] > 0:
                data = source.recv(min(left[0], 16384))
                if not data:
                    break
                left[0] -= len(data)
                sink.sendall(data)
            self.cuts += left[0] <= 0
        except OSError:
            pass
        for end in (source, sink):
            try:
                end.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass
