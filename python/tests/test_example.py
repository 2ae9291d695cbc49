"""The example runs and says what it should."""

import os
import subprocess
import sys

import pytest

from conftest import ROOT
from needed import needed


def run(*arguments, **environment):
    command = [sys.executable, str(ROOT / "examples" / "panoptic.py"), *map(str, arguments)]
    done = subprocess.run(
        command, capture_output=True, text=True, env={**os.environ, **environment}
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def quality(printed):
    [line] = [line for line in printed.splitlines() if line.startswith("car ")]
    return float(line.split()[1])


def test_it_simulates_its_data():
    printed = run("--frames", 1)
    assert "scan 0: " in printed and quality(printed) > 80


def test_a_network_without_errors_finds_more(drives):
    spoiled = quality(run(drives("rings"), "--share", 0.5))
    assert spoiled < quality(run(drives("rings"), "--share", 0))


@pytest.mark.torch
def test_with_pytorch(drives):
    needed("torch")
    assert "tensors of PyTorch" in run(drives("small"))
