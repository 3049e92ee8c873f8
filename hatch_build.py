"""Build hook: four C files -> `kernels.so`, by the compiler that `ziglang` brings.

No compiler is needed on the machine. The code is for any processor of its kind, so that a wheel
may be kept and moved; products and sums are not contracted, so that it rounds as numpy does.
"""

from __future__ import annotations

import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FOLDER = "recognizer/touch"
OPTIONS = ["-O3", "-ffp-contract=off", "-fno-math-errno", "-shared", "-fPIC", "-mcpu=baseline"]


class CompiledKernels(BuildHookInterface):  # type: ignore[misc, type-arg]
    """Compiles into the tree, for a wheel as for an editable install."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002
        """Build the library and name it as a part of the wheel."""
        folder = Path(self.root) / FOLDER
        sources = sorted(folder.rglob("*.c"))
        made, draft = folder / "kernels.so", folder / "kernels.so.draft"
        compiler = [sys.executable, "-m", "ziglang", "cc"]
        text = b"".join(source.read_bytes() for source in sources)
        made_of = f"-DSOURCE_SUM={zlib.crc32(text)}u"
        arguments = [*OPTIONS, made_of, *map(str, sources), "-lm", "-o", str(draft)]
        subprocess.run([*compiler, *arguments], check=True)  # noqa: S603
        draft.replace(made)
        build_data["artifacts"].append(f"{FOLDER}/kernels.so")
        build_data["pure_python"] = False
        build_data["infer_tag"] = True
