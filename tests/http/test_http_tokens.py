"""Bearer tokens of an issuer that really listens."""

import base64
import hmac
import json
import time

import pytest
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from fastapi.testclient import TestClient
from issuer import AUDIENCE, Issuer
from pydantic import ValidationError

from gripwright.http import tokens
from gripwright.http.app import create_app
from gripwright.settings import Settings
from gripwright.store.migrate import migrate


@pytest.fixture
def issuer():
    issuer = Issuer()
    yield issuer
    issuer.close()


@pytest.fixture
def guarded(issuer, tmp_path):
    """A service that takes tokens of the issuer."""
    settings = Settings(
        data_dir=tmp_path,
        host="0.0.0.0",
        oidc_issuer=issuer.url,
        oidc_audience=AUDIENCE,
        oidc_claim="scope",
        oidc_scopes={"grip.see": "read", "grip.do": "write", "grip.rule": "admin"},
    )
    app = create_app(settings)
    migrate(app.state.service.database)
    yield TestClient(app, base_url="http://127.0.0.1:8000", raise_server_exceptions=False)
    app.state.service.stop()


def ask(client, token, method="GET", path="/api/v1/jobs"):
    return client.request(method, path, headers={"Authorization": f"Bearer {token}"})


@pytest.mark.parametrize(
    ("claim", "allowed"),
    [
        ("grip.see", (True, False, False)),
        ("openid grip.do email", (True, True, False)),
        (["grip.rule"], (True, True, True)),
        (["grip.see", "grip.do"], (True, True, False)),
        ("grip.everything", (False, False, False)),
        ("read write admin", (False, False, False)),
        ("", (False, False, False)),
        (None, (False, False, False)),
        ({"grip.rule": True}, (False, False, False)),
        ([["grip.rule"], 7], (False, False, False)),
    ],
)
def test_the_scopes_claim_says_what_is_allowed(guarded, issuer, claim, allowed):
    token = issuer.token(scope=claim)

    requests = (("GET", "/api/v1/jobs"), ("POST", "/api/v1/jobs/none/cancel"), ("GET", "/api/v1/audit"))
    answers = [ask(guarded, token, method, path) for method, path in requests]

    assert 401 not in [answer.status_code for answer in answers]
    assert tuple(answer.status_code != 403 for answer in answers) == allowed


def test_another_kind_of_key_is_taken_and_an_audience_may_be_one_of_several(guarded, issuer):
    issuer.add_elliptic_key("curve")
    issuer.publish()

    assert ask(guarded, issuer.token("curve", algorithm="ES256", scope="grip.see")).status_code == 200
    assert ask(guarded, issuer.token(scope="grip.see", aud=["account", AUDIENCE])).status_code == 200


@pytest.mark.parametrize(
    "claims",
    [
        {"exp": int(time.time()) - 3600},
        {"exp": None},
        {"exp": "soon"},
        {"nbf": int(time.time()) + 3600},
        {"aud": "https://other.example"},
        {"aud": [AUDIENCE + "/"]},
        {"aud": None},
        {"iss": "https://issuer.example"},
        {"iss": None},
        {"sub": None},
    ],
)
def test_a_token_that_is_not_for_here_or_not_now_is_refused(guarded, issuer, problem, claims):
    answer = ask(guarded, issuer.token(scope="grip.rule", **claims))

    assert problem(answer, 401, "not-authenticated")["detail"].startswith("the token is not valid: ")
    assert answer.headers["WWW-Authenticate"].endswith('error="invalid_token"')


def test_a_token_of_a_foreign_key_is_refused_whatever_its_key_is_called(guarded, issuer, problem):
    foreign = rsa.generate_private_key(public_exponent=65537, key_size=2048)

    problem(ask(guarded, issuer.token("one", key=foreign, scope="grip.rule")), 401)


def forged(header, payload, secret=None):
    """A token as no library would make it."""
    signed = f"{base64url(json.dumps(header).encode())}.{payload}"
    return f"{signed}.{'' if secret is None else base64url(hmac.digest(secret, signed.encode(), 'sha256'))}"


def base64url(data):
    return base64.urlsafe_b64encode(data).decode().rstrip("=")


@pytest.mark.parametrize("encoding", [serialization.Encoding.DER, serialization.Encoding.PEM])
def test_a_token_signed_with_the_public_key_as_a_shared_secret_is_refused(guarded, issuer, problem, encoding):
    public = issuer.private["one"].public_key().public_bytes(encoding, serialization.PublicFormat.SubjectPublicKeyInfo)
    payload = issuer.token(scope="grip.rule").split(".")[1]

    problem(ask(guarded, forged({"alg": "HS256", "kid": "one"}, payload, public)), 401)


