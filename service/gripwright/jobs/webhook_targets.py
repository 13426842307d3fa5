"""Where messages may go, and sending one there: to an address that was checked, within a time, reading little of the answer."""

import asyncio
import email.utils
import ipaddress
import socket
import ssl
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, NamedTuple

import httpx

from gripwright.domain.errors import Fault, InvalidInput

Address = ipaddress.IPv4Address | ipaddress.IPv6Address

TIMEOUT_S = 15.0
"""Of one attempt in all, from the name's resolution to the end of the answer's first bytes."""

_CONNECT_S = 5.0
_ANSWER_BYTES = 1024
_NAT64 = ipaddress.IPv6Network("64:ff9b::/96")
_V4_COMPATIBLE = ipaddress.IPv6Network("::/96")
_CLOUD = ipaddress.IPv4Address("168.63.129.16")  # public by its number, and the host of the virtual machines by its use


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What came of an attempt."""

    duration_s: float
    status_code: int | None = None
    error: str = ""  # "" where the message was accepted
    response: str = ""
    retry_after_s: float = 0.0  # that the receiver asked for


class _Target(NamedTuple):
    host: str
    port: int
    addresses: list[str]


def check_target(url: str, *, allow_private: bool) -> None:
    """InvalidInput where the URL holds a password, or the host does not resolve, or to an address that is not public."""
    try:
        host, port = _host_of(url)
        if httpx.URL(url).userinfo:
            raise _refused("a user name or password in it would be shown to everybody who may read")
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except httpx.InvalidURL as error:
        raise _refused(f"it is no URL: {error}") from None
    except (OSError, UnicodeError) as error:
        raise _refused(f"the host does not resolve: {error}") from None
    _checked(host, found, allow_private=allow_private)


def is_public(address: Address) -> bool:
    """Whether it is an address of the public internet, also where it stands for another one."""
    if isinstance(address, ipaddress.IPv6Address):
        inner = address.ipv4_mapped or address.sixtofour or (address.teredo[1] if address.teredo else None)
        if inner is None and (address in _NAT64 or address in _V4_COMPATIBLE):
            inner = ipaddress.IPv4Address(int(address) & 0xFFFFFFFF)
        if inner is not None:
            return is_public(inner)
        if address.is_site_local:
            return False
    return address.is_global and not address.is_multicast and not address.is_reserved and address != _CLOUD


class Sender:
    """Sends messages; any number of threads may use it."""

    def __init__(self, *, allow_private: bool, timeout_s: float = TIMEOUT_S) -> None:
        self._allow_private, self._timeout_s = allow_private, timeout_s
        self._certificates: ssl.SSLContext = httpx.create_ssl_context()  # SSL_CERT_FILE names others

    def send(self, url: str, payload: str, headers: Mapping[str, str], now: datetime) -> Outcome:
        """Send a message once."""
        started_s = time.monotonic()
        status_code, response, retry_after_s = None, "", 0.0
        try:
            answer, response = asyncio.run(self._within_limits(url, payload, headers))
            status_code, retry_after_s = answer.status_code, _retry_after_s(answer.headers.get("retry-after", ""), now)
            error = "" if answer.is_success else f"answered {status_code}"
        except InvalidInput as refusal:
            error = refusal.faults[0].message
        except TimeoutError:
            error = f"took more than {self._timeout_s:g} s"
        except (httpx.HTTPError, httpx.InvalidURL, OSError) as failure:
            error = f"{type(failure).__name__}: {failure}"
        return Outcome(
            duration_s=time.monotonic() - started_s,
            status_code=status_code,
            error=_text(error.encode())[:1000],
            response=response,
            retry_after_s=retry_after_s,
        )

    async def _within_limits(self, url: str, payload: str, headers: Mapping[str, str]) -> tuple[httpx.Response, str]:
        async with asyncio.timeout(self._timeout_s):
            target = await self._resolve(url)
            for address in target.addresses[:-1]:
                try:
                    return await self._post(url, target, address, payload, headers)
                except httpx.ConnectError:
                    continue  # the host has further addresses
            return await self._post(url, target, target.addresses[-1], payload, headers)

    async def _resolve(self, url: str) -> _Target:
        host, port = _host_of(url)
        try:
            found = await asyncio.get_running_loop().getaddrinfo(host, port, type=socket.SOCK_STREAM)
        except (OSError, UnicodeError) as error:
            raise _refused(f"the host does not resolve: {error}") from None
        return _Target(host, port, _checked(host, found, allow_private=self._allow_private))

    async def _post(
        self, url: str, target: _Target, address: str, payload: str, headers: Mapping[str, str]
    ) -> tuple[httpx.Response, str]:
        """To that very address: the name is not asked for again, which might say something else by then."""
        given = httpx.URL(url)
        client = httpx.AsyncClient(
            verify=self._certificates,
            follow_redirects=False,
            trust_env=False,  # a proxy would resolve the name itself
            timeout=httpx.Timeout(self._timeout_s, connect=_CONNECT_S),
        )
        async with client:
            request = client.build_request(
                "POST",
                given.copy_with(host=address),
                content=payload,
                headers={**headers, "host": given.netloc.decode("ascii"), "accept-encoding": "identity"},
                extensions={"sni_hostname": target.host},
            )
            answer = await client.send(request, stream=True)
            read = b""
            async for chunk in answer.aiter_raw():
                read += chunk
                if len(read) >= _ANSWER_BYTES:
                    break
            await answer.aclose()
        return answer, _text(read[:_ANSWER_BYTES])


def _host_of(url: str) -> tuple[str, int]:
    given = httpx.URL(url)
    return given.raw_host.decode("ascii"), given.port or (443 if given.scheme == "https" else 80)


def _checked(host: str, found: Sequence[tuple[Any, ...]], *, allow_private: bool) -> list[str]:
    """The addresses, without repetitions; InvalidInput where one of them is not public."""
    addresses = list(dict.fromkeys(str(address[0]) for *_, address in found))
    for address in addresses:
        if not allow_private and not is_public(ipaddress.ip_address(address.partition("%")[0])):
            raise _refused(f"{host} is {address}, which is not a public address")
    return addresses


def _refused(reason: str) -> InvalidInput:
    return InvalidInput("the webhook's target is refused", faults=(Fault(pointer="/url", message=reason),))


def _retry_after_s(value: str, now: datetime) -> float:
    """Seconds, given as such or as a date; 0 where it is neither."""
    if value.strip().isascii() and value.strip().isdigit():
        return float(value)
    try:
        return max(0.0, (email.utils.parsedate_to_datetime(value) - now).total_seconds())
    except (ValueError, TypeError):
        return 0.0


def _text(data: bytes) -> str:
    """Text that every database stores and every terminal can show."""
    text = data.decode("utf-8", "replace")
    return "".join(character if character.isprintable() or character == "\n" else "?" for character in text)
