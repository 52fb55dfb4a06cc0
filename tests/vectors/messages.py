"""The layouts of all payloads, as docs/protocol.md has them, and frames to try of each."""

# What a report has only if its `sections` say so: section i if bit i is set.
REPORT_SECTIONS = [
    [("reset_cause", 1), ("failed_tests", 1), ("motor_count", 1)],
    [("sync_id", 4), ("sync_tick", 4), ("sync_ns", 4), ("rate_ppb", -4)],
    [("inputs", 2), ("forbidden_positive", 2), ("forbidden_negative", 2), ("system_inputs", 1)],
    [("bad_frames", 2), ("rejected_frames", 2), ("last_rejection", 1), ("ramp_downs", 2)],
    [("running", 2), ("autonomous", 2), ("low_water_ticks", 2), ("out_of_order", 2), ("out_of_order_from", 2),
     ("out_of_order_until", 2)],
    [("homed", 2), ("homing", 1), ("armed", 2), ("trigger_number", 1), ("trigger_state", 1), ("start_tick", 4),
     ("start_ns", 4)],
]
SECTION_OF = {name: bit for bit, section in enumerate(REPORT_SECTIONS) for name, _ in section}

# A payload field: (name, bytes; negative: signed).
LAYOUTS = {
    "identify": (0x01, [("salt", 2), ("windows", 1), ("window_units", 2)]),
    "configure": (0x02, [("tick_ns", 4), ("format", 1), ("comm_timeout_ticks", 2)]),
    "table_begin": (0x03, [("bank", 1), ("accel_count", 2), ("decel_count", 2), ("cruise", 2), ("time_unit_ns", 4),
                           ("revision", 4)]),
    "table_data": (0x04, [("bank", 1), ("offset", 2), ("count", 1), ("codes", [2])]),
    "table_end": (0x05, [("bank", 1), ("crc", 4)]),
    "assign": (0x06, [("motor", 1), ("bank", 1)]),
    "control": (0x07, [("actions", 1), ("faults", "optional")]),
    "set_position": (0x08, [("motor", 1), ("position_steps", -4)]),
    "poll": (0x09, [("count", 1), ("entries", [1, 2, 1, 1])]),
    "sync": (0x0A, [("master", 2), ("sync_id", 4), ("follows", 1), ("follow_up_id", 4), ("sync_tick", 4), ("sync_ns", 4)]),
    "ticks": (0x0B, [("epoch", 1), ("flags", 1), ("first_tick", 4), ("count", 1), ("mask", 2), ("delays", [2]),
                     ("displacements", [1])]),
    "table_ticks": (0x0C, [("epoch", 1), ("flags", 1), ("first_tick", 4), ("count", 2), ("entries", "run_state")]),
    "table_run": (0x0D, [("epoch", 1), ("first_tick", 4), ("entries", "table_run")]),
    "line_run": (0x18, [("epoch", 1), ("first_tick", 4), ("bank", 1), ("shortest_delay", 2), ("longest", 4), ("from", 4),
                        ("steps", 4), ("entries", "line")]),
    "line_trigger": (0x1B, [("number", 1), ("edge", 1), ("delay_us", 4), ("bank", 1), ("shortest_delay", 2), ("longest", 4),
                            ("from", 4), ("steps", 4), ("entries", "line")]),
    "trigger": (0x15, [("number", 1), ("edge", 1), ("delay_us", 4), ("entries", "table_run")]),
    "position_compare": (0x16, [("motor", 1), ("arrivals", 1), ("position_steps", -4), ("delay_us", 4), ("width_us", 4)]),
    "emergency": (0x0E, [("mode", 1)]),
    "emission": (0x12, [("mode", 1), ("sequence", 1), ("hold_current", 1), ("step_us", 2), ("settle_us", 2),
                        ("dir_setup_us", 2), ("pulse_us", 2)]),
    "set_address": (0x0F, [("unique_id", [1]), ("address", 1)]),
    "get_tables": (0x10, []),
    "set_inputs": (0x11, [("limit_positive", 2), ("limit_negative", 2), ("limit_immediate", 2), ("inverted", 2),
                          ("debounce_ticks", 1), ("system_inverted", 1), ("emergency", 1), ("overcurrent", 2),
                          ("enable_after_watchdog", 1)]),
    "motor_inputs": (0x17, [("motor", 1), ("positive", 1), ("negative", 1), ("home", 1)]),
    "home": (0x13, [("motor", 1), ("direction", -1), ("most_steps", 4), ("shortest_delay", 2), ("slow_steps", 4), ("slow_delay", 2),
                    ("position_steps", -4)]),
    "travel": (0x19, [("number", 1), ("kind", 1), ("motor", 1), ("direction", -1), ("edge", 1), ("sensor", 1), ("steps", 4),
                      ("delay_us", 4), ("wait_us", 4)]),
    "local": (0x14, [("motors", 2), ("keypad", 2), ("keypad_ticks", 2)]),
    "currents": (0x1A, [("motor", 1), ("decay", 1), ("ramp_ma", 2), ("cruise_ma", 2), ("hold_ma", 2)]),
    "set_velocity": (0x1C, [("motor", 1), ("least", 4), ("most", 4), ("acceleration", 4)]),
    "set_outputs": (0x1D, [("step_low", 2), ("direction_low", 2), ("enabled", 1)]),
    "program_put": (0x1E, [("offset", 2), ("total", 2), ("bytes", [1])]),
    "program_control": (0x1F, [("action", 1), ("number", 1), ("value", 4)]),
    "get_program_state": (0x20, []),
    "program_state": (0xA0, [("stage", 1), ("reason", 1), ("number", 1), ("flags", 1), ("motors", 2), ("memory", 2), ("size", 2),
                             ("crc", 4), ("frame", 2), ("point", 2), ("repeats", 4), ("start_tick", 4), ("tick", 4)]),
    "identity": (0x81, [("protocol_version", 1), ("motors", 1), ("firmware_version", 2), ("boot_number", 2),
                        ("slots", 2), ("queue_ticks", 2), ("table_codes", 2), ("capabilities", 4),
                        ("unique_id", [1])]),
    "report": (0x89, [("state", 1), ("faults", 1), ("flags", 1), ("epoch", 1), ("boot_number", 2), ("number", 1),
                      ("sections", 1), ("motors", 2), ("moving", 2), ("current", 2), ("tick", 4), ("tick_ns", 4)] +
               [field for section in REPORT_SECTIONS for field in section] + [("motor", [-4, 2])]),
    "tables": (0x90, [("valid", 1), ("held", [4, 4])]),
    "acknowledgement": (0x82, [("status", 1)]),
}

