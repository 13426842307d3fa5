"""Bearer tokens of an OpenID Connect issuer: signed by a key that it publishes, for this audience, not expired."""

import logging
import threading
import time
from collections.abc import Mapping
from typing import Any

import httpx
import jwt

from gripwright.domain.access import AccessScope, NotAuthenticated, Principal
from gripwright.http.errors import NotReady
from gripwright.settings import is_secure_url

_log = logging.getLogger(__name__)

_ALGORITHMS = frozenset(
    {"RS256", "RS384", "RS512", "PS256", "PS384", "PS512", "ES256", "ES384", "ES512", "EdDSA"}
)  # signatures alone: a shared secret in a public document would let everybody sign
_REQUIRED = ("exp", "iss", "aud", "sub")
_LEEWAY_S = 30.0  # between the clocks of issuer and service
_TIMEOUT_S = 5.0
_LIVE_S = 3600.0  # how long fetched keys are believed
_PAUSE_S = 10.0  # between two fetches, so that tokens of invented keys cannot make the service ask all the time


class IssuerKeys:
    """The public keys of an issuer, fetched when they are needed and again where a token names another one."""

    def __init__(self, issuer: str) -> None:
        self._issuer = issuer
        self._lock = threading.Lock()
        self._keys: Mapping[str | None, jwt.PyJWK] = {}
        self._fetched_s = self._tried_s = float("-inf")

    def key(self, key_id: str | None) -> jwt.PyJWK:
        """The key of that id. NotAuthenticated where the issuer has none, NotReady where it does not answer."""
        if not self._has(key_id):
            with self._lock:
                now_s = time.monotonic()
                if not self._has(key_id) and now_s >= self._tried_s + _PAUSE_S:
                    self._tried_s = now_s
                    self._keys, self._fetched_s = self._fetch(), now_s
        if not self._is_live():
            raise NotReady("the issuer of bearer tokens does not answer")
        found = self._keys.get(key_id)
        if found is None:
            raise NotAuthenticated("the token is signed by a key that the issuer does not publish")
        return found

    def _has(self, key_id: str | None) -> bool:
        return self._is_live() and key_id in self._keys

    def _is_live(self) -> bool:
        return time.monotonic() < self._fetched_s + _LIVE_S

    def _fetch(self) -> Mapping[str | None, jwt.PyJWK]:
        """Keys by their id. A key without one answers tokens without one."""
        try:
            with httpx.Client(timeout=_TIMEOUT_S, follow_redirects=False) as client:
                document = _json(client, f"{self._issuer.rstrip('/')}/.well-known/openid-configuration")
                if document.get("issuer") != self._issuer:
                    raise ValueError(f"its discovery document is that of {document.get('issuer')}")
                address = str(document.get("jwks_uri"))
                if not is_secure_url(address):
                    raise ValueError(f"its keys are at {address}, which is no https URL")
                entries = _json(client, address)["keys"]
        except (httpx.HTTPError, ValueError, KeyError, TypeError) as error:
            _log.error("the keys of %s cannot be fetched: %s", self._issuer, error)
            raise NotReady("the issuer of bearer tokens does not answer") from error
        return _usable(entries)


def _json(client: httpx.Client, address: str) -> dict[str, Any]:
    answer = client.get(address)
    answer.raise_for_status()
    content = answer.json()
    if not isinstance(content, dict):
        raise ValueError(f"{address} holds no JSON object")
    return content


def _usable(entries: list[dict[str, Any]]) -> Mapping[str | None, jwt.PyJWK]:
    keys: dict[str | None, jwt.PyJWK] = {}
    for entry in entries:
        try:
            key = jwt.PyJWK(entry)
        except jwt.PyJWTError:
            continue  # of a kind that this version does not know: others may do
        if key.algorithm_name in _ALGORITHMS and key.public_key_use in (None, "sig"):
            keys[key.key_id] = key
    return keys


class TokenVerifier:
    """Turns a bearer token into who asks."""

    def __init__(self, *, issuer: str, audience: str, claim: str, scopes: Mapping[str, AccessScope]) -> None:
        self._issuer, self._audience, self._claim, self._scopes = issuer, audience, claim, scopes
        self._keys = IssuerKeys(issuer)

    def principal(self, token: str) -> Principal:
        """The subject with its scopes, or NotAuthenticated with what is wrong with the token."""
        try:
            key = self._keys.key(jwt.get_unverified_header(token).get("kid"))
            claims = jwt.decode(
                token,
                key,
                algorithms=[key.algorithm_name],
                issuer=self._issuer,
                audience=self._audience,
                leeway=_LEEWAY_S,
                options={"require": list(_REQUIRED), "enforce_minimum_key_length": True},
            )
        except jwt.PyJWTError as error:
            raise NotAuthenticated(f"the token is not valid: {str(error).rstrip('.').lower()}") from error
        return Principal(actor=f"token:{claims['sub']}", name=_name(claims), scopes=self._granted(claims.get(self._claim)))

    def _granted(self, claim: object) -> frozenset[AccessScope]:
        words = claim.split() if isinstance(claim, str) else claim if isinstance(claim, list) else []
        granted = [self._scopes[word].included for word in words if isinstance(word, str) and word in self._scopes]
        return frozenset().union(*granted)


def _name(claims: Mapping[str, Any]) -> str:
    """What people call the subject, or the program that asks."""
    for claim in ("preferred_username", "email", "client_id", "azp"):
        if isinstance(claims.get(claim), str):
            return str(claims[claim])
    return ""
