"""Who may do what: scopes, who asks, and the words that API keys are."""

import hashlib
import hmac
import secrets
from dataclasses import dataclass
from enum import StrEnum

from gripwright.domain.errors import GripwrightError

KEY_PREFIX = "gwk_"
_SECRET_BYTES = 32


class AccessScope(StrEnum):
    """What a caller may do; each scope includes those before it."""

    READ = "read"
    WRITE = "write"
    ADMIN = "admin"

    @property
    def included(self) -> "frozenset[AccessScope]":
        """This scope and those that it includes."""
        scopes = list(AccessScope)
        return frozenset(scopes[: scopes.index(self) + 1])


@dataclass(frozen=True, slots=True, kw_only=True)
class Principal:
    """Who asks: an API key, a subject of the issuer, or anybody where access is open."""

    actor: str  # "key:…", "token:…", as the audit trail names it
    name: str
    scopes: frozenset[AccessScope]


ANYBODY = Principal(actor="anonymous", name="", scopes=AccessScope.ADMIN.included)
"""Everybody, where the service listens on loopback and asks for no key."""


class NotAuthenticated(GripwrightError):
    """No credential, or none that is valid."""

    code = "not-authenticated"


class ScopeMissing(GripwrightError):
    """The credential is valid and has not the scope that the request needs."""

    code = "scope-missing"


def new_key_secret() -> str:
    """The secret part of a key: 32 random bytes as a word."""
    return secrets.token_urlsafe(_SECRET_BYTES)


def key_word(key_id: str, secret: str) -> str:
    """The key as its holder sends it."""
    return f"{KEY_PREFIX}{key_id}_{secret}"


def split_key_word(word: str) -> tuple[str, str]:
    """Id and secret of a key; both empty where the word has not the form of one."""
    key_id, _, secret = word.removeprefix(KEY_PREFIX).partition("_")
    return (key_id, secret) if key_id and secret else ("", "")


def secret_sha256(secret: str) -> str:
    """What is stored of a secret. Its 256 random bits cannot be guessed, hence no slow hash and no salt."""
    return hashlib.sha256(secret.encode()).hexdigest()


def is_secret(secret: str, sha256: str | None) -> bool:
    """Whether this is the secret of that hash, in a time that tells nothing; None stands for a key that does not exist."""
    matches = hmac.compare_digest(secret_sha256(secret), sha256 or "0" * 64)
    return matches and sha256 is not None