ID = [98, 117, 115, 104, 0, 255, 1, 2]

FRAMES = [
    (1, 7, "identify", {"salt": 0, "windows": 1, "window_units": 0}),
    (0, 7, "identify", {"salt": 4660, "windows": 16, "window_units": 120}),
    (0, 255, "poll", {"count": 1, "entries": [[2, 50, 0, 255]]}),
    (0, 1, "poll", {"count": 3, "entries": [[1, 50, 7, 40], [2, 260, 255, 22], [255, 65535, 0, 178]]}),
    (1, 1, "configure", {"tick_ns": 2560000, "format": 1, "comm_timeout_ticks": 400}),
    (3, 2, "table_begin", {"bank": 2, "accel_count": 238, "decel_count": 0, "cruise": 10, "time_unit_ns": 40000,
                           "revision": 7}),
    (3, 3, "table_data", {"bank": 2, "offset": 120, "count": 4, "codes": [250, 256, 1, 65535]}),
    (3, 4, "table_end", {"bank": 2, "crc": 0xCBF43926}),
    (1, 5, "assign", {"motor": 15, "bank": 7}),
    (1, 6, "control", {"actions": 5}),
    (1, 6, "control", {"actions": 12, "faults": 0x86}),
    (1, 7, "set_position", {"motor": 0, "position_steps": -310}),
    (0, 41, "sync", {"master": 4660, "sync_id": 1, "follows": 0, "follow_up_id": 0, "sync_tick": 0, "sync_ns": 0}),
    (0, 42, "sync", {"master": 4660, "sync_id": 66051, "follows": 1, "follow_up_id": 66050, "sync_tick": 100000,
                     "sync_ns": 1280000}),
    (1, 8, "ticks", {"epoch": 3, "flags": 0, "first_tick": 1000, "count": 2, "mask": 0x8003, "delays": [9, 8, 0],
                     "displacements": [0x81, 0x02, 0x80, 0x83, 0x00, 0xFF]}),
    (1, 9, "ticks", {"epoch": 3, "flags": 4, "first_tick": 1002, "count": 3, "mask": 0x0010, "delays": [250],
                     "displacements": [0x80, 0x80, 0x81]}),
    (1, 9, "ticks", {"epoch": 4, "flags": 3, "first_tick": 1002, "count": 1, "mask": 0x0005, "delays": [10, 0],
                     "displacements": [0x00, 0x01, 0x80, 0xFF]}),
    (1, 10, "table_ticks", {"epoch": 4, "flags": 4, "first_tick": 1100, "count": 190,
                            "entries": [[3, 1, 0, 0, 0, 0, 0, 237, 46, 237, 0]]}),
    # Motors that cruise, ramp down in the middle of a step, speed up.
    (1, 11, "table_ticks", {"epoch": 4, "flags": 0, "first_tick": 1290, "count": 300,
                            "entries": [[0, -1, 1, 9, 0, 0, 0, 0, 0, 0, 0], [1, 1, 0, 7, 39999, 12, 200, 237, 0, 201, 0],
                                        [15, 1, 0, 65535, 0, 0, 5, 6, 2147483647, 65535, 0]]}),
    (1, 12, "table_ticks", {"epoch": 5, "flags": 2, "first_tick": 0xFFFFFFFF, "count": 1,
                            "entries": [[7, 1, 1, 0, 1, 0, 0, 0, 0, 0, 0]]}),
    # With shortest delays: one that cruises, one that speeds up; one without.
    (1, 25, "table_ticks", {"epoch": 6, "flags": 8, "first_tick": 1290, "count": 300,
                            "entries": [[0, -1, 1, 9, 0, 0, 0, 0, 0, 0, 60], [1, 1, 0, 7, 39999, 12, 20, 190, 9, 191, 258],
                                        [2, 1, 1, 3, 0, 0, 0, 0, 0, 0, 0]]}),
    (1, 13, "table_run", {"epoch": 5, "first_tick": 2000, "entries": [[0, 2, 1, 200, 0]]}),
    (1, 14, "table_run", {"epoch": 5, "first_tick": 2000, "entries": [[1, 0, -1, 1, 513], [15, 7, 1, 2147483647, 0]]}),
    (1, 26, "line_run", {"epoch": 5, "first_tick": 2000, "bank": 3, "shortest_delay": 0, "longest": 700, "from": 0, "steps": 700,
                         "entries": [[0, 1, 700], [2, -1, 211]]}),
    # The rest of one after a pause, with a shortest delay.
    (1, 27, "line_run", {"epoch": 255, "first_tick": 4294967295, "bank": 7, "shortest_delay": 513, "longest": 2147483647,
                         "from": 2147483640, "steps": 7, "entries": [[15, -1, 1]]}),
    # By the elementary law, which is bit 7 of the bank.
    (1, 45, "line_run", {"epoch": 5, "first_tick": 2000, "bank": 131, "shortest_delay": 0, "longest": 911, "from": 0, "steps": 911,
                         "entries": [[0, 1, 700], [2, -1, 211]]}),
    (1, 28, "line_trigger", {"number": 1, "edge": 2, "delay_us": 50, "bank": 3, "shortest_delay": 0, "longest": 700, "from": 0,
                             "steps": 700, "entries": [[0, 1, 700], [2, -1, 211]]}),
    (1, 29, "line_trigger", {"number": 255, "edge": 1, "delay_us": 1650000, "bank": 7, "shortest_delay": 513,
                             "longest": 2147483647, "from": 2147483640, "steps": 7, "entries": [[15, -1, 1]]}),
    (1, 21, "trigger", {"number": 1, "edge": 2, "delay_us": 50, "entries": [[0, 2, 1, 200, 0]]}),
    (1, 22, "trigger", {"number": 255, "edge": 1, "delay_us": 1650000,
                        "entries": [[1, 0, -1, 1, 513], [15, 7, 1, 2147483647, 0]]}),
    (1, 23, "trigger", {"number": 0, "edge": 0, "delay_us": 0, "entries": []}),
    (1, 24, "position_compare", {"motor": 15, "arrivals": 3, "position_steps": -310, "delay_us": 1500000,
                          "width_us": 1000000}),
    (0, 15, "emergency", {"mode": 0}),
    (2, 16, "emergency", {"mode": 1}),
    (0, 30, "emergency", {"mode": 2}),
    (1, 16, "emission", {"mode": 3, "sequence": 0, "hold_current": 0, "step_us": 2048, "settle_us": 0,
                         "dir_setup_us": 5, "pulse_us": 3}),
    (1, 17, "emission", {"mode": 4, "sequence": 2, "hold_current": 1, "step_us": 0, "settle_us": 65535,
                         "dir_setup_us": 0, "pulse_us": 0}),
    (1, 18, "emission", {"mode": 5, "sequence": 0, "hold_current": 0, "step_us": 2048, "settle_us": 518,
                         "dir_setup_us": 0, "pulse_us": 0}),
    (0, 17, "set_address", {"unique_id": ID, "address": 9}),
    (9, 18, "get_tables", {}),
    (1, 19, "set_inputs", {"limit_positive": 0x00FF, "limit_negative": 0x0180, "limit_immediate": 0x8001,
                           "inverted": 0x0203, "debounce_ticks": 2, "system_inverted": 1, "emergency": 2,
                           "overcurrent": 900, "enable_after_watchdog": 1}),
    (2, 20, "set_inputs", {"limit_positive": 0, "limit_negative": 0, "limit_immediate": 0, "inverted": 0,
                           "debounce_ticks": 0, "system_inverted": 0, "emergency": 0, "overcurrent": 0,
                           "enable_after_watchdog": 0}),
    (2, 21, "set_inputs", {"limit_positive": 1, "limit_negative": 2, "limit_immediate": 3, "inverted": 4,
                           "debounce_ticks": 15, "system_inverted": 14, "emergency": 1, "overcurrent": 1023,
                           "enable_after_watchdog": 0}),
    (1, 31, "set_inputs", {"limit_positive": 0, "limit_negative": 0, "limit_immediate": 0, "inverted": 0,
                           "debounce_ticks": 0, "system_inverted": 1, "emergency": 3, "overcurrent": 0,
                           "enable_after_watchdog": 1}),
    (1, 26, "motor_inputs", {"motor": 15, "positive": 0, "negative": 3, "home": 8}),
    (2, 27, "motor_inputs", {"motor": 0, "positive": 15, "negative": 15, "home": 15}),
    (1, 21, "home", {"motor": 3, "direction": -1, "most_steps": 20000, "shortest_delay": 77, "slow_steps": 600, "slow_delay": 1000,
                     "position_steps": -310}),
    (2, 22, "home", {"motor": 15, "direction": 1, "most_steps": 0, "shortest_delay": 0, "slow_steps": 1, "slow_delay": 65535,
                     "position_steps": 2147483647}),
    (1, 28, "travel", {"number": 7, "kind": 2, "motor": 3, "direction": -1, "edge": 1, "sensor": 0, "steps": 126,
                       "delay_us": 150000, "wait_us": 1500000}),
    (1, 29, "travel", {"number": 8, "kind": 1, "motor": 15, "direction": 1, "edge": 0, "sensor": 9, "steps": 1,
                       "delay_us": 0, "wait_us": 50}),
    (2, 30, "travel", {"number": 255, "kind": 2, "motor": 4, "direction": 1, "edge": 2, "sensor": 0, "steps": 2147483647,
                       "delay_us": 1650000, "wait_us": 1650000}),
    (1, 31, "travel", {"number": 0, "kind": 0, "motor": 5, "direction": 0, "edge": 0, "sensor": 0, "steps": 0, "delay_us": 0,
                       "wait_us": 0}),
    (1, 23, "local", {"motors": 0x8005, "keypad": 0, "keypad_ticks": 0}),
    (2, 38, "local", {"motors": 0, "keypad": 0x0102, "keypad_ticks": 196}),
    (1, 32, "currents", {"motor": 0, "decay": 1, "ramp_ma": 1500, "cruise_ma": 1000, "hold_ma": 260}),
    (2, 33, "currents", {"motor": 3, "decay": 0, "ramp_ma": 1, "cruise_ma": 5110, "hold_ma": 1}),
    (1, 34, "currents", {"motor": 1, "decay": 0, "ramp_ma": 0, "cruise_ma": 0, "hold_ma": 0}),
    (1, 35, "set_velocity", {"motor": 0, "least": 6400, "most": 96000, "acceleration": 500}),
    (2, 36, "set_velocity", {"motor": 15, "least": 40, "most": 8388607, "acceleration": 8388607}),
    (1, 37, "set_velocity", {"motor": 3, "least": 0, "most": 0, "acceleration": 0}),
    (1, 38, "set_outputs", {"step_low": 0x0102, "direction_low": 0xFFFF, "enabled": 2}),
    (2, 39, "set_outputs", {"step_low": 0, "direction_low": 0x8003, "enabled": 1}),
    (1, 40, "program_put", {"offset": 0, "total": 513, "bytes": [1, 0, 3, 2, 255]}),
    (2, 41, "program_put", {"offset": 65292, "total": 65535, "bytes": [9] * 243}),
    (1, 42, "program_control", {"action": 1, "number": 0, "value": 0xCBF43926}),
    (1, 43, "program_control", {"action": 2, "number": 255, "value": 66051}),
    (2, 44, "program_control", {"action": 3, "number": 0, "value": 1}),
    (9, 45, "get_program_state", {}),
    (1, 45, "program_state", {"stage": 4, "reason": 3, "number": 7, "flags": 1, "motors": 0x8003, "memory": 8192, "size": 513,
                              "crc": 0xCBF43926, "frame": 258, "point": 772, "repeats": 66051, "start_tick": 1013, "tick": 70000}),
    (1, 46, "program_state", {"stage": 8, "reason": 10, "number": 0, "flags": 0, "motors": 9, "memory": 4097, "size": 4096,
                              "crc": 1, "frame": 2, "point": 3, "repeats": 4, "start_tick": 5, "tick": 6}),
    (1, 7, "identity", {"protocol_version": 6, "motors": 16, "firmware_version": 258, "boot_number": 4660,
                        "slots": 128, "queue_ticks": 256, "table_codes": 2048, "capabilities": 98319, "unique_id": ID}),
    (2, 255, "report", {"state": 2, "faults": 0, "flags": 7, "epoch": 3, "boot_number": 4660, "number": 255, "sections": 63,
                        "motors": 3, "moving": 2, "current": 513, "tick": 1001, "tick_ns": 1999999, "reset_cause": 4,
                        "failed_tests": 12, "motor_count": 2, "sync_id": 66050, "sync_tick": 990, "sync_ns": 0,
                        "rate_ppb": -48000, "inputs": 0, "forbidden_positive": 16, "forbidden_negative": 0x0302,
                        "system_inputs": 5, "bad_frames": 1, "rejected_frames": 65535, "last_rejection": 6, "ramp_downs": 0x0201,
                        "running": 2, "autonomous": 2, "low_water_ticks": 117, "out_of_order": 1, "out_of_order_from": 1200,
                        "out_of_order_until": 1390, "homed": 0x8001, "homing": 3, "armed": 32770, "trigger_number": 9,
                        "trigger_state": 2, "start_tick": 1013, "start_ns": 2559999,
                        "motor": [[-310, 1010], [2147483647, 65535]]}),
    # With the one before, no two fields of one width are alike in both (check_layouts.py).
    (1, 254, "report", {"state": 1, "faults": 34, "flags": 15, "epoch": 200, "boot_number": 4661, "number": 1, "sections": 63,
                        "motors": 63, "moving": 4, "current": 514, "tick": 1002, "tick_ns": 1999998, "reset_cause": 3,
                        "failed_tests": 5, "motor_count": 6, "sync_id": 66051, "sync_tick": 991, "sync_ns": 12,
                        "rate_ppb": 47000, "inputs": 6, "forbidden_positive": 11, "forbidden_negative": 12,
                        "system_inputs": 14, "bad_frames": 7, "rejected_frames": 8, "last_rejection": 16, "ramp_downs": 9,
                        "running": 5, "autonomous": 13, "low_water_ticks": 118, "out_of_order": 10,
                        "out_of_order_from": 1201, "out_of_order_until": 1391, "homed": 14, "homing": 7, "armed": 15,
                        "trigger_number": 10, "trigger_state": 4, "start_tick": 1014, "start_ns": 2559998,
                        "motor": [[n, 1020 + n] for n in range(6)]}),
    # Nothing is new; inputs, and motors 1 and 15; what is new has no room.
    (1, 253, "report", {"state": 1, "faults": 0, "flags": 15, "epoch": 3, "boot_number": 4660, "number": 17, "sections": 0,
                        "motors": 0, "moving": 0, "current": 0, "tick": 70000, "tick_ns": 1280000}),
    (1, 252, "report", {"state": 2, "faults": 0, "flags": 15, "epoch": 3, "boot_number": 4660, "number": 18, "sections": 4,
                        "motors": 0x8002, "moving": 0x8000, "current": 0, "tick": 70020, "tick_ns": 1280000,
                        "inputs": 0x8000, "forbidden_positive": 0x8000, "forbidden_negative": 0, "system_inputs": 0,
                        "motor": [[12, 4486], [-7, 4490]]}),
    (1, 251, "report", {"state": 1, "faults": 0, "flags": 15, "epoch": 3, "boot_number": 4660, "number": 0, "sections": 0,
                        "motors": 0, "moving": 0, "current": 0, "tick": 70040, "tick_ns": 1280000}),
    (9, 18, "tables", {"valid": 5, "held": [[0xCBF43926, 7], [0, 0], [1, 4294967295], [0, 0], [0, 0], [0, 0], [0, 0],
                                            [0, 0]]}),
    (1, 6, "acknowledgement", {"status": 8}),
    # The longest payload without a zero, and the longest of zeros.
    (255, 255, "ticks", {"epoch": 255, "flags": 1, "first_tick": 0xFFFFFFFF, "count": 118, "mask": 0x0100,
                         "delays": [257], "displacements": [1] * 236}),
    (0, 0, "ticks", {"epoch": 0, "flags": 0, "first_tick": 0, "count": 236, "mask": 0x0001, "delays": [0],
                     "displacements": [0] * 236}),
]


