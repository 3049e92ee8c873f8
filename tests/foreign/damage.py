"""Damage to bytes, and to what they mean."""

import io
import json
import os
import random
import socket
import zipfile
from contextlib import closing, suppress
from functools import cache
from pathlib import Path
from typing import Any

import yaml

EXTREMES = (0, 1, -1, 2**7, 2**8 - 1, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 10**9, 2**40,
            2**63 - 1, 2**63, 2**64 - 1)  # fmt: skip
WORDS = ("", " ", ".", "..", "../../secret.txt", "/etc/passwd", "a/b", "a\\b", "a\0b", "\ud800",
         "x" * 5000, "é" * 300, "\u202egnp.exe", "-", "nan", "NaN", "inf", "1e999", "0x10", "null",
         "~", "true", "60 mm", "-3 in", "12 deg", "\x1b[2J", "con", "CON.stl", "F1", "{}", "[]",
         "*", "%s", "'; drop table objects; --", "sqlite://", "file:",
         "http://127.0.0.1/")  # fmt: skip
NUMBERS = (0, -1, 1, 2, 3, 255, 256, 65_536, 10**9, 2**63, -(2**63) - 1, 10**400, 0.5, -0.0, 1e-320,
           1e308, float("nan"), float("inf"), float("-inf"))  # fmt: skip


def damaged(rng: random.Random, content: bytes) -> bytes:
    """Return the content with one to three places changed."""
    made = bytearray(content)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        if not made:
            break
        at, length = rng.randrange(len(made)), min(rng.choice((1, 2, 4, 8, 64, 512)), len(made))
        other = rng.randrange(len(made) - length + 1)
        do = rng.randrange(9)
        if do in (0, 1):
            made[at] ^= 1 << rng.randrange(8)
        elif do == 2:
            made[at] = rng.randrange(256)
        elif do == 3:
            width = rng.choice((1, 2, 4, 8))
            number = rng.choice(EXTREMES) % 256**width
            at = at // width * width if rng.random() < 0.5 else at
            made[at : at + width] = number.to_bytes(width, rng.choice(("little", "big")))
        elif do == 4:
            del made[at:]
        elif do == 5:
            made[at : at + length] = bytes(len(made[at : at + length]))
        elif do == 6:
            at = min(at, len(made) - length)
            a, b = made[at : at + length], made[other : other + length]
            made[at : at + length], made[other : other + length] = b, a
        elif do == 7:
            made[at:at] = rng.choice((made[other : other + length], rng.randbytes(length)))
        else:
            del made[at : at + length]
    return bytes(made)


def damaged_text(rng: random.Random, text: str, splices: tuple[str, ...]) -> bytes:
    """Return text with pieces put in, taken out and doubled, or bytes damaged."""
    if rng.random() < 0.2:
        return damaged(rng, text.encode())
    for _ in range(rng.choice((1, 1, 2, 4))):
        at, removed = rng.randrange(len(text) + 1), rng.choice((0, 0, 1, 3, 40, len(text)))
        added = rng.choice((*splices, *splices, *WORDS, *map(str, NUMBERS[:14]), text[:60]))
        if rng.random() < 0.3:
            lines = text.split("\n")
            line = rng.randrange(len(lines))
            lines[line:line] = [lines[rng.randrange(len(lines))]] * rng.choice((1, 1, 50))
            text = "\n".join(lines)
        text = text[:at] + added + text[at + removed :]
    return text.encode("utf-8", "surrogatepass")


# -- damage to what is meant


def anything(rng: random.Random, depth: int = 0) -> Any:
    """Return any value that YAML and JSON can hold."""
    do = rng.randrange(8 if depth < 2 else 5)
    if do == 0:
        return rng.choice((None, True, False))
    if do in (1, 2):
        return rng.choice(NUMBERS)
    if do in (3, 4):
        return rng.choice(WORDS)
    some = range(rng.choice((0, 1, 2, 3)))
    if do == 5:
        return {rng.choice(WORDS): anything(rng, depth + 1) for _ in some}
    if do == 6:
        return [[] if depth else 0] * rng.choice((1, 1000))
    return [anything(rng, depth + 1) for _ in some]


def somewhere(rng: random.Random, value: Any) -> tuple[Any, Any] | None:
    """Return a random (holder, key) in nested lists and mappings; None in an empty one."""
    found = None
    while isinstance(value, dict | list) and value:
        key = rng.choice(list(value)) if isinstance(value, dict) else rng.randrange(len(value))
        found = value, key
        if rng.random() < 0.35:
            break
        value = value[key]
    return found


