# ruff: noqa: E501 - a command a line
"""Every page of help, what every command says as text and as JSON, and every sort of error.

Command -> exit code, stdout (as JSON where it is), stderr. Commands run in one folder after
another, so that later ones meet the files of earlier ones. Folders, times of day, versions and
durations are replaced by words; numbers in JSON are compared as numbers.
"""

import gzip
import json
import shlex
import shutil
import sqlite3
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from corpora.commands import DATA, FIXTURES, LAB_KEY, Commands, normal_value, started_commands

NAME = "texts"
PARTS = ("help", "making", "decoding", "probing", "reading", "validating", "misuse", "specs")

#: Lines are commands, in their order: one for each of the words {in,braces}; those that end in
#: [twice] also run with --json.
COMMANDS = {
    "help": """
encode-object --help
encode-object {init,schema,printers,lab,list,show,retire,export,import} --help
decode-window --help
probe-sensor --help
probe-sensor {list,info,types,live,record,replay,export,import,repair,simulate,calibrate} --help
probe-sensor calibrate {bias,loads,port} --help
probe-kit --help
recognize-object {--help,as-built --help,check --help}
validate-set {--help,compare --help,worlds --help,repeat --help,report --help}
open-bench --help
""",
    "making": """
encode-object init --json
encode-object init {cube,box,triangular_prism,tetrahedron,octahedron,dodecahedron,prism,pyramid}
encode-object init {cylinder,cone,polyhedron,file}
encode-object init box -o box.yaml [twice]
encode-object init box -o box.yaml --force
encode-object schema
encode-object {printers,--version} [twice]
encode-object cube.yaml --dry-run --lab-key F1XT-VRES-0000-000Q [twice]
encode-object cube.yaml --database dry.db --dry-run --lab-key F1XT-VRES-0000-000Q [twice]
encode-object cube.yaml --database new.db --lab-key F1XT-VRES-0000-000Q --format stl [twice]
encode-object lab --database new.db [twice]
encode-object cube.yaml --database new.db --format stl --replace --json
encode-object changed.yaml --database new.db --format stl [twice]
encode-object changed.yaml --database new.db --format stl --replace
encode-object set.yaml --database set.db --lab-key F1XT-VRES-0000-000Q --format stl,3mf [twice]
encode-object set.yaml --database set2.db --lab-key F1XT-VRES-0000-000Q --format stl --replace -j 2 --json
encode-object blank.yaml --database new.db --format stl [twice]
encode-object cube.yaml --database other.db --lab-key 0000-0000-0000-0000 --format stl
encode-object cube.yaml --database other.db --lab-key 0000-0000-0000-0000 --format stl --replace
encode-object cube.yaml --database verified.db --lab-key F1XT-VRES-0000-000Q --format 3mf --replace --verify
encode-object {lab,list,show Cube,show Rod} [twice]
encode-object show Guest --json
encode-object show "Small box-2" [twice]
encode-object show Prism --sensor-type gel-24x32
encode-object show Nobody [twice]
encode-object retire Prism
encode-object retire Prism [twice]
encode-object retire Prism --undo --json
encode-object retire "Small box-1" {--free,--free --yes}
encode-object list --json
encode-object export out.db --object Cube --object Rod
encode-object export out.db {--json,--force --json}
encode-object import out.db --database {into.db --dry-run,into.db --json,into.db}
encode-object import guest.db --database into.db --rename Guest=Visitor [twice]
encode-object import out.db --database new.db [twice]
encode-object import out.db --database new.db --skip-refused
encode-object list --database into.db --json
encode-object lab --database into.db
encode-object list --database old.db --json
encode-object lab --database old.db [twice]
encode-object list --database {newer.db,foreign.db,damaged.db,gone.db} [twice]
encode-object show Cube --database text.db [twice]
encode-object list --database gone/lab.db
encode-object list --database postgresql://nobody@127.0.0.1:1/none [twice]
encode-object list --database mysql://host/name
encode-object cube.yaml --database newer.db [twice]
encode-object import {newer.db,text.db}
probe-kit gel-24x32 -o kit
""",
    "decoding": """
decode-window "01 11 01 01 00 01" --profile thesis [twice]
decode-window "01 11 01 01 00 01" --profile thesis --method {table,serial,milestones} [twice]
decode-window "01 11 01 01 00 01" --profile thesis --method {logarithm,likelihood} [twice]
decode-window "01 1? 01 01 00 01" --profile thesis --method likelihood --json
decode-window "0123 1032 2310" --json
decode-window "012 103 231" --method likelihood --rotations 0,1,2,3 --json
decode-window "012 103 231" --method likelihood --top 3 [twice]
decode-window "012 1?3 2?1" [twice]
decode-window 012 103 231 --method milestones --json
decode-window "0?2 1?3 2?1" --method likelihood --lab-key F1XT-VRES-0000-000Q --json
decode-window "012 103 231" --profile large --json
decode-window "012 103 231 130" --profile fine --json
decode-window "0123 1032 2310" --database lab.db --json
decode-window "1203 0132 2301" --database lab.db --method likelihood [twice]
decode-window "01 11 01 01" --profile product --json
decode-window "01 11" --profile thesis [twice]
decode-window "05 11" [twice]
decode-window "01 1" [twice]
decode-window "01 xy" [twice]
decode-window "01" --nothing
decode-window "01" {--profile,--method} none [twice]
decode-window "01" --array "{" [twice]
decode-window "01" --array "[1]"
decode-window "01" --array "{}" --profile thesis
decode-window "01" --array gone.json
decode-window "01 11 01 01 00 01" --profile thesis --method likelihood {--error 2,--rotations x}
decode-window "01" --database gone.db [twice]
decode-window "01" --lab-key hello
decode-window --version [twice]
decode-window
""",
    "probing": """
probe-sensor {--version,types,types fsr-16,types gel-24x32} [twice]
probe-sensor types {mat-32x32,flexitac-12x32,flexitac-16x32,fsr-8x8,--schema}
probe-sensor types {fsr16,own-type.yaml,bad-type.yaml} [twice]
probe-sensor types gone.yaml
probe-sensor info {touch.h5,touches.h5,scan.h5,calibration.json,gone.h5,gone.json,text.h5} [twice]
probe-sensor info {newer.h5,damaged.h5,truncated.h5,bad-calibration.json} [twice]
probe-sensor info {newer-calibration.json,/dev/ttyGONE,serial:///dev/ttyGONE,sim:?speed=2} [twice]
probe-sensor info smoke:thing [twice]
probe-sensor info sim: --sensor 8
probe-sensor live {sim:nothing,sim:gone.db#Cube/F1}
probe-sensor record file:gone.h5 -o a.h5
probe-sensor record sim: -o a.csv [twice]
probe-sensor record sim: -o {gone/a.h5 --frames 1,a.h5 --calibration gone.json}
probe-sensor record sim:
probe-sensor record file:touch.h5 -o copy.h5 --frames 4
probe-sensor replay touch.h5 --speed 0
probe-sensor replay scan.h5 --speed 0 --json
probe-sensor replay {gone.h5,touch.h5 --speed fast,touch.h5 --speed nan}
probe-sensor export touch.h5 --csv touch.csv --npy touch.npy [twice]
probe-sensor export scan.h5 --csv scan.csv
probe-sensor export scan.h5 --mcap scan.mcap [twice]
probe-sensor export touch.h5 --png touch.png --frame 99
probe-sensor export touch.h5 --csv touch.csv [twice]
probe-sensor export {gone.h5 --npy a.txt,gone.h5 --png gone/a.png,touch.h5}
probe-sensor import {arrays.npz -o imported.h5,two.npz -o two.h5} [twice]
probe-sensor import two.npz -o two.h5 --dataset left --rate 100 --sensor left
probe-sensor import short.csv -o short.h5 [twice]
probe-sensor import {gone.npy -o a.h5,touch.npy -o touch.h5}
probe-sensor import touch.npy -o rate.h5 --rate -1
probe-sensor repair {touch.h5,truncated.h5,beheaded.h5} [twice]
probe-sensor repair gone.h5
probe-sensor calibrate bias blank0.h5 [twice]
probe-sensor calibrate bias gone.h5
probe-sensor calibrate loads blank0.h5=0 load20.h5=20 load60.h5=60 -o made.json
probe-sensor calibrate loads blank0.h5=0 load20.h5=20 load60.h5=60 -o made.json [twice]
probe-sensor calibrate loads {gone.h5 -o a.json,gone.h5=0 -o a.txt}
probe-sensor calibrate port sim: -o a.json --newtons 1,b
probe-sensor calibrate
probe-sensor simulate lab.db#Cube/F1 --seed 1 [twice]
probe-sensor simulate lab.db#Cube/F1 --x 14 --y 20 --theta 30 --force 80 --seed 3 --json
probe-sensor simulate lab.db#Rod/F1 --seed 1 --json
probe-sensor simulate washer --x 1 --accuracy layer
probe-sensor simulate washer --seed 2 --truth truth.json --touches 2 --noise quiet --json
probe-sensor simulate lab.db#Cube/F1 --scan raster --touches 3 --seed 1 --json
probe-sensor simulate lab.db#Cube/F1 --scan kinesthetic --touches 2 --seed 1 -o way.h5 --json
probe-sensor simulate {lab.db#Cube/F9,lab.db#Nobody/F1} [twice]
probe-sensor simulate {lab.db#Cube,gone.stl,cube}
probe-sensor simulate gone.db#Cube/F1 [twice]
probe-sensor simulate washer --x 99 -o a.h5
probe-sensor simulate washer {--accuracy 1e-9,--theta inf,--truth a.txt}
probe-sensor simulate washer --force -1 [twice]
probe-sensor simulate washer --nope
probe-sensor simulate {broken.stl --database lab.db,washer --overlay wool} [twice]
probe-sensor simulate washer --noise loud
probe-sensor {simulate,fly}
probe-sensor
""",
    "reading": """
recognize-object {touch.h5,touches.h5} [twice]
recognize-object touches.h5 --every --json
recognize-object touches.h5 --scan [twice]
recognize-object scan.h5 --scan {--json,--method thesis --json}
recognize-object {gel.h5,small.h5} [twice]
recognize-object plain.h5 --json
recognize-object touch.h5 --flip columns [twice]
recognize-object touch.h5 --flip sideways
recognize-object touch.h5 --joints 10,20,-30,5,0 [twice]
recognize-object touch.h5 --touches 1 --overlay pad --json
recognize-object touch.h5 --sensor-type gel-24x32 [twice]
recognize-object touch.h5 --mcap answers.mcap --json
recognize-object {old.h5 --database old.db,blank0.h5} [twice]
recognize-object load20.h5
recognize-object {built.h5 --learn,touch.h5 --sensor-state} state.json --json
recognize-object as-built built.h5 {--json,--store --material PETG}
recognize-object as-built touch.h5 [twice]
recognize-object check touch.h5 --at Cube/F1 [twice]
recognize-object check touches.h5 --at Cube/F3 --every
recognize-object check {touch.h5 --at Cube/F9,touch.h5}
recognize-object {gone.h5,text.h5,newer.h5,damaged.h5,bad-type.h5,other-shape.h5} [twice]
recognize-object touch.h5 --database {gone.db,text.h5,newer.db} [twice]
recognize-object touch.h5 --plot a.pdf
recognize-object touch.h5 {--calibration,--sensor-state} gone.json [twice]
recognize-object touch.h5 --sensor-state calibration.json
recognize-object --port serial:///dev/nowhere [twice]
recognize-object {--port smoke:,--port sim:lab.db#Cube/F1?overlay=wool,--json,a.h5 --port sim:}
recognize-object a.h5 --follow
recognize-object a.h5 --overlay wool [twice]
recognize-object a.h5 --joints 1,2
recognize-object a.h5 --joints 1,2,3,4,nan
recognize-object a.h5 {--touches 0,--nope} [twice]
recognize-object touch.h5 --publish ftp://nowhere/x
recognize-object --version [twice]
recognize-object
""",
    "validating": """
validate-set cube.yaml --touches 12 --study 0 --seed 3 -o {run --json,run}
validate-set cube.yaml --touches 12 --study 0 --seed 4 --noise hard --policy next -o other --json
validate-set --database lab.db --surfaces database --touches 8 --study 0 -o registered --json
validate-set run --resume
validate-set {compare run other,worlds run other,repeat run 3} --json
validate-set {repeat run 99,repeat gone 1,report gone,compare run gone}
validate-set gone.yaml --touches 4 -o new [twice]
validate-set cube.yaml --touches 0 -o new
validate-set cube.yaml --touches 4 --kinds face,moon -o new [twice]
validate-set cube.yaml --touches 4 --noise loud -o new [twice]
validate-set cube.yaml --touches 4 {--surfaces clouds,--engine bullet,--policy best} -o new
validate-set cube.yaml --touches 4 --export csv -o new
validate-set --database gone.db --touches 4 -o new [twice]
validate-set --version [twice]
validate-set
""",
    "misuse": """
encode-object
encode-object {--dry-runn c.yaml,list --data x} [twice]
encode-object --json-lines
encode-object {--dry-run,cube.yaml --format stepp,cube.yaml --database mysql://h/n} [twice]
encode-object cube.yaml --lab-key hello [twice]
encode-object cube.yaml --lab-key 0123-4567-89AB-CDEQ
encode-object cube.yaml --sensor-type {nose,bad-type.yaml} [twice]
encode-object cube.yaml {--jobs 0,--print-profile none --printed-check}
encode-object cube.yaml --printed-check --print-faults broken
encode-object cube.yaml -o text.h5/under --database a.db --lab-key F1XT-VRES-0000-000Q [twice]
encode-object gone.yaml [twice]
encode-object folder
encode-object init {prisma,cube -o cube.yaml,cube -o gone/cube.yaml} [twice]
encode-object {show,retire,export}
encode-object import gone.db [twice]
encode-object import lab.db --rename {Cube,Nobody=Somebody}
encode-object export {lab.db,out.db --object Nobody}
encode-object fly
probe-kit {nose,bad-type.yaml} -o kit [twice]
probe-kit
probe-kit fsr-16 -o text.h5/kit
probe-kit --version [twice]
open-bench --port smoke: --database lab.db
open-bench {--database gone.db,--database newer.db,--web-port 70000}
open-bench --overlay wool --database lab.db
open-bench --nope
""",
}

