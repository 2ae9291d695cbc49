"""The bar of ``progress=True``."""

from importlib import import_module
from typing import Any


class Bar:
    """Called with the bytes read and the bytes in all (0 of a stream), as any ``progress`` is."""

    def __init__(self, name: str) -> None:
        try:
            tqdm = import_module("tqdm.auto").tqdm
        except ImportError as error:
            raise ImportError("progress=True needs tqdm: pip install tqdm, or pass a function") from error
        self.bar: Any = tqdm(desc=name, unit="B", unit_scale=True)

    def __call__(self, done: int, total: int) -> None:
        self.bar.total = total or None
        self.bar.update(done - self.bar.n)

    def close(self) -> None:
        """Leaves the bar as it is."""
        self.bar.close()
