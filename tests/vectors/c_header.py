"""The vectors as C arrays, for firmware builds."""

from answers import line_answers, move_bytes, rest_bytes, run_state, slot_lists, take_over_bytes
from chosen import IDENTIFY_WINDOWS, LINES, MOVES, RUN_STATES, SLOTS, TABLES, TAKE_OVERS
from definitions import frame, identify_window
from messages import FRAMES, LAYOUTS, payload_of


def c_array(kind, name, values):
    lines = [f"static const {kind} {name}[] = {{"]
    line = "   "
    for value in values:
        if len(line) + len(str(value)) > 96:
            lines.append(line)
            line = "   "
        line += f" {value},"
    return "\n".join([*lines, line, "};"])


def c_state(state):
    direction, cruises, *numbers = state
    return f"{{{direction}, {'true' if cruises else 'false'}, {', '.join(f'{n}u' for n in numbers)}}}"


def c_encoder(index, message, fields):
    """A function that makes the payload by the engine's encoder."""
    head = f"static size_t encode_{index}(uint8_t* payload) {{"
    if not fields:
        return f"{head}\n  (void)payload;\n  return 0;\n}}"
    lines = [head]
    if message == "table_data":
        lines.append(f"  static const uint16_t codes[] = {{{', '.join(map(str, fields['codes']))}}};")
        lines.append(f"  return bushd_encode_table_data({fields['bank']}, {fields['offset']}, {fields['count']}, codes, "
                     "payload);")
    elif message == "program_put":
        lines.append("  " + c_array("uint8_t", "bytes", fields["bytes"]).replace("\n", "\n  "))
        lines.append(f"  const bushd_program_put message = {{{fields['offset']}, {fields['total']}, sizeof bytes, bytes}};")
        lines.append("  return bushd_encode_program_put(&message, payload);")
    elif message == "poll":
        entries = ", ".join(f"{{{', '.join(map(str, entry))}}}" for entry in fields["entries"])
        lines.append(f"  static const bushd_poll_entry entries[] = {{{entries}}};")
        lines.append(f"  return bushd_encode_poll(entries, {fields['count']}, payload);")
    elif message == "table_ticks":
        entries = ", ".join(f"{{{entry[0]}, {c_state(entry[1:])}}}" for entry in fields["entries"])
        lines.append(f"  static const bushd_table_ticks_entry entries[] = {{{entries}}};")
        lines.append(f"  return bushd_encode_table_ticks({fields['epoch']}, {fields['flags']}, "
                     f"UINT32_C({fields['first_tick']}), {fields['count']}, entries, {len(fields['entries'])}, payload);")
    elif message == "table_run":
        entries = ", ".join(f"{{{motor}, {bank}, {direction}, {steps}, {shortest_delay}}}"
                            for motor, bank, direction, steps, shortest_delay in fields["entries"])
        lines.append(f"  static const bushd_table_run_entry entries[] = {{{entries}}};")
        lines.append(f"  return bushd_encode_table_run({fields['epoch']}, UINT32_C({fields['first_tick']}), entries, "
                     f"{len(fields['entries'])}, payload);")
    elif message in ("line_run", "line_trigger"):
        entries = ", ".join(f"{{{motor}, {direction}, UINT32_C({increment})}}"
                            for motor, direction, increment in fields["entries"])
        lines.append(f"  static const bushd_line_entry entries[] = {{{entries}}};")
        lines.append(f"  bushd_{message} message;")
        lines.append("  memset(&message, 0, sizeof message);")
        for name in ("epoch", "first_tick", "number", "delay_us"):
            if name in fields:
                lines.append(f"  message.{name} = {fields[name]}u;")
        if "edge" in fields:
            lines.append(f"  message.edge = (bushd_edge){fields['edge']};")
        for name in ("bank", "shortest_delay", "longest", "from", "steps"):
            lines.append(f"  message.line.{name} = {fields[name]}u;")
        lines.append(f"  return bushd_encode_{message}(&message, entries, {len(fields['entries'])}, payload);")
    elif message == "trigger":
        entries = ", ".join(f"{{{motor}, {bank}, {direction}, {steps}, {shortest_delay}}}"
                            for motor, bank, direction, steps, shortest_delay in fields["entries"])
        name = "entries" if entries else "NULL"
        if entries:
            lines.append(f"  static const bushd_table_run_entry entries[] = {{{entries}}};")
        lines.append(f"  return bushd_encode_trigger({fields['number']}, (bushd_edge){fields['edge']}, "
                     f"UINT32_C({fields['delay_us']}), {name}, {len(fields['entries'])}, payload);")
    elif message == "ticks":
        delays = "delays"
        lines.append(f"  static const uint16_t delays[] = {{{', '.join(map(str, fields['delays']))}}};")
        lines.append("  " + c_array("uint8_t", "displacements", fields["displacements"]).replace("\n", "\n  "))
        lines.append(f"  const size_t head = bushd_encode_ticks_head({fields['epoch']}, {fields['flags']}, "
                     f"UINT32_C({fields['first_tick']}), {fields['count']}, {fields['mask']}, {delays}, payload);")
        lines.append("  memcpy(payload + head, displacements, sizeof displacements);")
        lines.append("  return head + sizeof displacements;")
    else:
        lines.append(f"  bushd_{message} message;")
        lines.append("  memset(&message, 0, sizeof message);")
        for name, value in fields.items():
            if name == "motor" and isinstance(value, list):
                told = [i for i in range(16) if fields["motors"] >> i & 1]
                for i, (steps, until) in zip(told, value, strict=True):
                    lines.append(f"  message.motor[{i}].position_steps = {steps};")
                    lines.append(f"  message.motor[{i}].known_until = {until};")
            elif name == "unique_id":
                lines += [f"  message.unique_id[{i}] = {byte};" for i, byte in enumerate(value)]
            elif message == "tables":
                for i, held in enumerate(fields["held"] if name == "held" else []):
                    lines.append(f"  message.bank[{i}].valid = {'true' if fields['valid'] >> i & 1 else 'false'};")
                    lines.append(f"  message.bank[{i}].crc = UINT32_C({held[0]});")
                    lines.append(f"  message.bank[{i}].revision = UINT32_C({held[1]});")
            elif message == "emergency" and name == "mode":
                lines.append(f"  message.mode = {('BUSHD_STOP_RAMP', 'BUSHD_STOP_IMMEDIATE', 'BUSHD_STOP_DISABLE')[value]};")
            elif name in ("follows", "enable_after_watchdog"):
                lines.append(f"  message.{name} = {'true' if value else 'false'};")
            elif name == "format":
                lines.append(f"  message.format = {'BUSHD_FORMAT_FINE' if value else 'BUSHD_FORMAT_COARSE'};")
            else:
                lines.append(f"  message.{name} = {value};")
        lines.append(f"  return bushd_encode_{message}(&message, payload);")
    return "\n".join([*lines, "}"])


