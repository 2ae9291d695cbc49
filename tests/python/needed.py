"""What tests need beside the project."""

import importlib
import os

import pytest


def skip_or_fail(lack: str):
    """Skips a test that lacks a tool; where CI=true, fails it."""
    if os.environ.get("CI") == "true":
        pytest.fail(f"{lack} (CI=true, so that nothing may be skipped)", pytrace=False)
    pytest.skip(lack, allow_module_level=True)


def needed(module: str):
    """A module, if it is installed; else the test is skipped or fails."""
    try:
        return importlib.import_module(module)
    except ImportError:
        skip_or_fail(f"no {module}: pip install it")
