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


def sources_of(text):
    """(address, components) of each source of binary packages, in either form of sources.list(5)."""
    for line in re.findall(r"^deb\s+(.*)", text, re.MULTILINE):
        address, _, *components = re.sub(r"^\[.*?\]\s*", "", line).split("#")[0].split() + ["", ""]
        yield address, components
    for paragraph in re.split(r"\n\s*\n", text):
        fields = {name.lower(): value.split() for name, value in re.findall(r"^([A-Za-z-]+):\s*(.*)", paragraph, re.MULTILINE)}
        if "deb" in fields.get("types", []) and fields.get("enabled") != ["no"]:
            for address in fields.get("uris", []):
                yield address, fields.get("components", [])


def mirror_of_this_pc(etc=pathlib.Path("/etc")):
    """From where this PC has its packages: a folder of the name debian, with the component main; none: debootstrap knows one."""
    for file in [etc / "apt/sources.list", *sorted(etc.glob("apt/sources.list.d/*"))]:
        text = file.read_text() if file.suffix in (".list", ".sources") and file.is_file() else ""
        for address, components in sources_of(text):
            if re.search(r"/debian/?$", address) and "main" in components:
                return [address]
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