# One spec for every sort of mistake; each is read with --dry-run, every fourth as JSON too.
SPECS = {
    "empty": "",
    "not-yaml": "name: Cube\nshape: {cube: 60 mm\n",
    "tab": "name: Cube\nshape:\n\tcube: 60 mm\n",
    "list": "- Cube\n- Box\n",
    "two-documents": "name: A\n---\nname: B\n",
    "twice": "name: Cube\nname: Box\nshape: {cube: 60 mm}\n",
    "alias": "name: &a Cube\nshape: {cube: 60 mm}\noutput: {folder: *b}\n",
    "unknown-key": "name: Cube\nshape: {cube: 60 mm}\nlayuot: net\n",
    "unknown-nested": "name: Cube\nshape: {cube: 60 mm}\nsymbols: {pich: 7 mm}\n",
    "misplaced": "name: Cube\nshape: {cube: 60 mm}\npitch: 7 mm\n",
    "no-name": "shape: {cube: 60 mm}\n",
    "no-shape": "name: Cube\n",
    "two-shapes": "name: Cube\nshape: {cube: 60 mm, tetrahedron: 50 mm}\n",
    "unknown-shape": "name: Cube\nshape: {sphere: 60 mm}\n",
    "other-name": "name: Cube\nshape: {brick: [4, 5, 6]}\n",
    "bad-unit": "name: Cube\nshape: {cube: 60 furlongs}\n",
    "no-number": "name: Cube\nshape: {cube: large}\n",
    "negative": "name: Cube\nshape: {cube: -60 mm}\n",
    "nan": "name: Cube\nshape: {cube: .nan}\n",
    "huge": "name: Cube\nshape: {cube: 9 km}\n",
    "two-sides": "name: Box\nshape: {box: [80 mm, 80 mm]}\n",
    "sides": "name: P\nshape: {prism: {sides: 2, side: 40 mm, height: 80 mm}}\n",
    "side-and-radius": "name: P\nshape: {prism: {sides: 6, side: 4 cm, radius: 4 cm, "
    "height: 8 cm}}\n",
    "flat": "name: P\nshape:\n  polyhedron:\n    vertices: [[0,0,0],[9,0,0],[0,9,0],[9,9,0]]\n"
    "    faces: [[0,1,2],[1,3,2],[0,2,1],[1,2,3]]\n",
    "open": "name: P\nshape:\n  polyhedron:\n    vertices: [[0,0,0],[60,0,0],[0,60,0],[0,0,60]]\n"
    "    faces: [[0,2,1],[0,1,3],[1,2,3],[0,1,2]]\n",
    "bent": "name: P\nshape:\n  polyhedron:\n"
    "    vertices: [[0,0,0],[60,0,0],[60,60,0],[0,60,9],[30,30,60]]\n"
    "    faces: [[0,3,2,1],[0,1,4],[1,2,4],[2,3,4],[3,0,4]]\n",
    "no-vertex": "name: P\nshape:\n  polyhedron:\n"
    "    vertices: [[0,0,0],[60,0,0],[0,60,0],[0,0,60]]\n"
    "    faces: [[0,2,1],[0,1,3],[1,2,3],[0,3,7]]\n",
    "missing-file": "name: M\nshape: {file: gone.stl}\n",
    "other-file": "name: M\nshape: {file: notes.txt}\n",
    "damaged-file": "name: M\nshape: {file: broken.stl}\n",
    "missing-scale": "name: M\nshape: {file: gone.stl, scale: 0}\n",
    "unknown-profile": "name: Cube\nshape: {cube: 60 mm}\nprofile: one-tuch\n",
    "profile-and-encoding": "name: Cube\nshape: {cube: 60 mm}\nprofile: thesis\n"
    "encoding: {family: prba, order: 2, degree: 12, rows: 63, columns: 65, window: 6x2}\n",
    "not-primitive": "name: Cube\nshape: {cube: 60 mm}\nencoding: {family: prmva, order: 2, "
    "degree: 4, polynomial: x^4+x^2+1, rows: 3, columns: 5, window: 2x2}\n",
    "wrong-size": "name: Cube\nshape: {cube: 60 mm}\nencoding: {family: prba, order: 2, "
    "degree: 12, rows: 64, columns: 65, window: 6x2}\n",
    "unknown-alphabet": "name: Cube\nshape: {cube: 60 mm}\nsymbols: {alphabet: runes}\n",
    "small-alphabet": "name: Cube\nshape: {cube: 60 mm}\nprofile: product\n"
    "symbols: {alphabet: thesis-2}\n",
    "narrow-stroke": "name: Cube\nshape: {cube: 60 mm}\nsymbols: {stroke: 0.1 mm}\n",
    "wide-stroke": "name: Cube\nshape: {cube: 60 mm}\nsymbols: {pitch: 5 mm, stroke: 4 mm}\n",
    "small-pitch": "name: Cube\nshape: {cube: 60 mm}\nsymbols: {pitch: 0.5 mm}\n",
    "steep": "name: Cube\nshape: {cube: 60 mm}\nsymbols: {draft: 80 deg}\n",
    "thin-wall": "name: Cube\nshape: {cube: 60 mm}\nprint: {wall: 0.1 mm}\n",
    "thick-wall": "name: Cube\nshape: {cube: 30 mm}\nprint: {wall: 29 mm}\n",
    "unknown-printer": "name: Cube\nshape: {cube: 60 mm}\nprint: {printer: prusa-mk9}\n",
    "own-printer": "name: Cube\nshape: {cube: 60 mm}\nprint: {printer: {nozle: 0.4 mm}}\n",
    "too-large": "name: Cube\nshape: {cube: 600 mm}\nprint: {parts: whole}\n",
    "too-small": "name: Cube\nshape: {cube: 4 mm}\n",
    "no-room": "name: Cube\nshape: {cube: 400 mm}\nprofile: product\n",
    "copies": "name: Cube\nshape: {cube: 60 mm}\ncopies: 0\n",
    "formats": "name: Cube\nshape: {cube: 60 mm}\noutput: {formats: [step, dwg]}\n",
    "lab-key": "name: Cube\nshape: {cube: 60 mm}\noutput: {lab_key: 12}\n",
    "database": "name: Cube\nshape: {cube: 60 mm}\noutput: {database: 'redis://x'}\n",
    "version": "version: 7\nname: Cube\nshape: {cube: 60 mm}\n",
    "sensor-type": "name: Cube\nshape: {cube: 60 mm}\nsensor_type: nose\n",
    "density": "name: Cube\nshape: {cube: 60 mm}\nrobot: {density: 3 mm}\n",
    "name-of-path": "name: ../Cube\nshape: {cube: 60 mm}\n",
    "same-names": "name: Set\nobjects:\n  - {name: A, shape: {cube: 30 mm}}\n"
    "  - {name: A, shape: {cube: 40 mm}}\n",
    "no-objects": "name: Set\nobjects: []\n",
    "set-member": "name: Set\nobjects:\n  - gone.yaml\n",
    "set-mistake": "name: Set\nobjects:\n  - {name: A, shape: {cube: 30 mm}, pitch: 3}\n"
    "  - {name: B, shape: {cub: 40 mm}}\n",
    "many-mistakes": "nam: Cube\nshape: {cube: 60}\ncopies: many\nlayout: nett\n",
}  # fmt: skip


