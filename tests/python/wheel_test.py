"""The Python client as a wheel: what it says of itself, its types, and all of it at work in bare environments.

It takes the Pythons from 3.11 that this PC has (in $PATH, /usr/bin, and pyenv's), one of each version, and says which.
$BUSHD_WHEEL is the wheel, $BUSHD_BUILD_DIR the build; programs as for client_test.py."""

import base64
import email
import glob
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
TOP = HERE.parents[1]
BUILD = pathlib.Path(os.environ["BUSHD_BUILD_DIR"])
WHEEL = pathlib.Path(os.environ["BUSHD_WHEEL"])
OLDEST, NEWEST = 11, 30  # Python 3.x: of requires-python, and farther than there are any
EXTRA = r"; *extra *== *['\"](epics|ophyd)['\"]$"
ISOLATED = ["-I", "-B"]  # nothing but what is installed


def pythons():
    """By version, a Python that can make environments."""
    pyenv = os.environ.get("PYENV_ROOT", os.path.expanduser("~/.pyenv"))
    found = {}
    for minor in range(OLDEST, NEWEST):
        name = f"python3.{minor}"
        for path in (shutil.which(name), f"/usr/bin/{name}", *sorted(glob.glob(f"{pyenv}/versions/3.{minor}.*/bin/{name}"))):
            ran = path and pathlib.Path(path).exists() and subprocess.run(
                [path, "-I", "-c", "import ensurepip, sys, venv; print(*sys.version_info[:3], sep='.')"], capture_output=True, text=True, check=False)
            if ran and ran.stdout.startswith(f"3.{minor}."):
                found[ran.stdout.strip()] = path
                break
    return found


