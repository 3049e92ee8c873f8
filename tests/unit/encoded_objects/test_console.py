"""A command's process: what its start leaves out, and how it ends."""

import json
import subprocess
import sys

PROGRAM = """
import gc, json, os, sys
from encoded_objects.base import console

class Cycle:
    def __init__(self): self.own = self
    def __del__(self): print("walked")

def act():
    state = [gc.get_threshold()[0], os.environ["PYDANTIC_DISABLE_PLUGINS"]]
    print(json.dumps(state))
    Cycle()
    return 3

app = console.application()
app.command()(lambda: act)
console.main("do", lambda _: app, [], bare=True)
"""


def process(program, **environment):
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True,
        env={"PATH": "", "PYTHONPATH": ":".join(sys.path), **environment},
    )  # fmt: skip
    assert done.stderr == ""
    return done


def test_a_command_does_not_walk_through_what_stays():
    done = process(PROGRAM)
    assert done.returncode == 3
    threshold, plugins = json.loads(done.stdout)  # the cycle is left to the end of the process
    assert threshold > 10_000
    assert plugins == "__all__"


def test_plugins_that_somebody_asks_for_are_left():
    done = process(PROGRAM, PYDANTIC_DISABLE_PLUGINS="one")
    assert json.loads(done.stdout)[1] == "one"
