"""The documents name everything that there is, and point at nothing that there is not."""

import inspect
import re
import tomllib
from pathlib import Path

import pytest
from pydantic import BaseModel

from gripwright.cli import COMMANDS
from gripwright.design.plan import Plan
from gripwright.plugin_api import contracts
from gripwright.plugin_api.checks import PROTOCOLS
from gripwright.plugin_api.deprecation import DEPRECATIONS
from gripwright.plugin_api.manifest import API_VERSION
from gripwright.registry.plans import CHOICES
from gripwright.settings import Settings

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "plugins").rglob("*.md")])
README = (ROOT / "README.md").read_text(encoding="utf-8")
CONTRACT = (ROOT / "docs/plugins/contract.md").read_text(encoding="utf-8")
OPERATIONS = (ROOT / "docs/operations.md").read_text(encoding="utf-8")
DEPLOYMENT = "".join((ROOT / "docker" / name).read_text(encoding="utf-8") for name in ("Dockerfile", "compose.yaml"))

_CODE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\]\(([^)\s]+)\)")
_HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)
_ROW = re.compile(r"^\| `([a-z_.]+)` \| `([^`]*)` \| (.+) \|$", re.MULTILINE)

OPTIONS = {name: default for name, default, _ in _ROW.findall(README)}
VARIABLES = {"GRIPWRIGHT_DATA" if name == "data_dir" else f"GRIPWRIGHT_{name.upper()}" for name in Settings.model_fields}


def plan_defaults() -> dict[str, object]:
    """Of every option of the plan; one that has fields of its own is given by these."""
    defaults: dict[str, object] = {}
    for name, field in Plan.model_fields.items():
        if isinstance(field.default, BaseModel):
            defaults |= {f"{name}.{inner}": value for inner, value in field.default}
        elif name != "params":
            defaults[name] = field.default
    return defaults


def headings(text: str) -> list[str]:
    return _HEADING.findall(_CODE.sub("", text))


def anchors(text: str) -> set[str]:
    """As GitHub makes them of headings."""
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings(text)}


def section(text: str, heading: str) -> str:
    _, _, rest = text.partition(f"\n## {heading}\n")
    return rest.partition("\n## ")[0]


def protocols() -> dict[str, type]:
    members = inspect.getmembers(contracts, inspect.isclass)
    return {name: member for name, member in members if member.__module__ == contracts.__name__}


@pytest.mark.parametrize("name", sorted(protocols()))
def test_every_protocol_has_a_section_that_names_its_members(name: str) -> None:
    members = {member for member in {*vars(protocols()[name]), *protocols()[name].__annotations__} if not member.startswith("_")}

    described = section(CONTRACT, name)

    assert described
    assert [member for member in sorted(members) if member not in described] == []


@pytest.mark.parametrize("kind", sorted(PROTOCOLS))
def test_every_kind_of_plugin_and_its_option_is_named_in_the_contract(kind: str) -> None:
    option = next(field for field, chosen in CHOICES.items() if chosen == kind)

    assert f"`{kind}`" in section(CONTRACT, "Plugin")
    assert f"Plan option: `{option}`" in section(CONTRACT, PROTOCOLS[kind].__name__)


def test_the_version_of_the_contract_and_what_is_deprecated_in_it_are_those_described() -> None:
    described = section(CONTRACT, "Versions")

    assert f"This is version {API_VERSION} " in described
    assert re.findall(r"^\| `(\w+\.\w+)` \| (\S+) \| (.+) \|$", described, re.MULTILINE) == [
        (f"{one.owner}.{one.member}", one.since, one.instead) for one in DEPRECATIONS
    ]


@pytest.mark.parametrize("option", sorted(plan_defaults()))
def test_every_option_of_the_plan_has_a_row_with_its_default(option: str) -> None:
    default = plan_defaults()[option]

    assert OPTIONS.get(option) == (",".join(default) if isinstance(default, tuple) else str(default))


def test_every_option_in_the_readme_exists() -> None:
    assert set(OPTIONS) <= set(plan_defaults())


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_every_command_is_in_the_readme(command: str) -> None:
    assert re.search(rf"^\| `gripwright {command}\b", README, re.MULTILINE)


def test_every_target_of_make_that_a_page_names_exists() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    named = {target for page in PAGES for target in re.findall(r"`make ([a-z-]+)`", page.read_text(encoding="utf-8"))}

    assert named <= targets


def test_the_settings_described_are_the_settings_there_are() -> None:
    assert set(re.findall(r"`(GRIPWRIGHT_[A-Z_]+)`", section(OPERATIONS, "Settings"))) == VARIABLES


def test_containers_set_only_variables_that_are_read() -> None:
    assert set(re.findall(r"GRIPWRIGHT_[A-Z_]+", DEPLOYMENT)) <= VARIABLES


def test_every_dependency_has_a_reason_and_a_licence() -> None:
    (record,) = (ROOT / "docs/decisions").glob("*-dependencies.md")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    rows = re.findall(r"^\| ([^|]+) \| [^|]+ \| [^|]+ \|$", record.read_text(encoding="utf-8"), re.MULTILINE)
    described = {name.strip() for row in rows for name in row.split(",")}

    assert {re.split(r"[=<>~!\[; ]", dependency)[0] for dependency in project["dependencies"]} <= described


def test_every_record_is_listed_and_has_its_four_sections() -> None:
    records = sorted((ROOT / "docs/decisions").glob("[0-9]*.md"))
    index = (ROOT / "docs/decisions/README.md").read_text(encoding="utf-8")

    assert [record.name for record in records if f"({record.name})" not in index] == []
    for record in records:
        assert headings(record.read_text(encoding="utf-8"))[1:] == ["Context", "Decision", "Consequences", "Alternatives"], (
            record.name
        )


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_relative_link_leads_somewhere(page: Path) -> None:
    broken = []
    for link in _LINK.findall(_CODE.sub("", page.read_text(encoding="utf-8"))):
        name, _, anchor = link.partition("#")
        target = (page.parent / name) if name else page
        if "://" in link or (target.exists() and (not anchor or anchor in anchors(target.read_text(encoding="utf-8")))):
            continue
        broken.append(link)

    assert broken == []
