"""Build hook: `evaluate.c` -> `evaluate.so`, by the C compiler that the package `ziglang` brings.

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

SOURCE = "recognizer/touch/symbols/evaluate.c"
OPTIONS = ["-O3", "-ffp-contract=off", "-fno-math-errno", "-shared", "-fPIC", "-mcpu=baseline"]


class CompiledKernels(BuildHookInterface):  # type: ignore[misc, type-arg]
    """Compiles into the tree, for a wheel as for an editable install."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002
        """Build the library and name it as a part of the wheel."""
        source = Path(self.root) / SOURCE
        made = source.with_suffix(".so")
        draft = made.with_suffix(".so.draft")
        compiler = [sys.executable, "-m", "ziglang", "cc"]
        made_of = f"-DSOURCE_SUM={zlib.crc32(source.read_bytes())}u"
        arguments = [*OPTIONS, made_of, str(source), "-lm", "-o", str(draft)]
        subprocess.run([*compiler, *arguments], check=True)  # noqa: S603
        draft.replace(made)
        build_data["artifacts"].append(str(Path(SOURCE).with_suffix(".so")))
        build_data["pure_python"] = False
        build_data["infer_tag"] = True
