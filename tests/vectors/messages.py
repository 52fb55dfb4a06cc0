"""The layouts of all payloads, as docs/protocol.md has them."""

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
    """Of a report: the section that the field is in, or all motors."""
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
