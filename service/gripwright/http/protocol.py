"""Requests that are no HTTP: the server answers them itself, before there is an application to ask. As a problem, too."""

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from gripwright.http.errors import problem
from gripwright.http.observed import SECURITY_HEADERS


class ProblemProtocol(H11Protocol):
    """The server's protocol, whose own refusals are problem documents."""

    def send_400_response(self, msg: str) -> None:
        """Refuse what cannot be read, and close the connection."""
        answer = problem(400, "bad-request", f"this is no HTTP request that can be read: {msg.rstrip('.').lower()}")
        headers = [*answer.raw_headers, *((name.encode(), value.encode()) for name, value in SECURITY_HEADERS.items())]
        start = h11.Response(status_code=400, headers=[*headers, (b"connection", b"close")], reason=b"Bad Request")
        for event in (start, h11.Data(data=bytes(answer.body)), h11.EndOfMessage()):
            self.transport.write(self.conn.send(event))
        self.transport.close()
