"""The command line: what ``divmerge`` and ``python -m divmerge`` run."""

import os
import signal
import sys

from divmerge import _environment
from divmerge._divmerge import _main


def main() -> int:
    """Runs the words of ``sys.argv`` and returns the exit code."""
    # Python would note Ctrl-C and wait for the command to return. It ends the process, or is the
    # command's to answer.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    libraries = _environment.onnxruntime()
    if libraries:
        os.environ["ORT_DYLIB_PATH"] = str(libraries)
    # Searched last.
    folders = [os.environ.get("PATH", os.defpath), str(_environment.programs())]
    os.environ["PATH"] = os.pathsep.join(folders)
    return _main([sys.executable, __file__], ["divmerge", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
