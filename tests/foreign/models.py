"""Shapes of CAD, G-code and 3MF."""

import io
import os
import signal
import struct
import zipfile
from contextlib import suppress
from functools import cache

import numpy as np

from foreign.case import BOMBS_MB, FIXTURES, TESTS, FaultError, Kind
from foreign.damage import EXTREMES, bomb, damaged, damaged_text, numbers_changed


@cache
def shapes(suffix):
    """Return the models of the fixtures with this suffix."""
    return tuple(f.read_bytes() for f in sorted((FIXTURES / "shapes").glob(f"*{suffix}")))


def _triangles(rng):
    content = bytearray(shapes(".stl")[0])
    count = (len(content) - 84) // 50
    for _ in range(rng.choice((1, 1, 3, count))):
        at = 84 + 50 * rng.randrange(count) + 12 + 4 * rng.randrange(9)
        number = rng.choice((np.nan, np.inf, 3e38, -3e38, 1e-45, 0.0, rng.uniform(-99, 99)))
        content[at : at + 4] = struct.pack("<f", number)
    if rng.random() < 0.3:
        content[80:84] = struct.pack("<I", rng.choice(EXTREMES) % 2**32)
    return bytes(content)


def _shape_writer(suffix):
    splices = {
        ".stl": ("facet", "vertex 1 2", "endsolid", "\0", "solid", "nan"),
        ".obj": ("f 1 2 3\n", "f -1 -2 -3\n", "f 1/1/1 2//2 99\n", "v 1 2 nan\n", "v 1e999 0 0\n",
                 "f\n", "\\\n", "mtllib ../secret.txt\n", "f 0 0 0\n", "g x\n", "curv\n"),
        ".step": ("#1=", ");", "(", "*", "$", "'", "#99999999", "/*", "ENDSEC;", "#10=#10;",
                  "CARTESIAN_POINT('',(1E999,0.,0.))", "ADVANCED_FACE('',(),#1,.T.)"),
    }[suffix]  # fmt: skip

    def write(rng, folder):
        path = folder / f"m{suffix}"
        content = rng.choice(shapes(suffix))
        do = rng.random()
        if suffix == ".stl" and do < 0.35:
            content = _triangles(rng)
        elif b"\0" in content or do < 0.5:
            content = damaged(rng, content)
        elif do < 0.75:
            content = numbers_changed(rng, content.decode()).encode()
        else:
            content = damaged_text(rng, content.decode(), splices)
        path.write_bytes(content)
        return path

    return write


def read_model(path, _out):
    from generator.polyhedron.read import read_shape

    solid = read_shape(path)
    if not (np.isfinite(solid.vertices).all() and len(solid.faces) >= 4):
        raise FaultError("wrong value", "a solid that is none")


def load_kernel():
    """Load the CAD kernel, before limits and forks."""
    import OCP.STEPControl  # noqa: F401


def read_model_in_fork(path, out):
    from generator.polyhedron.read import kernel, step

    def run(_module, arguments, **_):
        child = os.fork()
        if child == 0:
            code = 1
            with suppress(BaseException):
                for stream in (1, 2):
                    os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
                kernel.main(*arguments)
                code = 0
            os._exit(code)
        try:
            status = os.waitpid(child, 0)[1]
        except BaseException:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            raise
        return os.waitstatus_to_exitcode(status), b""

    before = step.run_limited
    step.run_limited = run
    try:
        read_model(path, out)
    finally:
        step.run_limited = before


# -- G-code and 3MF


@cache
def gcodes():
    folder = TESTS / "unit" / "generator" / "gcode"
    return tuple(file.read_text() for file in sorted(folder.glob("*.gcode")))


def write_3mf(rng, folder):
    """Write damaged G-code, mostly as the plate in a 3MF."""
    path = folder / "p.gcode.3mf"
    do = rng.random()
    code = rng.choice(gcodes())
    lines = ("G1 X1e999 E1\n", "G1 X Y E1\n", "G2 X0 Y0 I0 J0 E1\n", "M82\n", "G1 E-1e308\n",
             "G92 E0\n", ";TYPE:x\n", "G2 X1 Y1 R1e-300 E9\n", "G1 Xnan E1\n", "G3 I1e12 J1 E1\n",
             ";WIDTH:nan\n", ";HEIGHT:-1\n", "M200 D0\n", "M221 S1e99\n")  # fmt: skip
    if do < 0.6:
        content = damaged_text(rng, code, lines)
    else:
        content = numbers_changed(rng, code.replace("X", "X ").replace("X ", "X")).encode()
    if do < 0.3:
        path.write_bytes(content)
        return path
    if do < 0.34:
        head = gcodes()[0].encode()
        path.write_bytes(bomb(rng.choice(BOMBS_MB), "Metadata/plate_1.gcode", head))
        return path
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", rng.choice((0, 8, 8, 12, 14))) as archive:
        names = ("Metadata/plate_1.gcode", "../../x.gcode", "/x.gcode", "a.gcode/", "x" * 999,
                 ".gcode")  # fmt: skip
        for name in rng.sample(names, rng.choice((0, 1, 1, 2))):
            archive.writestr(name, content)
    path.write_bytes(damaged(rng, made.getvalue()) if do < 0.8 else made.getvalue())
    return path


def read_3mf(path, _out):
    """Read the moves of a plate, and lay its beads."""
    from generator.printed.deposit import beads_of
    from generator.printed.gcode import read_gcode

    if not np.isfinite(beads_of(read_gcode(path)).width_mm).all():
        raise FaultError("wrong value", "beads that have no width")


KINDS = {
    "stl": Kind(_shape_writer(".stl"), read_model),
    "obj": Kind(_shape_writer(".obj"), read_model),
    "step": Kind(_shape_writer(".step"), read_model_in_fork, sound=(load_kernel,)),
    "3mf": Kind(write_3mf, read_3mf),
}
