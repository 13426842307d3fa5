"""How much one client may ask for in a minute, and how often an address may show a credential that is none."""

import ipaddress
import math
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass

from gripwright.domain.access import ANYBODY, Principal
from gripwright.http.errors import TooManyRequests
from gripwright.settings import Settings

FAILURES_A_MINUTE = 10
"""Credentials that one address may have refused; after that it waits, whatever it shows."""

CLIENTS = 10_000
"""Clients that are remembered. Who was quiet longest is forgotten first, and by then mostly has all its requests again."""

_READS_A_MINUTE, _WRITES_A_MINUTE = 3000, 600  # where access is asked for
_MINUTE_S = 60.0
_IPV6_SITE_BITS = 64


@dataclass(slots=True)
class _Bucket:
    tokens: float
    filled_s: float


class Buckets:
    """A token bucket for each client: so many requests a minute, at most `burst` of them at once. Used by one thread."""

    def __init__(self, *, per_minute: int, burst: int) -> None:
        self.per_minute, self.burst = per_minute, burst
        self._buckets: OrderedDict[str, _Bucket] = OrderedDict()

    def wait_s(self, client: str, now_s: float) -> float:
        """How long until the client has a token; 0 where it has one."""
        return max(1.0 - self._filled(client, now_s).tokens, 0.0) * _MINUTE_S / self.per_minute

    def take(self, client: str, now_s: float) -> None:
        """Take one token."""
        self._filled(client, now_s).tokens -= 1.0

    def headers(self, name: str, client: str, now_s: float) -> Mapping[str, str]:
        """`RateLimit` and `RateLimit-Policy`: what is left, and when all of it is there again."""
        tokens = self._filled(client, now_s).tokens
        full_s = math.ceil((self.burst - tokens) * _MINUTE_S / self.per_minute)
        policy = f'"{name}";q={self.per_minute};w={_MINUTE_S:.0f}'
        return {"RateLimit-Policy": policy, "RateLimit": f'"{name}";r={max(int(tokens), 0)};t={full_s}'}

    def _filled(self, client: str, now_s: float) -> _Bucket:
        bucket = self._buckets.get(client)
        if bucket is None:
            bucket = self._buckets[client] = _Bucket(float(self.burst), now_s)
            if len(self._buckets) > CLIENTS:
                self._buckets.popitem(last=False)
        self._buckets.move_to_end(client)
        gained = (now_s - bucket.filled_s) * self.per_minute / _MINUTE_S
        bucket.tokens, bucket.filled_s = min(bucket.tokens + gained, float(self.burst)), now_s
        return bucket


class RateLimits:
    """The limits of a service: of requests by client, and of refused credentials by address."""

    def __init__(self, settings: Settings) -> None:
        asks = settings.asks_for_access
        self._requests = {
            "reads": _buckets(settings.rate_reads, _READS_A_MINUTE if asks else None, settings.rate_burst),
            "writes": _buckets(settings.rate_writes, _WRITES_A_MINUTE if asks else None, settings.rate_burst),
        }
        self._failures = Buckets(per_minute=FAILURES_A_MINUTE, burst=FAILURES_A_MINUTE)

    def check_address(self, address: str, now_s: float) -> None:
        """TooManyRequests where the address has shown too many credentials that are none."""
        wait_s = self._failures.wait_s(_site(address), now_s)
        if wait_s > 0:
            raise TooManyRequests(
                f"this address has shown more than {FAILURES_A_MINUTE} credentials a minute that are not valid",
                retry_after_s=math.ceil(wait_s),
            )

    def count_failure(self, address: str, now_s: float) -> None:
        """The address has shown a credential that is none."""
        self._failures.take(_site(address), now_s)

    def admit(self, principal: Principal, address: str, *, reads: bool, now_s: float) -> Mapping[str, str]:
        """The headers that tell the client its limit, if there is one; TooManyRequests, with them, where it is reached."""
        name = "reads" if reads else "writes"
        buckets = self._requests[name]
        if buckets is None:
            return {}
        client = f"address:{_site(address)}" if principal is ANYBODY else principal.actor
        wait_s = buckets.wait_s(client, now_s)
        if wait_s > 0:
            raise TooManyRequests(
                f"more than {buckets.per_minute} {name} a minute, or {buckets.burst} at once",
                retry_after_s=math.ceil(wait_s),
                headers=buckets.headers(name, client, now_s),
            )
        buckets.take(client, now_s)
        return buckets.headers(name, client, now_s)


def _buckets(chosen: int | None, default: int | None, burst: int) -> Buckets | None:
    per_minute = default if chosen is None else chosen
    return None if per_minute is None else Buckets(per_minute=per_minute, burst=burst)


def _site(address: str) -> str:
    """An address; of IPv6 the network that one site has, since each of its machines has as many addresses as it likes."""
    try:
        parsed = ipaddress.ip_address(address)
    except ValueError:
        return address
    if parsed.version == 4:
        return address
    return str(ipaddress.ip_network((parsed, _IPV6_SITE_BITS), strict=False))
