"""Build hook: the C files of a folder -> its `kernels.so`, by the compiler that `ziglang` brings.

No compiler is needed on the machine. The code is for any processor of its kind and any Linux of the
last ten years, and no part of Python's, so that one wheel serves all; products and sums are not
contracted, so that it rounds as numpy does. The same text and compiler give the same bytes,
wherever they are built.
"""

from __future__ import annotations

import platform
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

GLIBC = "2.17"  #: the oldest that a wheel runs on: manylinux2014, as numpy's
FOLDERS = ("probe/surface", "recognizer/touch")
OPTIONS = [
    "-O3", "-ffp-contract=off", "-fno-math-errno", "-shared", "-fPIC", "-mcpu=baseline",
    "-g0", "-s",
]  # fmt: skip


class CompiledKernels(BuildHookInterface):  # type: ignore[misc, type-arg]
    """Compiles into the tree, for a wheel as for an editable install."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002
        """Build the libraries and name them as parts of the wheel."""
        for name in FOLDERS:
            compile_folder(Path(self.root) / name)
            build_data["artifacts"].append(f"{name}/kernels.so")
        build_data["pure_python"] = False
        machine = platform.machine()
        build_data["tag"] = f"py3-none-manylinux_{GLIBC.replace('.', '_')}_{machine}"


def compile_folder(folder: Path) -> None:
    """Build the library of a folder; it knows which text it was made of."""
    sources = sorted(folder.rglob("*.[ch]"))
    made, draft = folder / "kernels.so", folder / "kernels.so.draft"
    text = b"".join(source.read_bytes() for source in sources)
    made_of = f"-DSOURCE_SUM={zlib.crc32(text)}u"
    compiled = [str(source.relative_to(folder)) for source in sources if source.suffix == ".c"]
    arguments = [*OPTIONS, made_of, *compiled, "-lm", "-o", draft.name]
    # From its own folder, so that no name of a folder comes into the library.
    target = f"{platform.machine()}-linux-gnu.{GLIBC}"
    command = [sys.executable, "-m", "ziglang", "cc", "-target", target, *arguments]
    subprocess.run(command, check=True, cwd=folder)  # noqa: S603
    draft.replace(made)
