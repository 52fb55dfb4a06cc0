"""A Debian in a container: made once, booted with systemd, its network a loopback device only."""

import os
import pathlib
import re
import shlex
import shutil
import subprocess
import tempfile
import time

from install_test.debian import TOP, Failed, folder_of, make_debian, release_of_this_pc, sh

NAMES = ["bushd", "bushd-sim", "bushd-epics", "bushd-web", "bushd-firmware", "libbushd-dev", "python3-bushd"]
BASE_PACKAGES = "systemd,systemd-sysv,dbus,udev,kmod,iproute2,procps,passwd"
# For clients that are compiled, and what a lab PC has.
TOOLS = ["cmake", "g++", "logrotate", "ninja-build", "pkg-config"]
GIVE_UP_S = 60


class Site:
    """Which Debian, where its packages of bushd are, and where it is made and run."""

    def __init__(self, release=None):
        self.release = release or release_of_this_pc()
        self.work = folder_of(release) / "test-install" if release else TOP / "build" / "test-install"
        self.packages = folder_of(release) / "packages" if release else TOP / "build" / "packages"


def wait_until(what, holds, give_up_s=GIVE_UP_S):
    end = time.monotonic() + give_up_s
    while True:
        seen = holds()
        if seen:
            return seen
        if time.monotonic() > end:
            raise Failed(f"waited {give_up_s} s in vain for {what}")
        time.sleep(0.1)


def packages(site):
    """The newest file of each package that was built."""
    found = {}
    for name in NAMES:
        files = sorted(site.packages.glob(f"{name}_*.deb"))
        if files:
            found[name] = files[-1]
    if "bushd" not in found:
        raise Failed(f"there are no packages in {site.packages}: run tools/package")
    return found


def dependencies(files):
    """What the packages need of Debian, the first of alternatives."""
    needed = set()
    for file in files:
        for clause in sh("dpkg-deb", "--field", file, "Depends").split(","):
            word = re.match(r"\s*([a-z0-9.+-]+)", clause)
            if word and word[1] not in NAMES:
                needed.add(word[1])
    return sorted(needed)


def in_root(root, *command):
    environment = ["env", "DEBIAN_FRONTEND=noninteractive", "PATH=/usr/sbin:/usr/bin:/sbin:/bin"]
    return sh("chroot", root, *environment, *command)


def make_base(site, files):
    """The Debian with what the packages and their clients need, as the container has no network."""
    base = site.work / "base"
    made = site.work / "base.made"
    wanted = sorted([*dependencies(files), *TOOLS])
    text = "\n".join(wanted) + "\n"
    if made.exists() and made.read_text() == text:
        return base
    debian = make_debian(site.work / "debian", site.release, BASE_PACKAGES)
    print(f"test-install: adding {len(wanted)} packages of Debian (once)", flush=True)
    made.unlink(missing_ok=True)
    shutil.rmtree(base, ignore_errors=True)
    sh("cp", "--archive", "--reflink=auto", debian, base)
    shutil.copy("/etc/resolv.conf", base / "etc/resolv.conf")
    in_root(base, "apt-get", "-q", "update")
    in_root(base, "apt-get", "-q", "-y", "--no-install-recommends", "install", *wanted)
    in_root(base, "apt-get", "clean")
    made.write_text(text)
    return base


class Container:
    def __init__(self, site, base, name):
        self.name = name
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="run-", dir=site.work))
        self.root = self.folder / "root"
        for part in ("upper", "work", "root"):
            (self.folder / part).mkdir()
        self.nspawn = None
        self.pid1 = None
        layers = f"lowerdir={base},upperdir={self.folder}/upper,workdir={self.folder}/work"
        sh("mount", "-t", "overlay", "overlay", "-o", layers, self.root)

    def boot(self):
        """Returns what systemd says of the boot."""
        with open(self.folder / "console.log", "ab") as console:
            command = ["systemd-nspawn", "--quiet", "--register=no", "--keep-unit", f"--machine={self.name}"]
            command += ["--private-network", f"--directory={self.root}", "--boot"]
            # It has one hierarchy of cgroups, whatever this PC has: the unit's filters need it.
            environment = {**os.environ, "SYSTEMD_NSPAWN_UNIFIED_HIERARCHY": "1"}
            self.nspawn = subprocess.Popen(command, env=environment, stdin=subprocess.DEVNULL, stdout=console, stderr=console)
        self.pid1 = wait_until("PID 1 of the container", self._leader)
        return wait_until("the container to boot", self._booted)

    def _leader(self):
        if self.nspawn.poll() is not None:
            raise Failed(f"systemd-nspawn has ended:\n{(self.folder / 'console.log').read_text(errors='replace')}")
        for children in pathlib.Path(f"/proc/{self.nspawn.pid}/task").glob("*/children"):
            for pid in children.read_text().split():
                if pathlib.Path(f"/proc/{pid}/comm").read_text().strip() == "systemd":
                    return pid
        return None

    def _booted(self):
        said = self.run("systemctl", "is-system-running", check=False).stdout.strip()
        return said if said in ("running", "degraded") else None

    def command(self, words, user="root"):
        home = "/root" if user == "root" else f"/home/{user}"
        enter = ["nsenter", "-t", self.pid1, "--all", f"--wdns={home}", "env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin"]
        enter += [f"HOME={home}", f"USER={user}", "TERM=dumb", "LANG=C.UTF-8", "DEBIAN_FRONTEND=noninteractive"]
        return [*enter, *([] if user == "root" else ["runuser", "-u", user, "--"]), *map(str, words)]

    def run(self, *words, user="root", check=True):
        ran = subprocess.run(self.command(words, user), capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
        if check and ran.returncode != 0:
            raise Failed(f"{shlex.join(map(str, words))} (as {user}) ended with {ran.returncode}: {ran.stdout}{ran.stderr}")
        return ran

    def start(self, *words, user="root"):
        return subprocess.Popen(self.command(words, user), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                stderr=subprocess.STDOUT, text=True)

    def ends(self, how):
        self.run("systemctl", how, check=False)
        self.nspawn.wait(GIVE_UP_S)

    def remove(self, keep):
        if self.nspawn and self.nspawn.poll() is None:
            self.run("systemctl", "poweroff", check=False)
            try:
                self.nspawn.wait(GIVE_UP_S)
            except subprocess.TimeoutExpired:
                self.nspawn.kill()
                self.nspawn.wait()
        if keep:
            print(f"test-install: the container's root is {self.root}")
            return
        sh("umount", self.root)
        shutil.rmtree(self.folder)
