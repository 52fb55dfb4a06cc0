"""What a user of the PC who is not in the group bushd may try, run by test-install as such a one:

  hostile.py SECONDS PID_OF_BUSHD

Prints how often he was refused, and how many packets he has sent."""

import os
import random
import signal
import socket
import struct
import sys
import time

CONNECTIONS = 5000
CHANNELS = (b"BUSHD_DESCRIPTION", b"BUSHD_MOVE", b"BUSHD_STOP", b"BUSHD_EMERGENCY_STOP", b"BUSHD_STATE")


def refusals(pid):
    def connect():
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as client:
            client.connect("/run/bushd/control")

    files = ("/run/bushd/control.lock", "/etc/bushd/bushd.toml", "/var/lib/bushd/state.db")
    tries = [connect] * CONNECTIONS
    tries += [lambda file=file: open(file, "ab").close() for file in files]
    tries += [lambda number=number: os.kill(pid, number) for number in (signal.SIGKILL, signal.SIGSTOP)]
    refused = 0
    for attempt in tries:
        try:
            attempt()
        except PermissionError:
            refused += 1
    return refused


def flood(ends):
    """Whole messages of junk, fragments of a message that would be enormous, and what is no packet of LCM at all."""
    chance = random.Random(1)
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sent = 0
    while time.monotonic() < ends:
        for channel in CHANNELS:
            junk = chance.randbytes(chance.randrange(1400))
            whole = struct.pack(">II", 0x4C433032, sent) + channel + b"\0" + junk
            fragment = struct.pack(">IIIIHH", 0x4C433033, sent, 1 << 30, 0, 0, 9) + channel + b"\0" + junk
            for packet in (whole, fragment, junk):
                try:
                    udp.sendto(packet, ("239.255.76.67", 7667))
                    sent += 1
                except OSError:  # the queue of the device is full
                    pass
    return sent


if __name__ == "__main__":
    began = time.monotonic()
    print(refusals(int(sys.argv[2])), flood(began + float(sys.argv[1])))
