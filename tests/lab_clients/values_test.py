#!/usr/bin/env python3
"""Values as bushd-epics sends them, byte by byte against caproto; and what becomes of them while a client wants to hear nothing."""

import asyncio
import gc
import math
import types
import unittest

import caproto
from bushd_epics import channels, circuits, values
from caproto import ChannelType
from caproto._headers import EventAddResponseHeader

ID = 17


def subscription(data_type, data_count=0):
    return types.SimpleNamespace(
        subscriptionid=ID, data_type=data_type, data_count=data_count, db_entry=types.SimpleNamespace(max_subscription_backlog=2)
    )


class Values(unittest.TestCase):
    def test_they_are_as_caproto_has_them(self):
        alarm = caproto.ChannelAlarm(status=7, severity=2)
        cases = [(channels.Double(value=value, precision=3, units="mm", alarm=alarm), ChannelType.TIME_DOUBLE) for value in (0.0, -12.345, 1e300)]
        cases += [(channels.Long(value=value, alarm=alarm), ChannelType.TIME_LONG) for value in (0, -(2**31), 2**31 - 1, 400.0)]
        cases += [(channels.Short(value=value, alarm=alarm), ChannelType.TIME_INT) for value in (0, -(2**15), 2**15 - 1)]
        for channel, data_type in cases:
            metadata, numbers = channels.at_once(channel._read(data_type))
            for count in (0, 1):
                theirs = caproto.EventAddResponse(numbers, data_type, 1, 1, ID, metadata=metadata)
                made = values.ready(channel, data_type.name)
                self.assertEqual(values.Event(subscription(data_type, count), made).data, bytes(theirs), (channel.value, data_type))

    def test_no_number_is_no_number(self):
        channel = channels.Double(value=math.nan, precision=3, units="mm")
        made = values.ready(channel, "TIME_DOUBLE")
        read = caproto.EventAddResponse.from_wire(
            EventAddResponseHeader(len(made.payload), ChannelType.TIME_DOUBLE, 1, 1, ID), bytearray(made.payload)
        )
        self.assertTrue(math.isnan(read.data[0]))

    def test_other_forms_are_left_to_caproto(self):
        channel = channels.Double(value=1.0, precision=3, units="mm")
        self.assertEqual([values.ready(channel, name) for name in ("DOUBLE", "CTRL_DOUBLE", "TIME_LONG", "TIME_STRING")], [None] * 4)
        self.assertIsNone(values.ready(channels.make(channels.Kind.ENUM, 1, ("a", "b"), None, "bo"), "TIME_ENUM"))

    def test_numbers_in_an_array_are_left_to_caproto_and_told(self):
        channel = channels.make(channels.Kind.WAVEFORM, (1.0, 2.5), (), None, "waveform")
        self.assertIsNone(values.ready(channel, "TIME_DOUBLE"))
        told = asyncio.Queue()
        channel._queues[told][None]["TIME_DOUBLE"].add("spec")
        channel.show((3.0, 4.0, 5.0))
        update = told.get_nowait()
        self.assertEqual((update.sub_specs, list(update.values)), (("spec",), [3.0, 4.0, 5.0]))


class Queue(unittest.IsolatedAsyncioTestCase):
    async def asyncSetUp(self):
        circuit = self.circuit = circuits.Circuit.__new__(circuits.Circuit)
        circuit.events_on, circuit.subscription_queue = asyncio.Event(), asyncio.Queue()
        circuit.subscriptions_to_resend, circuit.unexpired_updates = {}, {}
        circuit.events_on.set()
        self.subscription = subscription(ChannelType.TIME_LONG)

    def put(self, *numbers):
        for number in numbers:
            self.circuit.put_value("spec", self.subscription, values.Ready(number.to_bytes(8, "big")))

    def waiting(self):
        gc.collect()
        refs = [self.circuit.subscription_queue.get_nowait() for _ in range(self.circuit.subscription_queue.qsize())]
        return [event.data[-1] for event in (ref() for ref in refs) if event is not None]

    async def test_the_oldest_are_given_up_for_newer_ones(self):
        self.put(1, 2, 3)
        self.assertEqual(self.waiting(), [2, 3])
        self.assertEqual(self.circuit.subscriptions_to_resend, {})

    async def test_a_client_that_wants_to_hear_nothing_for_a_while_hears_the_newest_then(self):
        self.put(1)
        self.circuit.events_on.clear()
        self.circuit.unexpired_updates.clear()  # as caproto does
        self.assertEqual(self.waiting(), [])
        self.assertEqual(self.circuit.subscriptions_to_resend, {"spec": [self.subscription]})
        self.put(2)
        self.assertEqual((self.waiting(), self.circuit.subscriptions_to_resend), ([], {"spec": [self.subscription]}))


class Wanted(unittest.TestCase):
    def test_nothing_is_sent_of_what_is_subscribed_to_no_more(self):
        circuit = circuits.Circuit.__new__(circuits.Circuit)
        asked_for = {ID: types.SimpleNamespace(sid=3)}
        circuit.circuit = types.SimpleNamespace(event_add_commands=asked_for, channels_sid={3: None})
        event = values.Event(subscription(ChannelType.TIME_LONG), values.Ready(bytes(16)))
        self.assertEqual(circuit._bytes_of(event), [event.data])
        circuit.circuit.channels_sid.clear()
        self.assertEqual(circuit._bytes_of(event), [])
        circuit.circuit.channels_sid[3] = None
        asked_for.clear()
        self.assertEqual(circuit._bytes_of(event), [])
        self.assertEqual(circuit._bytes_of(None), [])


if __name__ == "__main__":
    unittest.main()
