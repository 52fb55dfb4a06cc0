"""The rules by which a client speaks to the daemon, without I/O: bytes in, bytes out, the time is told.

A request is carried out exactly once although datagrams may be lost, repeated and reordered (docs/lcm.md of bushd,
"Sessions"). It is sent again with the same number until it is answered, and asked for again while its result is
awaited; the daemon carries out each number of a session once.

Whoever drives a `Session` hands over what has come (`receive`, `link_ended`), sends what `poll` returns, and calls
`poll` again when something has come, has been begun, or `wake_at` is reached. Seconds of one monotonic clock.
"""

from __future__ import annotations

import dataclasses
import secrets
import time
from collections.abc import Callable
from typing import Any

from . import codec, messages, model
from .codec import Detail, Phase, Reply
from .errors import BushdError, NoDaemon, Refused, ResultUnknown, TwoDaemons
from .status import StatusCollector

UNKNOWN_SESSION = "the session is unknown"  # begins the refusal of a daemon that has forgotten it
STATE_CHANNELS = ("STATE", "DESCRIPTION", "HEALTH")

Packet = tuple[str, bytes]  # channel without a prefix, payload


@dataclasses.dataclass(frozen=True)
class Timing:
    """In seconds. Over a link that loses nothing, all but `answer_within_s` are of no meaning."""

    resend_every_s: float = 0.3  # until the daemon has answered
    answer_within_s: float = 3.0  # then it is given up
    ask_again_every_s: float = 1.0  # while the result is awaited: it may have been lost
    silence_limit_s: float = 5.0  # so long the daemon's state may stay away meanwhile
    others_answer_within_s: float = 0.1  # a second daemon, to the HELLO that the first has answered


@dataclasses.dataclass(frozen=True)
class Request:
    """What is asked for: a message whose `request` the session fills in."""

    channel: str
    message: Any
    # Carrying it out twice does what once does, so it needs no session: stops, and what only reads.
    repeatable: bool = False


class Exchange:
    """A request under way. Over once `error` is set, or `outcome`; `accepted` before that."""

    def __init__(self, request: Request, number: int, now: float) -> None:
        self.request = request
        self.number = number
        self.accepted = False
        self.error: BushdError | None = None
        self.outcome: model.Outcome | None = None
        self.reason = ""
        self.detail = Detail()
        self.packet: Packet | None = None  # once it has a session
        self.session = 0
        self.sent = False
        self.next_send = now
        self.give_up = now
        self.run: int | None = None  # of the daemon that is heard meanwhile
        self.accepted_at = now
        self.asked_at = now
        self._parts: dict[int, Reply] = {}

    @property
    def over(self) -> bool:
        return self.error is not None or self.outcome is not None

    def take(self, reply: Reply, now: float) -> None:
        """Takes a reply to one that is not over."""
        if reply.phase is Phase.REFUSED:
            # Who has accepted it does not refuse it: then it is no longer known what became of it.
            self.error = Refused(reply.reason) if not self.accepted else ResultUnknown(
                "the daemon accepted the command, and does not know its result any more: "
                f"{reply.reason}; where() shows where the motors are"
            )
        elif reply.phase is Phase.ACCEPTED:
            self._accept(now)
        else:
            self._accept(now)
            self._take_result(reply)

    def _accept(self, now: float) -> None:
        if not self.accepted:
            self.accepted = True
            self.accepted_at = now

    def _take_result(self, reply: Reply) -> None:
        if self._parts and next(iter(self._parts.values())).parts != reply.parts:
            self._parts.clear()
        self._parts[reply.part] = reply
        if len(self._parts) < reply.parts:
            return
        ordered = [self._parts[part] for part in range(reply.parts)]
        self.outcome, self.reason = ordered[0].outcome, ordered[0].reason
        detail = ordered[0].detail
        for part in ordered[1:]:
            detail = detail + part.detail
        self.detail = detail


class StatusQuery:
    """Description, state and health of everything, as they are now. Over once it is complete, or `error` is set."""

    def __init__(self, packet: Packet, now: float, give_up: float) -> None:
        self.packet = packet
        self.collector = StatusCollector()
        self.next_send = now
        self.give_up = give_up
        self.error: BushdError | None = None

    @property
    def over(self) -> bool:
        return self.error is not None or (self.collector.has_motors() and self.collector.has_health())


