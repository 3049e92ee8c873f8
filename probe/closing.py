"""What holds something until it is closed, and is closed at the end of a `with`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Self


class Closing(ABC):
    """`with` closes it, however the block ends."""

    @abstractmethod
    def close(self) -> None:
        """Give back what is held; once more does nothing."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
