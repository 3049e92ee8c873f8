"""Compiled loops as this machine's compiler makes them, warnings being errors."""

import shutil
import subprocess
import zlib


def compile_kernels(sources, made):
    """Make a library of C files, which knows its text as `hatch_build.py` has it."""
    options = ["-O2", "-ffp-contract=off", "-shared", "-fPIC", "-Wall", "-Werror"]
    made_of = f"-DSOURCE_SUM={zlib.crc32(b''.join(one.read_bytes() for one in sources))}u"
    compiled = [one for one in sources if one.suffix == ".c"]
    command = [shutil.which("cc"), *options, made_of, *compiled, "-o", made, "-lm"]
    subprocess.run(command, check=True)
