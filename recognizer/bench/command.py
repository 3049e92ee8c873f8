"""`open-bench`: serve the page, here by default.

Exit codes: 0 ended by the operator, 2 bad input, 3 device, 4 database. Nothing heavy is
imported before it is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn

from encoded_objects.base import console
from encoded_objects.base.errors import require
from encoded_objects.base.options import Application, command
from recognizer.bench.options import BenchOptions

HELP = """See the part, the touch and the answer in a web page.

Try it without a probe: [bold]open-bench --database lab.db[/], open the page, click on the part.
"""
EPILOG = "Exit codes: 0 ended, 2 bad input, 3 device, 4 database."

app = Application()


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run `open-bench` and leave with its exit code."""
    console.one_thread()
    console.main("open-bench", lambda _arguments: app, arguments, bare=True)


@command(app, help=HELP, epilog=EPILOG)
def bench(options: BenchOptions) -> int:
    """Serve the bench."""
    require("fastapi", "uvicorn", "websockets", extra="bench", purpose="open-bench")
    from recognizer.bench.serve import serve

    return serve(options)


if __name__ == "__main__":
    main()
