#!/usr/bin/env python3
"""Programs in C, C++ and Fortran are built against installations of the client libraries, and run.

Installed where each compiler looks by itself, /usr and /usr/local (in a mount namespace, so that this PC stays as it is),
and in a prefix that is named at installation only. By CMake, and by pkg-config.
$BUSHD_SOURCE_DIR is the source tree, $BUSHD_BUILD_DIR the build, $CMAKE the program."""

import os
import pathlib
import shlex
import shutil
import subprocess
import tempfile
import unittest

SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])
BUILD = pathlib.Path(os.environ["BUSHD_BUILD_DIR"])
CMAKE = os.environ["CMAKE"]
PROGRAMS = SOURCE / "tests/packaging/consumer"
EXAMPLE = "share/doc/libbushd-dev/examples"
NO_DAEMON = "bushd is not running"


class Place:
    """An installation, and how to run commands of one who uses it."""

    def __init__(self, folder, prefix):
        self.prefix = pathlib.Path(prefix)
        self.layers = folder / "layers"
        self.environment = {**os.environ}
        for name in ("CMAKE_PREFIX_PATH", "PKG_CONFIG_PATH", "DESTDIR"):
            self.environment.pop(name, None)
        system = self.prefix.is_relative_to("/usr")
        self.lower = self.layers / "usr" if system else None
        staged = {**self.environment, "DESTDIR": str(self.layers)} if system else self.environment
        self.installed = self.layers / self.prefix.relative_to("/") if system else self.prefix
        subprocess.run([CMAKE, "--install", BUILD, "--prefix", self.prefix, "--component", "dev"], env=staged, check=True, capture_output=True)
        if not system:
            self.environment["CMAKE_PREFIX_PATH"] = str(self.prefix)
            self.environment["PKG_CONFIG_PATH"] = ":".join(str(path.parent) for path in self.prefix.rglob("bushd-client.pc"))

    def run(self, *command):
        words = [str(word) for word in command]
        if self.lower:
            namespaces = ["--mount"] if os.getuid() == 0 else ["--user", "--map-root-user", "--mount"]
            over = f"mount -t overlay overlay -o lowerdir={shlex.quote(str(self.lower))}:/usr /usr"
            words = ["unshare", *namespaces, "sh", "-c", f'{over} && exec "$@"', "sh", *words]
        ran = subprocess.run(words, env=self.environment, capture_output=True, text=True, check=False)
        if ran.returncode != 0:
            raise AssertionError(f"{shlex.join(map(str, command))}:\n{ran.stdout}{ran.stderr}")
        return ran.stdout

    def flags(self, *what):
        return self.run("pkg-config", *what).split()


class Consumers:
    """What is built, for each place. One language has nothing of another one: its project enables no other."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.place = Place(cls.folder, cls.prefix or cls.folder / "a/prefix")

    def project(self, sources, *definitions):
        build = pathlib.Path(tempfile.mkdtemp(dir=self.folder))
        self.place.run(CMAKE, "-S", sources, "-B", build, "-G", "Ninja", *definitions)
        self.place.run(CMAKE, "--build", build)
        return build

    def says_that_there_is_no_daemon(self, program, *arguments):
        environment = {**os.environ, "BUSHD_CONTROL": str(self.folder / "none")}
        ran = subprocess.run([program, *arguments], env=environment, capture_output=True, text=True, check=False)
        self.assertIn(NO_DAEMON, ran.stdout + ran.stderr)

    def compile(self, compiler, source, *options):
        program = pathlib.Path(tempfile.mkdtemp(dir=self.folder)) / "program"
        self.place.run(compiler, "-o", program, source, *options)
        return program

    def test_c_by_cmake(self):
        build = self.project(PROGRAMS, "-DLANGUAGE=C", "-DSOURCE=program.c")
        self.says_that_there_is_no_daemon(build / "consumer")

    def test_fortran_by_cmake(self):
        build = self.project(PROGRAMS, "-DLANGUAGE=Fortran", "-DSOURCE=program.f")
        self.says_that_there_is_no_daemon(build / "consumer")

    def test_the_installed_example_in_cpp_by_cmake(self):
        sources = self.folder / "example"
        shutil.copytree(self.place.installed / EXAMPLE, sources)
        self.says_that_there_is_no_daemon(self.project(sources) / "move_and_wait", "theta", "1")

    def test_c_by_pkg_config(self):
        program = self.compile("cc", PROGRAMS / "program.c", *self.place.flags("--cflags", "--libs", "bushd-esone"))
        self.says_that_there_is_no_daemon(program)

    def test_fortran_by_pkg_config(self):
        program = self.compile("gfortran", PROGRAMS / "program.f", *self.place.flags("--libs", "bushd-esone"))
        self.says_that_there_is_no_daemon(program)

    def test_the_example_in_cpp_by_pkg_config(self):
        example = self.place.installed / EXAMPLE / "move_and_wait.cpp"
        program = self.compile("c++", example, "-std=c++20", *self.place.flags("--cflags", "--libs", "bushd-client"))
        self.says_that_there_is_no_daemon(program, "theta", "1")

    def test_all_that_the_archives_have_links_with_the_libraries_that_are_named(self):
        archives = ["-Wl,--whole-archive", "-lbushd-esone", "-lbushd-client", "-Wl,--no-whole-archive"]
        flags = self.place.flags("--libs", "bushd-esone")
        libraries = [flag for flag in flags if not flag.startswith("-lbushd")]
        self.compile("cc", PROGRAMS / "nothing.c", *[flag for flag in flags if flag.startswith("-L")], *archives, *libraries)

    def test_types_are_where_lcm_gen_is_told_to_look(self):
        types = pathlib.Path(self.place.run("pkg-config", "--variable=lcmtypes", "bushd-client").strip())
        found = self.place.run("ls", types).split()
        self.assertEqual(found, sorted(path.name for path in (SOURCE / "lib/lcm/types").glob("*.lcm")))


class Usr(Consumers, unittest.TestCase):
    prefix = "/usr"


class UsrLocal(Consumers, unittest.TestCase):
    prefix = "/usr/local"


class GivenPrefix(Consumers, unittest.TestCase):
    prefix = None


if __name__ == "__main__":
    unittest.main()
