"""The tables that moves were made by: what their files say now, or what they said before (docs/tables.md, Revisions), or what the
log of moves itself says of tables that are no files."""

import pathlib
import sqlite3
import tomllib

from check_trace.motion import Table
from check_trace.problems import InputError

MACHINE_TABLES = pathlib.Path("/etc/bushd/tables")
MACHINE_HISTORY = pathlib.Path("/var/lib/bushd/tables/history.sqlite")


class Tables:
    def __init__(self):
        self._known = {}

    def of(self, event):
        """The table that an event names."""
        which = event["table_file"], event["table_sha256"]
        if which not in self._known:
            self._known[which] = find_table(*which)
        return self._known[which]

    def told(self, event):
        """The codes of a table that is no file."""
        table = Table(event["name"], event)
        if table.sha256() != event["table_sha256"]:
            raise InputError(f"table {event['name']} has the SHA-256 {table.sha256()}, not {event['table_sha256']}")
        self._known["", event["table_sha256"]] = table


def find_table(file, sha256):
    path = pathlib.Path(file)
    try:
        texts = [path.read_text(encoding="utf-8")]
    except OSError:
        texts = []
    for text in [*texts, *earlier(path)]:
        try:
            table = Table(file, tomllib.loads(text))
        except tomllib.TOMLDecodeError as error:
            raise InputError(f"{file}: table cannot be read: {error!r}") from None
        if table.sha256() == sha256:
            return table
    raise InputError(f"{file}: neither it nor its history has the table of SHA-256 {sha256}")


def earlier(path):
    """The texts of the table's revisions, the newest first."""
    history = MACHINE_HISTORY if path.parent == MACHINE_TABLES else path.parent / ".history.sqlite"
    if not history.exists():
        return []
    try:
        with sqlite3.connect(f"file:{history}?mode=ro", uri=True) as database:
            rows = database.execute("SELECT text FROM revision WHERE name = ? ORDER BY number DESC", (path.stem,))
            return [text.decode() if isinstance(text, bytes) else text for (text,) in rows]
    except sqlite3.Error as error:
        raise InputError(f"{history}: {error}") from None
