"""The command line: what ``divmerge`` and ``python -m divmerge`` run."""

import importlib.util
import os
import signal
import sys
from pathlib import Path

from divmerge._divmerge import _main


def main() -> int:
    """Runs the words of ``sys.argv`` and returns the exit code."""
    # Python would note Ctrl-C and wait for the command to return. It ends the process, or is the command's to answer.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    _name_onnxruntime()
    _name_scripts()
    return _main([sys.executable, __file__], ["divmerge", *sys.argv[1:]])


def _name_onnxruntime() -> None:
    """The command finds the ONNX Runtime of this Python, also where no environment is active."""
    if os.environ.get("ORT_DYLIB_PATH"):
        return
    spec = importlib.util.find_spec("onnxruntime")
    for folder in (spec and spec.submodule_search_locations) or []:
        libraries = Path(folder, "capi")
        if libraries.is_dir():
            os.environ["ORT_DYLIB_PATH"] = str(libraries)


def _name_scripts() -> None:
    """The command finds the programs of this Python last, such as the viewer ``rerun``."""
    folders = [os.environ.get("PATH", os.defpath), str(Path(sys.executable).parent)]
    os.environ["PATH"] = os.pathsep.join(folders)


if __name__ == "__main__":
    sys.exit(main())
