"""names.toml: which motor has which name in EPICS, and which hosts may put."""

from __future__ import annotations

import dataclasses
import re
import tomllib
from collections.abc import Mapping
from typing import Any

from .access import LOCAL

MOST_AXES = 16  # of a profile
MAX_NAME = 60  # of a process variable, with prefix and field
_NAME = re.compile(r"[A-Za-z0-9_\-+:\[\]<>;]+")


class BadNames(Exception):
    """The file is not as it should be; the text names the key."""


@dataclasses.dataclass(frozen=True)
class Names:
    motors: Mapping[str, str]  # by motor as bushd has it; "": it is not shown
    hosts: tuple[str, ...]
    profiles: Mapping[str, tuple[str, ...]] = dataclasses.field(default_factory=dict)  # motors as bushd has them: M1, M2 and so on

    def of(self, motor: str) -> str:
        """What comes after the prefix; characters that EPICS has not are underscores."""
        named = self.motors.get(motor)
        return named if named is not None else re.sub(r"[^A-Za-z0-9_\-+:\[\]<>;]", "_", motor)


NONE = Names({}, LOCAL)


def read(path: str) -> Names:
    """Raises BadNames, OSError."""
    with open(path, "rb") as file:
        try:
            return parse(tomllib.load(file))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise BadNames(f"{path}: {error}") from None
        except BadNames as error:
            raise BadNames(f"{path}: {error}") from None


def parse(content: Mapping[str, Any]) -> Names:
    unknown = set(content) - {"names", "allow", "profiles"}
    if unknown:
        raise BadNames(f"{sorted(unknown)[0]}: unknown key; allowed here: names, allow, profiles")
    names, allow = content.get("names", {}), content.get("allow", {})
    if not isinstance(names, dict) or not isinstance(allow, dict):
        raise BadNames("names and allow are tables: [names], [allow]")
    if set(allow) - {"hosts"}:
        raise BadNames(f"allow.{sorted(set(allow) - {'hosts'})[0]}: unknown key; allowed here: hosts")
    hosts = allow.get("hosts", list(LOCAL))
    if not isinstance(hosts, list) or not all(isinstance(host, str) and host for host in hosts):
        raise BadNames('allow.hosts: a list of names and addresses, such as ["10.0.5.0/24", "console1"]')
    for motor, name in names.items():
        if not isinstance(name, str) or not (name == "" or _NAME.fullmatch(name)):
            raise BadNames(f'names.{motor}: a text of letters, digits and _-+:[]<>; or "" for a motor that is not shown')
    shown = [name for name in names.values() if name]
    twice = next((name for name in shown if shown.count(name) > 1), None)
    if twice is not None:
        raise BadNames(f"names: {twice} is the name of two motors")
    return Names(dict(names), tuple(hosts), _profiles(content.get("profiles", {})))


def _profiles(content: Any) -> Mapping[str, tuple[str, ...]]:
    if not isinstance(content, dict):
        raise BadNames("profiles is a table: [profiles]")
    for name, motors in content.items():
        if not _NAME.fullmatch(name):
            raise BadNames(f"profiles.{name}: letters, digits and _-+:[]<>; are allowed")
        listed = motors if isinstance(motors, list) and all(isinstance(motor, str) and motor for motor in motors) else []
        if not 1 <= len(listed) <= MOST_AXES or len(set(listed)) < len(listed):
            raise BadNames(f'profiles.{name}: a list of 1 to {MOST_AXES} motors, each once, such as ["theta", "phi"]')
    return {name: tuple(motors) for name, motors in content.items()}
