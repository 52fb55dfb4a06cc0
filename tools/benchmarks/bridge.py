"""A bushd-epics for measurements, in the network of this process."""

import contextlib
import os
import pathlib
import subprocess
import sys
import time

TOP = pathlib.Path(__file__).resolve().parents[2]
PYTHON_PATH = TOP / "build" / "release" / "lib" / "python"
ADDRESS = "127.0.0.1"
GIVE_UP_S = 120
END_WITHIN_S = 20
# Clients, which are this process and its children, look there too.
os.environ.update(
    EPICS_CA_ADDR_LIST=ADDRESS, EPICS_CA_AUTO_ADDR_LIST="NO", EPICS_CAS_BEACON_ADDR_LIST=ADDRESS, EPICS_CAS_AUTO_BEACON_ADDR_LIST="NO"
)


@contextlib.contextmanager
def bridge(control, log, python_path=PYTHON_PATH, profile=None):
    """The process, once it is ready. `profile`: a file for cProfile."""
    profiled = ["-m", "cProfile", "-o", str(profile)] if profile else []
    command = [sys.executable, "-B", *profiled, "-m", "bushd_epics", "--prefix", "LAB:", "--daemon", str(control), "--interface", ADDRESS]
    with open(log, "wb") as file:
        process = subprocess.Popen(command, stdout=file, stderr=subprocess.STDOUT, env={**os.environ, "PYTHONPATH": str(python_path)})
    try:
        give_up_s = time.monotonic() + GIVE_UP_S
        while "ready" not in log.read_text():
            if process.poll() is not None or time.monotonic() > give_up_s:
                sys.exit(f"bushd-epics is not ready:\n{log.read_text()}")
            time.sleep(0.05)
        yield process
    finally:
        process.terminate()
        try:
            process.wait(END_WITHIN_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