def run_state_bytes(fields, motor, direction, cruises, since, since_ns, lead, accel_at, accel_end, cruise_left,
                    decel_left, cruise):
    head = motor | (0x80 if direction > 0 else 0) | (0 if cruises else 0x40)
    out = since.to_bytes(2, "little")
    if fields["flags"] & 8:
        out += cruise.to_bytes(2, "little")
    if since_ns:
        head |= 0x20
        out += since_ns.to_bytes(4, "little")
    if lead:
        head |= 0x10
        out += lead.to_bytes(2, "little")
    if not cruises:
        for value, width in ((accel_at, 2), (accel_end, 2), (cruise_left, 4), (decel_left, 2)):
            out += value.to_bytes(width, "little")
    return bytes([head]) + out


def table_run_bytes(_, motor, bank, direction, steps, shortest_delay):
    head = bytes([motor | bank << 4 | (0x80 if direction > 0 else 0)])
    if not shortest_delay:
        return head + steps.to_bytes(4, "little")
    return head + (steps | 1 << 31).to_bytes(4, "little") + shortest_delay.to_bytes(2, "little")


def line_bytes(_, motor, direction, increment):
    return bytes([motor | (0x80 if direction > 0 else 0)]) + increment.to_bytes(4, "little")


ENTRIES = {"run_state": run_state_bytes, "table_run": table_run_bytes, "line": line_bytes}


def is_left_out(name, fields):
    """Whether a report leaves out the section that the field is in, or all motors."""
    if "sections" not in fields:
        return False
    if name == "motor":
        assert len(fields.get(name, [])) == fields["motors"].bit_count()
        return fields["motors"] == 0
    left_out = name in SECTION_OF and not fields["sections"] >> SECTION_OF[name] & 1
    assert left_out == (name not in fields)
    return left_out


def payload_of(layout, fields):
    out = b""
    for name, width in layout:
        if is_left_out(name, fields):
            continue
        if width == "optional":
            out += bytes([fields[name]]) if name in fields else b""
            continue
        value = fields[name]
        if isinstance(width, int):
            out += value.to_bytes(abs(width), "little", signed=width < 0)
            continue
        if isinstance(width, str):
            out += b"".join(ENTRIES[width](fields, *element) for element in value)
            continue
        for element in value:
            parts = element if isinstance(element, list) else [element]
            out += b"".join(p.to_bytes(abs(w), "little", signed=w < 0) for p, w in zip(parts, width, strict=True))
    return out
