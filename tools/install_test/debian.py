"""Folders with a Debian in them, made once by debootstrap."""

import pathlib
import re
import shlex
import shutil
import subprocess

TOP = pathlib.Path(__file__).resolve().parents[2]
RELEASES = {"12": "bookworm", "13": "trixie"}


class Failed(Exception):
    pass


def sh(*command, **options):
    """A command of this PC, that must succeed."""
    ran = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **options)
    if ran.returncode != 0:
        raise Failed(f"{shlex.join(map(str, command))}: {ran.stdout}{ran.stderr}")
    return ran.stdout


def folder_of(release):
    """Where all lies that is made for or on this release."""
    return TOP / "build" / f"debian-{release}"


def release_of_this_pc():
    """The newest that is known, where it is none of these."""
    version = pathlib.Path("/etc/debian_version")
    number = version.read_text().split(".")[0].strip() if version.exists() else ""
    return number if number in RELEASES else list(RELEASES)[-1]


def mirror_of_this_pc():
    """From where this PC has its packages; none named: debootstrap knows one."""
    for file in [pathlib.Path("/etc/apt/sources.list"), *pathlib.Path("/etc/apt/sources.list.d").glob("*")]:
        text = file.read_text() if file.is_file() else ""
        found = re.search(r"^deb (?:\[.*?\] )?(\S*debian\S*)", text, re.MULTILINE) or re.search(r"^URIs: (\S*debian\S*)", text, re.MULTILINE)
        if found:
            return [found[1]]
    return []


def make_debian(folder, release, include, mirror=None):
    """Only what is complete gets its name."""
    if not folder.exists():
        print(f"making a Debian {release} in {folder} (once)", flush=True)
        folder.parent.mkdir(parents=True, exist_ok=True)
        making = folder.with_name(f"{folder.name}.making")
        shutil.rmtree(making, ignore_errors=True)
        sources = [mirror] if mirror else mirror_of_this_pc()
        sh("debootstrap", "--variant=minbase", f"--include={include}", RELEASES[release], making, *sources)
        making.rename(folder)
    return folder
