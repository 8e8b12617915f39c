#!/usr/bin/env python3
"""Prints the frames of a rig, written from core/wire/PROTOCOL.md alone: read_stream.py [DEVICE or FILE]
A serial device or pty is asked to start its streams; a file, or standard input without an argument, is only read."""
import os, stat, struct, sys, time, tty

TYPES = dict(enumerate("hello request,hello,names request,names,time request,time reply,goodbye".split(","), 1))
TYPES |= dict(enumerate("weights,markers,status,event,head pose".split(","), 0x10)) | {0x30: "ack", 0x31: "nak"}
TYPES |= dict(enumerate("start streams,stop streams,status request,command,control".split(","), 0x20))
TEXT_AT = {2: 28, 4: 8, 0x13: 16}  # where the texts of a message begin

def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8): crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF

def cobs_decode(run):
    out, at = b"", 0
    while at < len(run):
        block = run[at + 1:at + run[at]]
        if len(block) != run[at] - 1: return b""
        at += run[at]
        out += block + (b"\0" if len(block) < 254 and at < len(run) else b"")
    return out

def frame(kind, sequence, payload=b""):
    raw = struct.pack("<BBBBIH", 1, kind, 0, 0, sequence, len(payload)) + payload
    raw += struct.pack("<I", crc32c(raw))
    return b"\0" + b"".join(bytes([len(run) + 1]) + run for run in raw.split(b"\0")) + b"\0"  # short: no run of 254

def describe(kind, p):
    if kind == 0x10:
        total, first, count = struct.unpack_from("<HHH", p, 56)
        weights = " ".join(f"{w / 16384:.4f}" for w in struct.unpack_from(f"<{count}h", p, 62))
        head = "state %d capture_us %d age_us %d faults %#x " % struct.unpack_from("<IqIQ", p) + ["safe", "lost", "hold", "partial", "live"][p[52]]
        return f"{head}{' held' if p[53] & 1 else ''} shapes {first}+{count}/{total}: {weights}"
    if kind == 0x11: return "state %d capture_us %d markers %d first %d count %d" % struct.unpack_from("<IqHHH", p)
    if kind == 0x14: return "state %d capture_us %d status %d turn %.4f %.4f %.4f place %.2f %.2f %.2f" % struct.unpack_from("<IqBxxx6f", p)
    if kind == 0x12:
        return "up %d us, ticks %d solved %d held %d overruns %d sent %d dropped %d" % struct.unpack_from("<q6I", p, 8)
    text = p[TEXT_AT[kind]:].decode("utf-8", "replace") if kind in TEXT_AT else p.hex(" ")
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())

path = sys.argv[1] if len(sys.argv) > 1 else "/dev/stdin"
device = stat.S_ISCHR(os.stat(path).st_mode) and len(sys.argv) > 1
fd = os.open(path, os.O_RDWR | os.O_NOCTTY if device else os.O_RDONLY)
if device: tty.setraw(fd)
run, sequence, asked, synchronised = b"", 0, 0.0, False
while True:
    if device and time.monotonic() - asked > 1.0:
        asked, sequence = time.monotonic(), sequence + 2
        os.write(fd, frame(0x01, sequence - 2) + frame(0x20, sequence - 1, struct.pack("<BBHHH", 5, 0, 1, 1, 60)))
    chunk = os.read(fd, 4096)
    if not chunk: break
    *whole, run = (run + chunk).split(b"\0")
    for raw in map(cobs_decode, whole if synchronised else whole[1:]):
        if len(raw) >= 14 and raw[0] == 1 and raw[-4:] == struct.pack("<I", crc32c(raw[:-4])):
            print(raw[3], *struct.unpack_from("<I", raw, 4), TYPES.get(raw[1]), describe(raw[1], raw[10:-4]), flush=True)
    synchronised |= bool(whole)
