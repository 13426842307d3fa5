import datetime
import ipaddress
import socket
import ssl
import time

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from gripwright.domain.errors import InvalidInput
from gripwright.jobs.webhook_signing import signature, signed_headers
from gripwright.jobs.webhook_targets import Sender, check_target, is_public
from gripwright.store.columns import utc_now
from webhook_receiver import receiving

SECRET = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw"
MESSAGE = ("msg_p5jXN8AQM9LWM0D4loKWxJek", 1614265330, '{"test": 2432232314}')


def test_signatures_are_those_of_the_standard():
    assert signature(SECRET, *MESSAGE) == "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE="
    headers = signed_headers([SECRET, SECRET], *MESSAGE)
    assert headers["webhook-signature"] == " ".join(["v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE="] * 2)


@pytest.mark.parametrize(
    "host",
    [
        "127.0.0.1", "10.0.0.1", "172.16.0.1", "192.168.1.1", "[::1]", "[::]", "0.0.0.0", "localhost", "2130706433", "0x7f.1",
        "169.254.169.254", "100.100.100.200", "168.63.129.16", "100.64.0.1", "[fd00:ec2::254]", "[fe80::1]", "[fec0::1]",
        "[::ffff:127.0.0.1]", "[::ffff:10.0.0.1]", "[::127.0.0.1]", "[64:ff9b::7f00:1]", "[64:ff9b:1::7f00:1]",
        "[2002:7f00:1::]", "[2001:0:5ef5:79fb:0:0:80ff:fffe]", "224.0.0.1", "[ff02::1]", "255.255.255.255", "240.0.0.1",
        "198.18.0.1", "192.0.2.1", "[2001:db8::1]",
    ],
)  # fmt: skip
def test_targets_that_are_not_public_are_refused_unless_allowed(host):
    with pytest.raises(InvalidInput) as refused:
        check_target(f"http://{host}/hook", allow_private=False)

    assert "not a public address" in refused.value.faults[0].message


@pytest.mark.parametrize("address", ["1.1.1.1", "2606:4700::1111", "::ffff:1.1.1.1", "64:ff9b::101:101"])
def test_public_addresses_are_public_however_they_are_written(address):
    assert is_public(ipaddress.ip_address(address))


@pytest.mark.parametrize("url", ["http://ada:secret@1.1.1.1/", f"http://{'a' * 64}.example/", "http://no.such.host.invalid/"])
def test_what_is_no_target_is_refused(url):
    with pytest.raises(InvalidInput):
        check_target(url, allow_private=True)


def certificate(folder, name):
    """Files of a key and of a certificate for that host, which is its own authority."""
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    now = datetime.datetime.now(datetime.UTC)
    builder = x509.CertificateBuilder(subject, subject, key.public_key(), x509.random_serial_number())
    builder = builder.not_valid_before(now - datetime.timedelta(days=1)).not_valid_after(now + datetime.timedelta(days=1))
    builder = builder.add_extension(x509.SubjectAlternativeName([x509.DNSName(name)]), critical=False)
    builder = builder.add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True)
    made = builder.sign(key, hashes.SHA256())
    (folder / "cert.pem").write_bytes(made.public_bytes(serialization.Encoding.PEM))
    private = (serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    (folder / "key.pem").write_bytes(key.private_bytes(*private))
    return folder / "cert.pem", folder / "key.pem"


@pytest.fixture
def names(monkeypatch):
    """Answers of the resolver, one a question and the last one again: a name server that changes its mind."""
    answers, asked, resolve = {}, [], socket.getaddrinfo

    def getaddrinfo(host, port, *args, **kwargs):
        asked.append(host)
        known = answers.get(host)
        return resolve(host if known is None else known.pop(0) if len(known) > 1 else known[0], port, *args, **kwargs)

    monkeypatch.setattr(socket, "getaddrinfo", getaddrinfo)
    answers["asked"] = asked
    return answers


def test_the_connection_goes_to_the_address_that_was_checked_with_the_name_in_tls_and_host(tmp_path, monkeypatch, names):
    cert, key = certificate(tmp_path, "plm.example")
    monkeypatch.setenv("SSL_CERT_FILE", str(cert))
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(cert, key)
    told = []
    context.sni_callback = lambda connection, name, _: told.append(name)
    names["plm.example"] = ["127.0.0.1", "203.0.113.7"]
    names["other.example"] = ["127.0.0.1"]

    with receiving(context) as server:
        sender = Sender(allow_private=True)
        sent = sender.send(f"https://plm.example:{server.server_port}/hook", "{}", {}, utc_now())
        wrong = sender.send(f"https://other.example:{server.server_port}/hook", "{}", {}, utc_now())

    assert (sent.status_code, sent.error) == (204, "")
    assert names["asked"].count("plm.example") == 1
    assert told[0] == "plm.example"
    ((headers, _),) = server.received
    assert headers["host"] == f"plm.example:{server.server_port}"
    assert "CERTIFICATE_VERIFY_FAILED" in wrong.error


def test_a_name_that_turns_private_after_it_was_accepted_is_not_connected_to(names):
    names["plm.example"] = ["1.1.1.1", "127.0.0.1"]
    with receiving() as server:
        url = f"http://plm.example:{server.server_port}/hook"
        check_target(url, allow_private=False)

        outcome = Sender(allow_private=False).send(url, "{}", {}, utc_now())

    assert outcome.error == "plm.example is 127.0.0.1, which is not a public address"
    assert server.received == []


def test_redirects_are_not_followed_and_a_proxy_of_the_environment_is_not_used(monkeypatch):
    monkeypatch.setenv("HTTP_PROXY", "http://127.0.0.1:9")
    with receiving() as server:
        server.answer, server.headers = 302, {"Location": server.url}
        outcome = Sender(allow_private=True).send(server.url, "{}", {}, utc_now())

    assert outcome.error == "answered 302"
    assert len(server.received) == 1


def test_an_answer_that_never_ends_or_never_begins_takes_no_longer_than_the_limit():
    for attributes in ({"trickles": 100, "answer": 200}, {"delay_s": 30}):
        with receiving() as server:
            vars(server).update(attributes)
            started_s = time.monotonic()
            outcome = Sender(allow_private=True, timeout_s=1.0).send(server.url, "{}", {}, utc_now())

        assert outcome.error == "took more than 1 s"
        assert time.monotonic() - started_s < 5.0


def test_of_a_long_answer_only_the_beginning_is_read():
    with receiving() as server:
        server.answer, server.body = 200, b"x" * 50_000_000
        outcome = Sender(allow_private=True).send(server.url, "{}", {}, utc_now())

    assert outcome.error == ""
    assert len(outcome.response) == 1024
