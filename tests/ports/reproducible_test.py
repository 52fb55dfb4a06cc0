"""The images of a toolchain, built from a copy of the sources in another folder, have the same bytes.

    reproducible_test.py SOURCES TOOLCHAIN IMAGES

IMAGES is the folder in which the build has put those that are compared.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

PARTS = ["CMakeLists.txt", "cmake", "firmware", "lib/engine"]


def build(sources, toolchain, folder):
    """In a folder of another depth, and without a cache that would hand out what was compiled elsewhere."""
    copy = folder / "some where" / "else"
    for part in PARTS:
        target = copy / part
        target.parent.mkdir(parents=True, exist_ok=True)
        (shutil.copytree if (sources / part).is_dir() else shutil.copy)(sources / part, target)
    environment = {**os.environ, "CCACHE_DISABLE": "1", "TZ": "Pacific/Auckland"}
    subprocess.run(["cmake", "-S", copy, "-B", folder / "out", "-G", "Ninja", "-DBUSHD_FIRMWARE_ONLY=ON",
                    f"-DCMAKE_TOOLCHAIN_FILE={copy}/cmake/{toolchain}.cmake", "-DCMAKE_BUILD_TYPE=Release"],
                   check=True, env=environment, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", folder / "out"], check=True, env=environment, stdout=subprocess.DEVNULL)
    return folder / "out"


def main(sources, toolchain, images):
    sources = pathlib.Path(sources)
    images = pathlib.Path(images)
    found = sorted(path for path in images.iterdir() if path.suffix in (".elf", ".hex"))
    assert found, f"no images in {images}"
    with tempfile.TemporaryDirectory() as folder:
        out = build(sources, toolchain, pathlib.Path(folder))
        others = out / "firmware" / "ports" / images.name
        for image in found:
            assert (others / image.name).read_bytes() == image.read_bytes(), f"{image.name} differs"
            print(image.name)


if __name__ == "__main__":
    main(*sys.argv[1:])