class Session:
    """One client of one daemon. Any number of requests may be under way."""

    def __init__(
        self,
        client_id: str,
        *,
        loses: bool,
        remedy: str,
        prefix: str = "BUSHD",
        timing: Timing = Timing(),
        random_number: Callable[[], int] = lambda: secrets.randbelow(2**63),
        utime_us: Callable[[], int] = lambda: time.time_ns() // 1000,
    ) -> None:
        """`loses`: messages may be lost or repeated (LCM), else all arrive, in order, or the link ends (socket).

        `remedy`: what has to be there for a daemon to answer, for errors.
        """
        self.client_id = messages.text(client_id)
        self.loses = loses
        self._remedy = remedy
        self._prefix = prefix
        self._timing = timing
        self._random_number = random_number
        self._utime_us = utime_us
        self._nonce = random_number()
        self._session = 0  # 0: none yet
        self._settled_at = 0.0  # from then on all daemons have answered the HELLO
        self._next_hello = 0.0
        self._number = 0
        self._exchanges: list[Exchange] = []
        self._queries: list[StatusQuery] = []
        self._collectors: list[StatusCollector] = []  # of those who watch
        self._state_heard_at = float("-inf")
        # A run that is heard again after another one has not been restarted: there are two.
        self._newest_run = 0
        self._former_run = 0
        self._welcome_run = 0  # of the first who has answered this nonce
        self._heard_two_at = float("-inf")
        self.ended: str | None = None  # why there is no link any more

    # -- what is asked for

    def begin(self, request: Request, now: float) -> Exchange:
        """Sent by the next `poll`. Raises ValueError for what does not fit a message."""
        self._number += 1
        exchange = Exchange(request, self._number, now)
        self._encode(request, 0, exchange.number)
        exchange.give_up = now + self._timing.answer_within_s
        if self.ended is not None:
            exchange.error = NoDaemon(self.ended)
            return exchange
        if not self.loses or request.repeatable:
            self._address(exchange)
        self._exchanges.append(exchange)
        return exchange

    def abandon(self, exchange: Exchange) -> None:
        """Nobody waits for it any more."""
        if exchange in self._exchanges:
            self._exchanges.remove(exchange)
        if not exchange.over:
            exchange.error = ResultUnknown("the result was not waited for; where() shows where the motors are")

    def once(self, request: Request, session: int) -> Packet:
        """To be sent once, beside an exchange of this session; whether it arrives nobody waits for."""
        self._number += 1
        return self._encode(request, session, self._number)

    def begin_status(self, now: float, timeout_s: float) -> StatusQuery:
        request = Request("GET_STATUS", messages.get_status_t(), repeatable=True)
        query = StatusQuery(self.once(request, self._session), now, now + timeout_s)
        if self.ended is not None:
            query.error = NoDaemon(self.ended)
        else:
            self._queries.append(query)
        return query

    def abandon_status(self, query: StatusQuery) -> None:
        if query in self._queries:
            self._queries.remove(query)

    def watch(self, collector: StatusCollector) -> None:
        """Snapshots go there from now on; over a socket once they were subscribed to."""
        self._collectors.append(collector)

    def unwatch(self, collector: StatusCollector) -> None:
        if collector in self._collectors:
            self._collectors.remove(collector)

    # -- what has come

    def receive(self, channel: str, payload: bytes, now: float) -> None:
        """`channel` without the prefix. Whatever it is: what is no message of the daemon to this client is dropped. Over a link
        where nobody else sends, one that cannot be read ends it."""
        collectors = self._collectors
        if channel == "STATE" and not self._queries:
            unread = codec.unread(payload)
            if unread is None:
                return self._cannot_read(channel)
            collectors = [collector for collector in collectors if not collector.put_off(unread)]
            if not collectors:
                return self._on_state(unread.run, now)
        elif channel in STATE_CHANNELS and not (self._queries or self._collectors):
            return
        message = codec.decode(channel, payload)
        if isinstance(message, Reply):
            self._on_reply(message, now)
        elif isinstance(message, codec.Welcome):
            self._on_welcome(message, now)
        elif isinstance(message, codec.Part):
            self._on_snapshot(message, collectors, now)
        else:
            self._cannot_read(channel)

    def _cannot_read(self, channel: str) -> None:
        """Where nobody but the daemon can have sent it, to wait for what else it says would be for ever."""
        if not self.loses and codec.is_known(channel):
            self.link_ended(f"the daemon's {channel} cannot be read: it is of another version than this client; install the same of both")

    def link_ended(self, why: str) -> None:
        """No message comes any more. What has come before counts."""
        self.ended = why
        for exchange in self._open():
            if exchange.accepted:
                exchange.error = ResultUnknown(f"{why}; what became of the command is unknown")
            else:
                exchange.error = NoDaemon(f"{why}; it may have carried the command out" if exchange.sent else why)
        for query in self._queries:
            query.error = NoDaemon(why)
        self._exchanges.clear()
        self._queries.clear()

    def _on_reply(self, reply: Reply, now: float) -> None:
        if reply.client_id != self.client_id:
            return
        for exchange in self._open():
            if exchange.packet is None or exchange.number != reply.number:
                continue
            if self.loses and exchange.session != reply.session:
                continue
            was_accepted = exchange.accepted
            exchange.take(reply, now)
            if exchange.accepted and not was_accepted:
                exchange.next_send = now + self._timing.ask_again_every_s
            error = exchange.error
            forgotten = isinstance(error, Refused) and error.reason.startswith(UNKNOWN_SESSION)
            if forgotten or isinstance(error, ResultUnknown):
                self._forget_session(exchange.session)

    def _on_welcome(self, welcome: codec.Welcome, now: float) -> None:
        if welcome.client_id != self.client_id or welcome.nonce != self._nonce:
            return
        if self._session == 0:
            self._session = welcome.session
            self._welcome_run = welcome.run
            self._settled_at = now + self._timing.others_answer_within_s
        elif welcome.run != self._welcome_run:
            self._heard_two_at = now

    def _on_snapshot(self, part: codec.Part, collectors: list[StatusCollector], now: float) -> None:
        """`collectors`: those that have not put it off."""
        if isinstance(part, codec.State):
            self._on_state(part.run, now)
        for collector in collectors:
            collector.add(part)
        for query in self._queries:
            query.collector.add(part)

    def _on_state(self, run: int, now: float) -> None:
        self._state_heard_at = now
        if run != self._newest_run:
            if run == self._former_run:
                self._heard_two_at = now
            self._former_run, self._newest_run = self._newest_run, run
        for exchange in self._open():
            if exchange.run is not None and exchange.run != run and exchange.packet is not None:
                exchange.error = ResultUnknown(
                    "the daemon has restarted meanwhile (or two of them use this prefix), so the result is lost; "
                    "where() shows where the motors are"
                )
                self._forget_session(exchange.session)
            exchange.run = run

    # -- what goes out

    def poll(self, now: float) -> list[Packet]:
        """What is to be sent now. Exchanges and queries whose time has run out are over."""
        packets = self._greet(now)
        for exchange in self._open():
            self._check_time(exchange, now)
            if not exchange.over and exchange.packet is not None and self._is_due(exchange, now):
                exchange.sent = True
                again = self._timing.ask_again_every_s if exchange.accepted else self._timing.resend_every_s
                exchange.next_send = now + again
                packets.append(exchange.packet)
        for query in self._queries:
            if now >= query.give_up and not query.over:
                query.error = self._no_status(query, now)
            elif now >= query.next_send and not query.over:
                query.next_send = now + self._timing.resend_every_s if self.loses else query.give_up
                packets.append(query.packet)
        self._exchanges = self._open()
        self._queries = [query for query in self._queries if not query.over]
        return packets

    def wake_at(self) -> float | None:
        """When `poll` is to be called at the latest; None: only when something has come or was begun."""
        times = [min(query.next_send, query.give_up) for query in self._queries]
        for exchange in self._open():
            if exchange.packet is None:
                times += [exchange.give_up, self._next_hello if self._session == 0 else self._settled_at]
            else:
                if self.loses or not exchange.sent:
                    times.append(exchange.next_send)
                if not exchange.accepted:
                    times.append(exchange.give_up)
                elif self.loses:
                    times.append(self._silent_at(exchange))
        return min(times, default=None)

    def _open(self) -> list[Exchange]:
        return [exchange for exchange in self._exchanges if not exchange.over]

    def _is_due(self, exchange: Exchange, now: float) -> bool:
        if exchange.sent and not self.loses:
            return False  # once is enough
        return now >= exchange.next_send

    def _greet(self, now: float) -> list[Packet]:
        """Those that wait for a session get it, once all daemons have had time to answer."""
        waiting = [exchange for exchange in self._open() if exchange.packet is None]
        if not waiting:
            return []
        if self._session == 0:
            if now < self._next_hello or now >= max(exchange.give_up for exchange in waiting):
                return []
            self._next_hello = now + self._timing.resend_every_s
            hello = messages.hello_t(utime_us=self._utime_us(), client_id=self.client_id, nonce=self._nonce)
            return [("HELLO", codec.encode(hello))]
        if now < self._settled_at:
            return []
        two = self._hears_two(now)
        for exchange in waiting:
            if two:
                exchange.error = self._two_daemons()
            else:
                self._address(exchange)
                exchange.give_up = now + self._timing.answer_within_s
        if two:
            self._forget_session(self._session)
        return []

    def _address(self, exchange: Exchange) -> None:
        exchange.session = self._session
        exchange.packet = self._encode(exchange.request, exchange.session, exchange.number)

    def _encode(self, request: Request, session: int, number: int) -> Packet:
        who = {"session": session, "client_id": self.client_id, "number": number}
        request.message.request = messages.request_t(utime_us=self._utime_us(), **who)
        return request.channel, codec.encode(request.message)

    def _forget_session(self, session: int) -> None:
        if session == self._session:
            self._session = 0
            self._nonce = self._random_number()
            self._next_hello = 0.0

    # -- what has gone wrong

    def _check_time(self, exchange: Exchange, now: float) -> None:
        if exchange.accepted:
            if self.loses and now >= self._silent_at(exchange):
                exchange.error = ResultUnknown(
                    "the daemon accepted the command and has fallen silent since; what became of it is unknown"
                )
        elif now >= exchange.give_up:
            exchange.error = self._no_answer(exchange, now)
        if exchange.error is not None:
            self._forget_session(exchange.session)

    def _silent_at(self, exchange: Exchange) -> float:
        return max(self._state_heard_at, exchange.accepted_at) + self._timing.silence_limit_s

    def _hears_two(self, now: float) -> bool:
        return now < self._heard_two_at + self._timing.silence_limit_s

    def _two_daemons(self) -> TwoDaemons:
        return TwoDaemons(
            f"two daemons answer on channels {self._prefix}_..., so nothing was sent: end one of them, or give it "
            "another prefix in [lcm]. stop() and emergency_stop() reach both"
        )

    def _no_answer(self, exchange: Exchange, now: float) -> BushdError:
        if self._hears_two(now):
            return self._two_daemons()
        perhaps = "; it may still carry this out" if exchange.sent else ""
        if self.loses and self._state_heard_at >= exchange.asked_at:
            seconds = f"{self._timing.answer_within_s:g}"
            # Who has a session has been heard before.
            only = "with [lcm] commands = false it hears the control socket only"
            if self._session:
                rest = perhaps
            elif exchange.sent:
                rest = f": {only}; else it may still carry this out"
            else:
                rest = f"; nothing was asked of it. W{only[1:]}"
            return NoDaemon(f"bushd sends its state but has not answered for {seconds} s{rest}")
        return NoDaemon(self._remedy + perhaps)

    def _no_status(self, query: StatusQuery, now: float) -> BushdError:
        if self._hears_two(now):
            return self._two_daemons()
        if query.collector.is_empty():
            return NoDaemon(self._remedy)
        return NoDaemon(f"bushd has not told its whole state: {query.collector.missing()}")
