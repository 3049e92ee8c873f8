"""Fields are described by the text under them: in the schema, not at start-up."""

import subprocess
import sys


def test_settings_are_defined_without_their_source():
    program = (
        "import linecache, generator.spec.settings\n"
        "print([name for name in linecache.cache if 'generator' in name])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "[]\n", done.stderr
