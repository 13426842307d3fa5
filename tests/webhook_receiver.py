"""A receiver of webhooks: a real server that keeps what it is sent."""

import contextlib
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer


class _Handler(BaseHTTPRequestHandler):
    def do_POST(self):
        server = self.server
        body = self.rfile.read(int(self.headers["content-length"]))
        with server.lock:
            server.received.append((dict(self.headers), body))
            server.at_once += 1
            server.most_at_once = max(server.most_at_once, server.at_once)
        time.sleep(server.delay_s)
        with contextlib.suppress(OSError):
            self.send_response(server.answer)
            for name, value in server.headers.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(server.body)
            for _ in range(server.trickles):
                time.sleep(0.2)
                self.wfile.write(b".")
                self.wfile.flush()
        with server.lock:
            server.at_once -= 1

    def log_message(self, *args):
        pass


@contextlib.contextmanager
def receiving(context=None):
    """A receiver with an address of its own; with an SSL context it speaks HTTPS."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), _Handler)
    server.daemon_threads = True
    server.received, server.answer, server.headers, server.body = [], 204, {}, b""
    server.delay_s, server.trickles, server.at_once, server.most_at_once = 0.0, 0, 0, 0
    server.lock = threading.Lock()
    if context is not None:
        server.socket = context.wrap_socket(server.socket, server_side=True)
    server.url = f"http{'' if context is None else 's'}://127.0.0.1:{server.server_port}/hook"
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server
    server.shutdown()
    server.server_close()