def test_a_shared_secret_that_the_issuer_publishes_by_mistake_signs_nothing(guarded, issuer, problem):
    secret = b"s" * 32
    issuer.publish({"kid": "shared", "kty": "oct", "k": base64url(secret)}, {"kid": "odd", "kty": "new"})

    problem(ask(guarded, issuer.token("shared", key=secret, algorithm="HS256", scope="grip.rule")), 401)
    assert ask(guarded, issuer.token(scope="grip.see")).status_code == 200, "keys beside it are used"


def test_an_unsigned_token_is_refused(guarded, issuer, problem):
    payload = issuer.token(scope="grip.rule").split(".")[1]

    problem(ask(guarded, forged({"alg": "none", "kid": "one"}, payload)), 401)


def test_a_changed_token_is_refused(guarded, issuer, problem):
    header, _, signature = issuer.token(scope="grip.see").split(".")
    payload = issuer.token(scope="grip.rule").split(".")[1]

    problem(ask(guarded, f"{header}.{payload}.{signature}"), 401)


def test_keys_are_fetched_once_and_again_for_a_new_one_but_not_for_every_invented_one(guarded, issuer, monkeypatch, problem):
    for _ in range(3):
        assert ask(guarded, issuer.token(scope="grip.see")).status_code == 200
    assert issuer.asked == ["/.well-known/openid-configuration", "/keys"]
    issuer.private["two"] = rsa.generate_private_key(public_exponent=65537, key_size=2048)
    issuer.publish()

    problem(ask(guarded, issuer.token("two", scope="grip.see")), 401)
    assert issuer.asked.count("/keys") == 1, "asked a moment ago"
    monkeypatch.setattr(tokens, "_PAUSE_S", 0.0)
    assert ask(guarded, issuer.token("two", scope="grip.see")).status_code == 200
    assert issuer.asked.count("/keys") == 2


def test_a_key_that_is_published_no_longer_ends_with_the_time_that_keys_are_believed(guarded, issuer, monkeypatch, problem):
    token = issuer.token("one", scope="grip.see")
    assert ask(guarded, token).status_code == 200
    issuer.documents["/keys"] = {"keys": []}
    monkeypatch.setattr(tokens, "_PAUSE_S", 0.0)

    assert ask(guarded, token).status_code == 200
    monkeypatch.setattr(tokens, "_LIVE_S", 0.0)

    assert ask(guarded, token).status_code == 503
    monkeypatch.setattr(tokens, "_LIVE_S", 3600.0)
    problem(ask(guarded, token), 401)


@pytest.mark.parametrize(
    "documents",
    [
        {},
        {"/.well-known/openid-configuration": {"issuer": "https://other.example", "jwks_uri": "HERE/keys"}},
        {"/.well-known/openid-configuration": {"issuer": "HERE", "jwks_uri": "http://192.0.2.1/keys"}},
        {"/.well-known/openid-configuration": {"issuer": "HERE"}},
        {"/.well-known/openid-configuration": ["HERE"]},
        {"/.well-known/openid-configuration": {"issuer": "HERE", "jwks_uri": "HERE/keys"}, "/keys": {"none": []}},
    ],
)
def test_an_issuer_that_does_not_answer_as_it_should_lets_nobody_in_and_is_no_fault_of_the_caller(
    guarded, issuer, problem, documents
):
    issuer.documents = json.loads(json.dumps(documents).replace("HERE", issuer.url))

    answer = ask(guarded, issuer.token(scope="grip.see"))

    problem(answer, 503, "not-ready")
    assert answer.headers["Retry-After"] == "5"


def test_a_token_is_no_key_where_no_issuer_is_set(client, issuer, problem):
    assert "no issuer of tokens is set" in problem(ask(client, issuer.token(scope="grip.see")), 401)["detail"]


def test_who_a_token_stands_for_is_in_the_audit_trail(guarded, issuer):
    ask(guarded, issuer.token(scope="grip.do", preferred_username="Ada"), "POST", "/api/v1/jobs/none/cancel")

    (row,) = ask(guarded, issuer.token(scope="grip.rule"), path="/api/v1/audit").json()["items"]

    assert (row["actor"], row["actor_name"], row["status"]) == ("token:robot-7", "Ada", 404)


@pytest.mark.parametrize(
    "fields",
    [
        {"oidc_issuer": "http://issuer.example", "oidc_audience": "x"},
        {"oidc_issuer": "issuer.example", "oidc_audience": "x"},
        {"oidc_issuer": "https://issuer.example"},
        {"oidc_audience": "x"},
        {"oidc_scopes": {"all": "everything"}},
        {"cors_origins": ["*"]},
        {"cors_origins": ["https://plm.example/"]},
        {"audit_days": 0},
    ],
)
def test_settings_that_would_open_a_hole_are_refused(fields):
    with pytest.raises(ValidationError):
        Settings(**fields)