def c_header():
    out = ["// Made by tests/vectors/make_vectors.py.", ""]
    for name, table in TABLES.items():
        out.append(c_array("uint16_t", f"kAccel_{name}", table.accel))
        if table.decel is not table.accel:
            out.append(c_array("uint16_t", f"kDecel_{name}", table.decel))
    rows = []
    for name, table in TABLES.items():
        decel = f"kAccel_{name}" if table.decel is table.accel else f"kDecel_{name}"
        rows.append(f"    {{{{kAccel_{name}, {len(table.accel)}, NULL, NULL, 0}}, "
                    f"{{{decel}, {len(table.decel)}, NULL, NULL, 0}}, {table.cruise}, {table.unit_ns}}},")
    out += ["static const bushd_table kTables[] = {", *rows, "};", ""]
    out += [c_array("uint32_t", "kTableCrcs", [f"UINT32_C({table.crc32()})" for table in TABLES.values()]), ""]
    numbers = {name: i for i, name in enumerate(TABLES)}

    rows = []
    for i, move in enumerate(MOVES):
        name, steps, tick_ns, form, stop, shortest_delay = move
        data = move_bytes(*move)
        out.append(c_array("uint8_t", f"kMove_{i}", data))
        rows.append(f"    {{&kTables[{numbers[name]}], {abs(steps)}, {-1 if steps < 0 else 1}, {tick_ns}, "
                    f"{'true' if form == 'fine' else 'false'}, {-1 if stop is None else stop}, {shortest_delay}, kMove_{i}, "
                    f"{len(data)}}},")
    out += ["static const move_vector kMoves[] = {", *rows, "};", ""]

    rows = []
    for i, take in enumerate(TAKE_OVERS):
        name, delay, fraction, direction, tick_ns, form = take
        data = take_over_bytes(*take)
        out.append(c_array("uint8_t", f"kTakeOver_{i}", data))
        rows.append(f"    {{&kTables[{numbers[name]}], {delay}, {fraction}, {direction}, {tick_ns}, "
                    f"{'true' if form == 'fine' else 'false'}, kTakeOver_{i}, {len(data)}}},")
    out += ["static const take_over_vector kTakeOvers[] = {", *rows, "};", ""]

    rows = []
    for i, saved in enumerate(RUN_STATES):
        name, steps, tick_ns, form, stop, shortest_delay, tick, ticks = saved
        data = rest_bytes(*saved)
        out.append(c_array("uint8_t", f"kRest_{i}", data))
        rows.append(f"    {{&kTables[{numbers[name]}], {abs(steps)}, {-1 if steps < 0 else 1}, {tick_ns}, "
                    f"{'true' if form == 'fine' else 'false'}, {-1 if stop is None else stop}, {shortest_delay}, {tick}, {ticks}, "
                    f"{c_state(run_state(*saved))}, kRest_{i}, {len(data)}}},")
    out += ["static const run_state_vector kRunStates[] = {", *rows, "};", ""]

    rows = []
    for i, line in enumerate(LINES):
        made, fractions, positions = line_answers(*line)
        out.append(c_array("uint32_t", f"kLineMade_{i}", [f"{n}u" for n in made]))
        out.append(c_array("uint8_t", f"kLineFractions_{i}", fractions))
        out.append(c_array("uint64_t", f"kLinePositions_{i}", [f"UINT64_C({n})" for n in positions]))
        rows.append(f"    {{{', '.join(f'{n}u' for n in line)}, kLineMade_{i}, kLineFractions_{i}, kLinePositions_{i}}},")
    out += ["static const line_vector kLines[] = {", *rows, "};", ""]

    rows = [f"    {{{{{', '.join(map(str, bytes.fromhex(unique_id)))}}}, {salt}, {windows}, "
            f"{identify_window(bytes.fromhex(unique_id), salt, windows)}}}," for unique_id, salt, windows in IDENTIFY_WINDOWS]
    out += ["static const identify_window_vector kIdentifyWindows[] = {", *rows, "};", ""]

    rows = []
    for i, (slot_count, crossing, values) in enumerate(SLOTS):
        lists, remainder = slot_lists(slot_count, crossing, values)
        out.append(c_array("int16_t", f"kDisplacements_{i}", values))
        # The slots of all ticks in a row; -1 ends a tick.
        out.append(c_array("int16_t", f"kSlots_{i}", [slot for one in lists for slot in [*one, -1]]))
        rows.append(f"    {{{slot_count}, {crossing}, kDisplacements_{i}, {len(values)}, kSlots_{i}, {remainder}}},")
    out += ["static const slots_vector kSlots[] = {", *rows, "};", ""]

    rows = []
    for i, (address, sequence, message, fields) in enumerate(FRAMES):
        kind, layout = LAYOUTS[message]
        wire = frame(address, kind, sequence, payload_of(layout, fields))
        out.append(c_encoder(i, message, fields))
        out.append(c_array("uint8_t", f"kWire_{i}", wire))
        rows.append(f"    {{{address}, {kind}, {sequence}, encode_{i}, kWire_{i}, {len(wire)}}},")
    out += ["static const frame_vector kFrames[] = {", *rows, "};", ""]
    return "\n".join(out)