def collect(part: str) -> Iterator[tuple[str, Any]]:
    """Yield the entries of a part."""
    with started_commands() as commands:
        _provide(commands)
        times: Counter[str] = Counter()
        for line in _lines(part, commands.folder):
            entry = commands.entry(*shlex.split(line))
            lines = entry["stdout"].splitlines() if isinstance(entry["stdout"], str) else []
            if lines and all(one.startswith(("{", "[")) for one in lines):  # objects, one a line
                entry["stdout"] = [normal_value(json.loads(one), commands.folder) for one in lines]
            times[line] += 1
            again = f" #{times[line]}" if times[line] > 1 else ""
            yield f"{part}/{line}{again}", entry


def _lines(part: str, folder: Path) -> Iterator[str]:
    """Yield the commands of a part, and write the specs that they name."""
    if part == "specs":
        for name, text in SPECS.items():
            (folder / f"{name}.yaml").write_text(text)
        lines = [f"encode-object {name}.yaml --dry-run --lab-key {LAB_KEY}" for name in SPECS]
        yield from (*lines, *(f"{line} --json" for line in lines[::4]))
        return
    for line in COMMANDS[part].strip().split("\n"):
        for command in _expanded(line.removesuffix(" [twice]")):
            yield command
            if line.endswith("[twice]"):
                yield f"{command} --json"


