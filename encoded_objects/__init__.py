"""The front door of encoded objects: about a dozen names over the four packages.

Under it stand the two things that all packages share and that may import none of them: the
root of the errors (`encoded_objects.errors`) and how a command starts, shows progress and ends
(`encoded_objects.console`).
"""

from __future__ import annotations

__version__ = "0.1.0"
