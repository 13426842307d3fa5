"""A real issuer of tokens: discovery document and keys over HTTP, tokens signed as they are asked for."""

import json
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import jwt
from cryptography.hazmat.primitives.asymmetric import ec, rsa

AUDIENCE = "https://gripwright.example"


class Issuer:
    """Listens on a free port of this machine; `close` ends it."""

    def __init__(self):
        issuer = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self):
                issuer.asked.append(self.path)
                content = issuer.documents.get(self.path)
                self.send_response(503 if content is None else 200)
                self.send_header("content-type", "application/json")
                self.end_headers()
                self.wfile.write(json.dumps(content or {}).encode())

            def log_message(self, *args):
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        self.url = f"http://127.0.0.1:{self._server.server_port}"
        self.asked = []  # paths, in order
        self.private = {"one": rsa.generate_private_key(public_exponent=65537, key_size=2048)}
        self.documents = {"/.well-known/openid-configuration": {"issuer": self.url, "jwks_uri": f"{self.url}/keys"}}
        self.publish()

    def publish(self, *extra):
        """Offer the public parts of all keys, and whatever else."""
        keys = [{"kid": kid, "use": "sig", **public_jwk(key)} for kid, key in self.private.items()]
        self.documents["/keys"] = {"keys": [*keys, *extra]}

    def add_elliptic_key(self, kid):
        self.private[kid] = ec.generate_private_key(ec.SECP256R1())

    def token(self, kid="one", key=None, algorithm="RS256", **claims):
        """A token that is right in all that is not said otherwise; a claim that is None is left out."""
        now = int(time.time())
        claims = {"iss": self.url, "aud": AUDIENCE, "sub": "robot-7", "iat": now, "exp": now + 300, **claims}
        payload = {name: value for name, value in claims.items() if value is not None}
        return jwt.encode(payload, self.private[kid] if key is None else key, algorithm, headers={"kid": kid})

    def close(self):
        self._server.shutdown()
        self._server.server_close()


def public_jwk(key):
    kind = jwt.algorithms.RSAAlgorithm if isinstance(key, rsa.RSAPrivateKey) else jwt.algorithms.ECAlgorithm
    return kind.to_jwk(key.public_key(), as_dict=True)
