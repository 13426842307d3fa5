"""How a distribution announces its plug-ins: a static manifest behind the entry point group `gripwright.plugins`."""

from dataclasses import dataclass

API_VERSION = "1.2"
"""Version of the contract. A plug-in made for 1.x loads with every later 1.y."""

ENTRY_POINT_GROUP = "gripwright.plugins"

KINDS = ("segmenter", "fitter", "affordance", "rule", "hand", "planner", "holding", "optimizer", "finger", "policy")


@dataclass(frozen=True, slots=True, kw_only=True)
class PluginEntry:
    """One plug-in: its kind, key and where its class is, as `module:Class`. `primitives` names the classes it returns.

    `samples` is what `plugins check` asks it besides the built-in samples, a function without arguments as `module:function`;
    nothing else imports it.
    """

    kind: str
    key: str
    target: str
    primitives: tuple[str, ...] = ()  # "module:Class" of primitives of its own
    samples: str = ""  # "module:function", returns `gripwright.testing.Sample`s and, for rules, primitives


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """What the entry point must resolve to. `version` is stored with results: raise it when they change."""

    version: str
    api_version: str
    plugins: tuple[PluginEntry, ...]
    name: str = ""  # deprecated since 1.2
