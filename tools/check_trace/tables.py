"""The table that a move was made by: what its file says now, or what it said before (docs/tables.md, Revisions)."""

import pathlib
import sqlite3

from check_trace.motion import Table
from check_trace.problems import InputError

MACHINE_TABLES = pathlib.Path("/etc/bushd/tables")
MACHINE_HISTORY = pathlib.Path("/var/lib/bushd/tables/history.sqlite")


def find_table(file, sha256):
    path = pathlib.Path(file)
    try:
        texts = [path.read_text(encoding="utf-8")]
    except OSError:
        texts = []
    for text in [*texts, *earlier(path)]:
        table = Table(file, text)
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