def mutated(rng: random.Random, value: Any) -> Any:
    """Return a copy of nested lists and mappings in which one to three things are others."""
    value = json.loads(json.dumps(value))
    for _ in range(rng.choice((1, 1, 2, 3))):
        found, other = somewhere(rng, value), somewhere(rng, value)
        if found is None or other is None:
            return anything(rng)
        holder, key = found
        do = rng.randrange(7)
        if do in (0, 1, 2):
            holder[key] = anything(rng)
        elif do == 3:
            del holder[key]
        elif do == 4:
            holder[key] = rng.choice(([holder[key]], {"value": holder[key]}, [holder[key]] * 2))
        elif do == 5 and isinstance(holder, dict):
            holder[rng.choice((*WORDS, "name", "version", "shape", "rows"))] = anything(rng)
        else:
            with suppress(KeyError, IndexError):
                holder[key] = json.loads(json.dumps(other[0][other[1]]))
    return value


def written_json(rng: random.Random, value: Any) -> bytes:
    """Return JSON, also as no one should write it: keys twice, deep, other encodings."""
    text = json.dumps(value, indent=rng.choice((None, 1)))
    do = rng.randrange(12)
    if do == 0 and isinstance(value, dict) and value:
        key = rng.choice(list(value))
        text = text.rstrip()[:-1] + f", {json.dumps(key)}: {json.dumps(anything(rng))}}}"
    elif do == 1:
        depth = rng.choice((100, 100_000))
        text = text.replace(rng.choice(("0", "null", "[")), "[" * depth + "]" * depth, 1)
    elif do == 2:
        return text.encode(rng.choice(("utf-16", "utf-8-sig", "latin-1", "utf-32")), "replace")
    elif do == 3:
        text = text.replace("1", "1" + "0" * 5000, 1)
    return text.encode("utf-8", "surrogatepass")


def written_yaml(rng: random.Random, value: Any) -> bytes:
    """Return YAML, also with what YAML can do to its reader."""
    text = yaml.safe_dump(value, sort_keys=False, allow_unicode=True)
    do = rng.randrange(12)
    if do == 0:
        bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n"
        for level in range(1, 9):
            bomb += f"a{level}: &a{level} [{', '.join([f'*a{level - 1}'] * 9)}]\n"
        text = bomb + text
    elif do == 1:
        text = "&a " + text if rng.random() < 0.5 else f"a: &a\n  b: *a\n{text}"
    elif do == 2:
        depth = rng.choice((60, 100_000))
        text += "deep: " + "[" * depth + "]" * depth + "\n"
    elif do == 3:
        text += f"{text.split(':')[0]}: {text.split(':')[0]}\n"
    elif do == 4:
        text += rng.choice(("x: !!python/object/apply:os.system [id]\n", "<<: {a: 1}\n", "? [a]\n",
                            "x: !!binary aGk=\n", "---\n" + text, "%TAG ! a:\n"))  # fmt: skip
    return text.encode("utf-8", "surrogatepass")


def no_file(rng: random.Random, path: Path) -> None:
    """Put something else than a file at a path."""
    path.unlink(missing_ok=True)
    do = rng.randrange(8)
    if do == 0:
        path.mkdir()
    elif do in (1, 2):
        os.mkfifo(path)
    elif do == 3:
        path.symlink_to("/dev/zero")
    elif do == 4:
        path.symlink_to(path.name)
    elif do == 5:
        path.symlink_to("/dev/" + rng.choice(("null", "full", "random")))
    elif do == 6:
        with closing(socket.socket(socket.AF_UNIX)) as line:
            before = Path.cwd()
            os.chdir(path.parent)
            line.bind(path.name)
            os.chdir(before)
    else:
        path.write_bytes(b"")


@cache
def bomb(megabytes: int, name: str, head: bytes) -> bytes:
    """Return a zip whose content is a thousand times as large."""
    made = io.BytesIO()
    with (
        zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open(name, "w") as out,
    ):
        out.write(head)
        for _ in range(megabytes):
            out.write(bytes(1 << 20))
    return made.getvalue()


def numbers_changed(rng: random.Random, text: str) -> str:
    """Return text in which some of its numbers are others."""
    words = text.split(" ")
    numbered = [i for i, word in enumerate(words) if any(c.isdigit() for c in word)]
    for i in rng.sample(numbered, min(len(numbered), rng.choice((1, 1, 3, 20)))):
        end = "\n" if words[i].endswith("\n") else ""
        words[i] = str(rng.choice((*NUMBERS, rng.uniform(-99, 99)))) + end
    return " ".join(words)
