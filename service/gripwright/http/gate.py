"""Who asks, and whether they may: keys from the database, tokens of an issuer, or nobody asks where access is open."""

from datetime import datetime

from gripwright.domain.access import (
    ANYBODY,
    KEY_PREFIX,
    AccessScope,
    NotAuthenticated,
    Principal,
    ScopeMissing,
    is_secret,
    split_key_word,
)
from gripwright.domain.errors import Conflict
from gripwright.http.tokens import TokenVerifier
from gripwright.settings import Settings
from gripwright.store.api_keys import ApiKeyRepository, is_valid
from gripwright.store.engines import Database

OPEN_PATHS = frozenset({"/", "/openapi.json", "/health/live", "/health/ready"})
"""Need no key: what runs the service asks for its health, and the others are the same in every installation."""

OPEN_FOLDER = "/dashboard/"
ADMIN_PATHS = ("/api/v1/audit",)
_READING = frozenset({"GET", "HEAD", "OPTIONS"})


def required_scope(method: str, path: str) -> AccessScope | None:
    """What a request needs; None: nothing. A path that is not named here needs a scope."""
    if path in OPEN_PATHS or path.startswith(OPEN_FOLDER):
        return None
    if path.startswith(ADMIN_PATHS):
        return AccessScope.ADMIN
    return AccessScope.READ if method in _READING else AccessScope.WRITE


class Gate:
    """Lets requests in."""

    def __init__(self, settings: Settings, database: Database) -> None:
        self._database = database
        self._is_open = not settings.asks_for_access
        self._tokens: TokenVerifier | None = None
        if settings.oidc_issuer is not None and settings.oidc_audience is not None:
            self._tokens = TokenVerifier(
                issuer=settings.oidc_issuer,
                audience=settings.oidc_audience,
                claim=settings.oidc_claim,
                scopes=settings.oidc_scopes,
            )

    def identify(self, authorization: str, now: datetime) -> Principal:
        """Who sends that `Authorization` header. NotAuthenticated where it is no valid credential, or none and one is needed."""
        scheme, _, word = authorization.strip().partition(" ")
        if scheme.lower() == "bearer":
            return self._bearer(word.strip(), now)
        if self._is_open:
            return ANYBODY
        raise NotAuthenticated("this service needs an API key or a token: Authorization: Bearer …")

    def _bearer(self, word: str, now: datetime) -> Principal:
        if word.startswith(KEY_PREFIX):
            return self._key_holder(word, now)
        if self._tokens is None:
            raise NotAuthenticated(f"the bearer is no API key ({KEY_PREFIX}…), and no issuer of tokens is set")
        return self._tokens.principal(word)

    def _key_holder(self, word: str, now: datetime) -> Principal:
        key_id, secret = split_key_word(word)
        with self._database.read_sessions() as session:
            row = ApiKeyRepository(session).find(key_id)
        if not is_secret(secret, None if row is None else row.secret_sha256) or row is None:
            raise NotAuthenticated("there is no such API key")
        if not is_valid(row, now):
            raise NotAuthenticated(f"the API key {row.name} has {'expired' if row.revoked_at is None else 'been revoked'}")
        return Principal(actor=f"key:{row.id}", name=row.name, scopes=AccessScope(row.scope).included)


def check_scope(principal: Principal, needed: AccessScope) -> None:
    """ScopeMissing where the caller may not do that."""
    if needed not in principal.scopes:
        has = ", ".join(scope for scope in AccessScope if scope in principal.scopes) or "none"
        raise ScopeMissing(f"the scope {needed} is missing: {principal.name or principal.actor} has {has}", scope=needed)


def require_way_in(settings: Settings, database: Database, now: datetime) -> None:
    """Conflict where the service would ask for access that nobody can have."""
    if not settings.asks_for_access or settings.oidc_issuer is not None:
        return
    with database.read_sessions() as session:
        if ApiKeyRepository(session).valid(now):
            return
    raise Conflict(
        f"the service would listen on {settings.host or 'every address'} and nobody could use it: there is no valid API key "
        "and no issuer of tokens. Make a key with `gripwright keys create NAME --scope admin`, or set GRIPWRIGHT_OIDC_ISSUER and "
        "GRIPWRIGHT_OIDC_AUDIENCE; without either it listens on 127.0.0.1 alone"
    )
