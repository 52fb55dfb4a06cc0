"""The step of tools/test-install that moves a motor by bushd-epics."""

from install_test.container import wait_until


def channel_access(lab, what, *words, check=True):
    """`what`: get or put, by otto; a client of this PC, with the caproto of the package. Returns what the variable is then."""
    environment = ["env", "PYTHONPATH=/usr/share/bushd-epics", "EPICS_CA_ADDR_LIST=127.0.0.1", "EPICS_CA_AUTO_ADDR_LIST=NO"]
    client = [*environment, "python3", "-m", f"caproto.commandline.{what}", "--no-repeater", "--terse"]
    ran = lab.run(*client, *(["--notify", "--timeout", "60"] if what == "put" else []), *words, user="otto", check=check)
    return ran.stdout.split()[-1] if ran.returncode == 0 else None


def step_epics(lab, _):
    """The bridge waits for its configuration. Then everybody of this PC reads and moves by it, history says who, and --read-only ends that."""
    unit = "bushd-epics"
    lab.run("systemctl", "start", unit)
    lab.expect(lab.show("ActiveState", unit) == "inactive", "it runs without a configuration")
    options = lab.root / "etc/default/bushd-epics"
    options.write_text("BUSHD_EPICS_OPTIONS=--prefix LAB:\n")
    lab.run("systemctl", "start", unit)
    level = lab.exposure(unit)
    lab.expect(lab.show("User", unit) == unit, "it runs as another user")
    listed = lab.run("bushd-epics", "--prefix", "LAB:", "--list", user="anna").stdout.split()
    lab.expect({"LAB:theta.VAL", "LAB:slit-left.RBV", "LAB:phi_able", "LAB:allstop"} <= set(listed), f"it lists {listed}")
    lab.run("bushctl", "set", "theta", "--steps", "0", user="anna")
    wait_until("LAB:theta to be found", lambda: channel_access(lab, "get", "LAB:theta.RBV", check=False))
    channel_access(lab, "put", "LAB:theta.VAL", "250")
    lab.expect(lab.motor("theta")["position_steps"] == 250, lab.where())
    lab.expect(float(channel_access(lab, "get", "LAB:theta.RBV")) == 250, "RBV is not where theta stands")
    who = lab.run("bushctl", "history", "theta", user="anna").stdout
    lab.expect("epics:otto:" in who, f"history does not name otto:\n{who}")
    options.write_text("BUSHD_EPICS_OPTIONS=--prefix LAB: --read-only\n")
    lab.run("systemctl", "restart", unit)
    wait_until("LAB:theta to be there again", lambda: channel_access(lab, "get", "LAB:theta.RBV", check=False))
    channel_access(lab, "put", "LAB:theta.VAL", "0", check=False)
    lab.expect(lab.motor("theta")["position_steps"] == 250, f"a put moves, though nobody may: {lab.where()}")
    options.write_text("BUSHD_EPICS_OPTIONS=--prefix LAB:\n")
    lab.run("systemctl", "restart", unit)
    return f"user {unit}, exposure {level}; {len(listed)} variables; otto moves theta to 250 by LAB:theta.VAL; with --read-only it stays"