def _expanded(line: str) -> list[str]:
    """Return a command for each of the words in braces; the line where there are none."""
    head, _, rest = line.partition("{")
    words, _, tail = rest.partition("}")
    return [head + word + tail for word in words.split(",")] if "," in words else [line]


def _provide(commands: Commands) -> None:
    """Put what commands read into their folder."""
    folder = commands.folder
    for name in ("v3", "guest"):
        packed = DATA / "databases" / f"{name}.db.gz"
        target = folder / ("lab.db" if name == "v3" else f"{name}.db")
        target.write_bytes(gzip.decompress(packed.read_bytes()))
    shutil.copy(FIXTURES / "database/v2.db", folder / "old.db")
    shutil.copy(folder / "lab.db", folder / "newer.db")
    with sqlite3.connect(folder / "newer.db") as connection:
        connection.execute("UPDATE meta SET value = '9' WHERE key = 'schema_version'")
    connection.close()
    with sqlite3.connect(folder / "foreign.db") as connection:
        connection.execute("CREATE TABLE songs (name TEXT)")
    connection.close()
    whole = (folder / "lab.db").read_bytes()
    (folder / "damaged.db").write_bytes(whole[: len(whole) // 3])
    (folder / "text.db").write_text("not a database, but long enough to be read as one\n" * 40)

    for path in (DATA / "recordings").iterdir():
        if path.suffix in {".h5", ".npz", ".csv"}:
            shutil.copy(path, folder / path.name)
    shutil.copy(FIXTURES / "recordings/touch.h5", folder / "old.h5")
    calibration = (FIXTURES / "recordings/calibration.json").read_text()
    (folder / "calibration.json").write_text(calibration)
    (folder / "bad-calibration.json").write_text(calibration[:-200])
    changed = json.loads(calibration) | {"version": 99, "format_version": 99}
    (folder / "newer-calibration.json").write_text(json.dumps(changed))

    (folder / "folder").mkdir()
    (folder / "notes.txt").write_text("no model\n")
    (folder / "broken.stl").write_bytes(b"solid broken\nfacet normal 0 0\n")
    own = commands.answer("probe-sensor", "types", "gel-24x32")
    (folder / "own-type.yaml").write_text(own)
    (folder / "bad-type.yaml").write_text(own.replace("rows:", "rowes:"))
    (folder / "cube.yaml").write_text("name: Cube\nshape: {cube: 40 mm}\n")
    (folder / "changed.yaml").write_text("name: Cube\nshape: {cube: 44 mm}\n")
    (folder / "blank.yaml").write_text("name: Slab\nshape: {box: [50, 40, 5]}\n")
    (folder / "set.yaml").write_text(
        "name: Pair\nobjects:\n  - {name: A, shape: {cube: 36 mm}, copies: 2}\n"
        "  - {name: B, shape: {prism: {sides: 3, side: 40 mm, height: 30 mm}}}\n"
    )
