"""What is installed beside the package in this Python, whether or not its environment is active."""

import importlib.util
import os
import sys
from pathlib import Path


def onnxruntime() -> Path | None:
    """The folder with the shared library of ONNX Runtime, unless ``ORT_DYLIB_PATH`` names another."""
    if os.environ.get("ORT_DYLIB_PATH"):
        return None
    spec = importlib.util.find_spec("onnxruntime")
    folders = (spec and spec.submodule_search_locations) or []
    libraries = (Path(folder, "capi") for folder in folders)
    return next(filter(Path.is_dir, libraries), None)


def programs() -> Path:
    """The folder with the programs of packages, such as the viewer ``rerun``."""
    return Path(sys.executable).parent