class Wheel(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.archive = zipfile.ZipFile(WHEEL)
        cls.addClassCleanup(cls.archive.close)
        cls.files = set(cls.archive.namelist())

    def text(self, name):
        return self.archive.read(name).decode()

    def information(self, name):
        (path,) = [file for file in self.files if file.endswith(f".dist-info/{name}")]
        return self.text(path)

    def test_it_has_the_version_of_the_daemon_and_no_dependencies(self):
        version = re.search(r"^project\(bushd VERSION ([0-9.]+)", (TOP / "CMakeLists.txt").read_text(), re.MULTILINE)[1]
        said = email.message_from_string(self.information("METADATA"))
        self.assertEqual((said["Name"], said["Version"], said["Requires-Python"]), ("bushd", version, f">=3.{OLDEST}"))
        for needed in said.get_all("Requires-Dist"):
            self.assertRegex(needed, EXTRA, "nobody needs it but who asks for an extra")
        self.assertEqual(self.text("bushd/version.py"), f'__version__ = "{version}"\n')
        self.assertEqual(WHEEL.name, f"bushd-{version}-py3-none-any.whl")
        self.assertIn("Root-Is-Purelib: true\nTag: py3-none-any\n", self.information("WHEEL"))

    def test_it_has_what_was_built_and_nothing_else(self):
        folder = BUILD / "lib/python"
        paths = [path for package in ("bushd", "bushd_epics") for path in (folder / package).rglob("*") if path.is_file()]
        built = {str(path.relative_to(folder)) for path in paths if "__pycache__" not in path.parts}
        self.assertEqual({file for file in self.files if ".dist-info/" not in file}, built)
        for file in built:
            self.assertEqual(self.archive.read(file), (folder / file).read_bytes(), file)
        self.assertLessEqual({"bushd/py.typed", "bushd_epics/main.py"}, built)

    def test_the_extra_is_what_packages_contain(self):
        """One version of caproto, whichever way somebody gets it."""
        name, version = re.search(r" (caproto)-([0-9.]+)-", (TOP / "debian/vendored.sha256").read_text()).groups()
        said = email.message_from_string(self.information("METADATA"))
        self.assertEqual(sorted(said.get_all("Provides-Extra")), ["epics", "ophyd"])
        needed = [re.sub(r"[ ()]", "", re.sub(EXTRA, "", one)) for one in said.get_all("Requires-Dist") if "epics" in one]
        self.assertEqual(needed, [f"{name}=={version}"])
        self.assertIn("bushd-epics = bushd_epics.main:main", self.information("entry_points.txt"))

    def test_what_it_records_is_what_it_has(self):
        for line in self.information("RECORD").splitlines():
            name, digest, size = line.rsplit(",", 2)
            if digest:
                data = self.archive.read(name)
                self.assertEqual(digest, "sha256=" + base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("="), name)
                self.assertEqual(int(size), len(data))

    def test_its_types_are_those_of_the_daemon(self):
        types = {f"bushd/types/{path.name}": path.read_bytes() for path in (TOP / "lib/lcm/types").glob("*.lcm")}
        self.assertEqual({name: self.archive.read(name) for name in self.files if name.endswith(".lcm")}, types)

    def test_it_is_the_same_however_it_is_packed(self):
        with tempfile.TemporaryDirectory() as folder:
            command = [TOP / "lib/python/make_wheel", BUILD / "lib/python/pyproject.toml", TOP / "LICENSE", folder,
                       BUILD / "lib/python/bushd", BUILD / "lib/python/bushd_epics"]
            subprocess.run(command, check=True, capture_output=True, umask=0o077, env={**os.environ, "TZ": "Pacific/Auckland", "LC_ALL": "C"})
            self.assertEqual((pathlib.Path(folder) / WHEEL.name).read_bytes(), WHEEL.read_bytes())


class Installed(unittest.TestCase):
    """In a bare environment of each Python."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.environments = {}
        for version, python in pythons().items():
            print(f"Python {version}: {python}", flush=True)
            place = pathlib.Path(folder.name) / version
            subprocess.run([python, "-I", "-m", "venv", place], check=True)
            pip = [place / "bin/python", "-I", "-m", "pip", "--disable-pip-version-check", "--quiet"]
            subprocess.run([*pip, "install", "--no-index", WHEEL], check=True)
            cls.environments[version] = place / "bin/python"
        assert cls.environments, "no Python from 3.11 with venv and ensurepip: python3-venv (tools/setup)"

    def in_each(self, *words, before=()):
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        for version, python in self.environments.items():
            with self.subTest(python=version):
                ran = subprocess.run([*before, python, *words], env=environment, capture_output=True, text=True, check=False)
                self.assertEqual(ran.returncode, 0, ran.stdout + ran.stderr)
                yield version, ran.stdout

    def test_it_is_there_and_needs_nothing(self):
        program = ("import bushd, importlib.metadata, pathlib; information = importlib.metadata.distribution('bushd'); "
                   "print(information.version, bushd.__version__, all('extra ==' in needed for needed in information.requires), (pathlib.Path(bushd.__file__).parent / 'py.typed').exists())")
        version = WHEEL.name.split("-")[1]
        for _, said in self.in_each(*ISOLATED, "-W", "error", "-c", program):
            self.assertEqual(said.split(), [version, version, "True", "True"])

    def test_what_has_no_caproto_is_told_to_install_it(self):
        program = "import sys; from bushd_epics.main import main; sys.exit(main(['--prefix', 'LAB:', '--list']))"
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        for version, python in self.environments.items():
            with self.subTest(python=version):
                ran = subprocess.run([python, *ISOLATED, "-c", program], env=environment, capture_output=True, text=True, check=False)
                self.assertEqual((ran.returncode, ran.stdout), (2, ""))
                self.assertIn("caproto", ran.stderr)
                self.assertEqual(len(ran.stderr.splitlines()), 1)

    def test_all_modules_are_without_warnings_of_a_newer_python(self):
        program = ("import compileall, bushd, bushd_epics, pathlib, sys; folders = [pathlib.Path(one.__file__).parent for one in (bushd, bushd_epics)]; "
                   "sys.exit(not all(compileall.compile_dir(folder, quiet=1, force=True) for folder in folders))")
        for _, said in self.in_each("-I", "-W", "error", "-c", program):
            self.assertEqual(said, "")

    def test_without_a_daemon_it_says_so(self):
        program = "import bushd\ntry:\n    bushd.connect('/nonexistent/control')\nexcept bushd.NoDaemon as error:\n    print(error)"
        for _, said in self.in_each(*ISOLATED, "-c", program):
            self.assertIn("bushd is not running", said)

    def test_what_the_client_stands_on(self):
        for script in ("session_test.py", "parts_test.py", "requests_test.py"):
            list(self.in_each(*ISOLATED, HERE / script))

    def test_it_moves_motors_of_the_real_daemon(self):
        network = [TOP / "tests/tools/with-loopback-multicast"]
        list(self.in_each("-B", HERE / "client_test.py", "Documentation", before=network))

    def test_checkers_find_its_types(self):
        with tempfile.TemporaryDirectory() as folder:
            program = pathlib.Path(folder) / "program.py"
            program.write_text('import bushd\nreveal_type(bushd.connect().move("theta", to=1.0))\n')
            # Debian's checker knows no Python that is newer than Debian's.
            debians = f"{sys.version_info.major}.{sys.version_info.minor}."
            environments = {v: python for v, python in self.environments.items() if v.startswith(debians)}
            self.assertTrue(environments)
            for version, python in environments.items():
                with self.subTest(python=version):
                    command = ["mypy", "--strict", "--cache-dir=/dev/null", f"--python-executable={python}", program]
                    ran = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
                    self.assertNotIn("error", ran.stdout)
                    self.assertIn("bushd.model.MoveResult", ran.stdout)


if __name__ == "__main__":
    sys.exit(unittest.main())
