"""Import one module of ours from a changed text, here or in the programs that are started."""

import importlib.abc
import importlib.machinery
import importlib.util
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]


class _Changed(importlib.abc.MetaPathFinder):
    def __init__(self, module: str, source: str) -> None:
        self._name = dotted(module)
        self._path, self._source = str(ROOT / module), source

    def find_spec(self, name, path=None, target=None):
        if name != self._name:
            return None
        source, file = self._source, self._path

        class Loader(importlib.machinery.SourceFileLoader):
            def get_code(self, fullname):
                return compile(source, file, "exec", dont_inherit=True)

        return importlib.util.spec_from_file_location(name, file, loader=Loader(name, file))


def dotted(module: str) -> str:
    """Return the name of the module of a file, relative to the project."""
    return module.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def install(module: str, source: str) -> None:
    """Import the module (a file) from this text from now on."""
    sys.meta_path.insert(0, _Changed(module, source))


@contextmanager
def installed_in_programs(module: str, source: str) -> Iterator[None]:
    """Let Python programs that are started meanwhile import the module from this text."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "source").write_text(source)
        (Path(folder) / "sitecustomize.py").write_text(
            f"import sys; sys.path.append({str(HERE)!r})\n"
            f"import changed; changed.install({module!r}, open({folder + '/source'!r}).read())\n"
        )
        os.environ["PYTHONPATH"] = os.pathsep.join([folder, str(ROOT)])
        yield
