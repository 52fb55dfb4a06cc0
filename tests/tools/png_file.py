"""Reads PNG files of 8 bits a colour, with or without transparency. Standard library only."""

import itertools
import struct
import zlib


def paeth(left, up, corner):
    slope = left + up - corner
    return min((left, up, corner), key=lambda value: abs(slope - value))


def unfilter(kind, line, above, channels):
    if kind == 1:
        for channel in range(channels):
            line[channel::channels] = bytes(itertools.accumulate(line[channel::channels], lambda left, value: (left + value) & 0xFF))
    elif kind == 2:
        line[:] = bytes((value + up) & 0xFF for value, up in zip(line, above))
    elif kind in (3, 4):
        for i, up in enumerate(above):
            left, corner = (line[i - channels], above[i - channels]) if i >= channels else (0, 0)
            line[i] = (line[i] + ((left + up) // 2 if kind == 3 else paeth(left, up, corner))) & 0xFF


def pixels(data):
    """Width, height, and of each row the colours (red, green, blue)."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + length]
        assert zlib.crc32(kind + body) == struct.unpack(">I", data[at + 8 + length :][:4])[0]
        if kind == b"IHDR":
            width, height, depth, colour_type = struct.unpack(">IIBB", body[:10])
            assert depth == 8 and colour_type in (2, 6) and body[12] == 0
            channels = 3 if colour_type == 2 else 4
        elif kind == b"IDAT":
            packed += body
        at += 12 + length
    raw = zlib.decompress(packed)
    stride = channels * width
    above = bytes(stride)
    rows = []
    for row in range(height):
        begin = row * (stride + 1)
        line = bytearray(raw[begin + 1 : begin + 1 + stride])
        unfilter(raw[begin], line, above, channels)
        rows.append(list(zip(line[0::channels], line[1::channels], line[2::channels])))
        above = line
    return width, height, rows
