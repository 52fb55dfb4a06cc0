"""The program bushd-epics."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import logging
import os
import pathlib
import re
import signal
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

from . import names as names_file
from . import screens

if TYPE_CHECKING:  # they need caproto
    from .daemon import Daemon
    from .pva import Pva
    from .server import Server

REMEDY = "connect(PATH) ($BUSHD_CONTROL), or connect(lcm=True)"  # of programs in Python
LOG = logging.getLogger("bushd-epics")


def main(arguments: list[str] | None = None) -> int:
    options = _parse(arguments)
    logging.basicConfig(format="%(name)s: %(message)s", level=logging.ERROR if options.list or options.screens else logging.INFO)
    logging.getLogger("caproto").setLevel(logging.WARNING)
    # Beacons are for clients that wait for a server to appear; that nobody listens to them is no fault.
    logging.getLogger("caproto.ctx").addFilter(lambda record: "beacon" not in str(record.msg))
    try:
        names = names_file.read(options.names) if options.names else names_file.NONE
    except (OSError, names_file.BadNames) as error:
        print(f"bushd-epics: {error}", file=sys.stderr)
        return 2
    try:
        return asyncio.run(_run(options, names))
    except ImportError as error:
        print(f"bushd-epics: {error}: it needs caproto (pip install caproto)", file=sys.stderr)
        return 2


def _parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="bushd-epics", description="Motor records of EPICS, by Channel Access, for the motors of bushd.")
    parser.add_argument("--prefix", required=True, help="what all names begin with, such as LAB:")
    parser.add_argument(
        "--daemon", action="append", metavar="[NAME=]SOCKET", default=[],
        help="control socket of a daemon; may be repeated. With NAME its motors are PREFIX NAME: MOTOR. Default: that of this PC",
    )
    parser.add_argument("--names", metavar="FILE", help="names.toml: other names of motors, and which hosts may put")
    parser.add_argument("--read-only", action="store_true", help="nobody may put")
    parser.add_argument(
        "--leave-failed-moves-unanswered", action="store_true",
        help="for ophyd-async 0.21, which takes a failed put for a good one: it runs into its timeout instead",
    )
    parser.add_argument("--interface", action="append", metavar="ADDRESS", help="to listen at; may be repeated. Default: all")
    parser.add_argument("--no-pva", action="store_true", help="Channel Access alone, also where p4p is installed")
    parser.add_argument(
        "--longest-jog-s", type=float, default=60.0, metavar="SECONDS",
        help="a jog ends so long after JOGF or JOGR was put to 1 last. Default: 60",
    )
    instead = parser.add_mutually_exclusive_group()
    instead.add_argument("--list", action="store_true", help="print the names of all variables, and end")
    instead.add_argument("--screens", metavar="DIR", type=pathlib.Path, help="write screens of Phoebus for all motors to this folder, and end")
    options = parser.parse_args(arguments)
    if not re.fullmatch(r"[A-Za-z0-9_\-+:\[\]<>;]+", options.prefix):
        parser.error(f"--prefix {options.prefix}: letters, digits and _-+:[]<>; are allowed")
    if not 0 < options.longest_jog_s <= 86400:
        parser.error(f"--longest-jog-s {options.longest_jog_s:g}: above 0, up to 86400")
    return options


async def _run(options: argparse.Namespace, names: names_file.Names) -> int:
    from .access import Access
    from .daemon import Daemon
    from .server import Server

    server = Server(options.prefix, Access(names.hosts, options.read_only), options.interface)
    server.jogs.longest_s = options.longest_jog_s
    server.answers_failed_moves = not options.leave_failed_moves_unanswered
    daemons = []
    for given in options.daemon or [""]:
        name, equals, socket = given.rpartition("=") if re.match(r"[A-Za-z0-9_\-]+=", given) else ("", "", given)
        begins = f"{options.prefix}{name}:" if equals else options.prefix

        def record_name(motor: str, begins: str = begins) -> str:
            shown = names.of(motor)
            return f"{begins}{shown}" if shown else ""

        daemons.append(Daemon(socket or None, record_name, server))
        server.add_daemon(daemons[-1])
        for profile, motors in names.profiles.items():
            server.add_profile(daemons[-1], f"{begins}{profile}:", motors)
    server.make_common()
    following = [asyncio.create_task(daemon.run()) for daemon in daemons]
    try:
        if options.list:
            return await _tell_once(daemons, lambda: print("\n".join(server.names())))
        if options.screens:
            return await _tell_once(daemons, lambda: _write_screens(options.screens, options.prefix, server.records()))
        # Names are those of motors: until one daemon has told them there is nothing to be shown.
        appearing = [asyncio.create_task(daemon.appeared.wait()) for daemon in daemons]
        await asyncio.wait([*appearing, *following], return_when=asyncio.FIRST_COMPLETED)
        pva = None if options.no_pva else _serve_pva(server, options.interface)
        try:
            return await _serve(server, following)
        finally:
            if pva is not None:
                pva.stop()
    finally:
        for task in following:
            task.cancel()
        await asyncio.gather(*following, return_exceptions=True)


async def _tell_once(daemons: list[Daemon], tell: Callable[[], None]) -> int:
    """When all daemons have told their motors."""
    await asyncio.gather(*(daemon.told.wait() for daemon in daemons))
    failed = [daemon.why.replace(REMEDY, "--daemon PATH") for daemon in daemons if daemon.why]
    if not failed:
        try:
            tell()
        except (screens.NotOurs, OSError) as error:
            failed = [str(error)]
    for why in failed:
        print(f"bushd-epics: {why}", file=sys.stderr)
    return 1 if failed else 0


def _write_screens(folder: pathlib.Path, prefix: str, records: list[str]) -> None:
    screens.write(folder, screens.make(prefix, records))
    print(f"{folder / 'overview.bob'}: {len(records)} motors and axes")


def _serve_pva(server: Server, interfaces: list[str] | None) -> Pva | None:
    """Where p4p is installed: it has no wheel for some machines, and Debian does not have it."""
    try:
        from .pva import Pva

        pva = Pva(server, interfaces, in_environment="EPICS_PVAS_INTF_ADDR_LIST" in os.environ)
    except ImportError as error:
        LOG.info("Channel Access alone: PV Access needs p4p (%s)", error)
        return None
    except RuntimeError as error:
        LOG.warning("Channel Access alone: PV Access cannot be served: %s", error)
        return None
    LOG.info("PV Access as well")
    return pva


async def _serve(server: Server, following: list[asyncio.Task[None]]) -> int:
    """Until a signal ends it, or a part of it that must not end."""
    serving = asyncio.create_task(server.run())
    loop = asyncio.get_running_loop()
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, serving.cancel)
    LOG.info("ready")
    others = [*following, asyncio.create_task(server.look_up_names()), asyncio.create_task(server.watch_jogs())]
    await asyncio.wait([serving, *others], return_when=asyncio.FIRST_COMPLETED)
    broken = [task for task in others if task.done()]
    for task in broken:
        LOG.error("a part of it has ended, so all of it does", exc_info=task.exception())
    for task in (serving, *others):
        task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await serving
    return 1 if broken else 0
