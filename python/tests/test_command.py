"""The command ``divmerge`` of the package behaves as the binary does."""

import os
import signal
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

import divmerge
from conftest import ROOT
from needed import needed

SCRIPT = Path(sysconfig.get_path("scripts"), "divmerge.exe" if os.name == "nt" else "divmerge")
INSTALLED = [str(SCRIPT)]
MODULE = [sys.executable, "-m", "divmerge"]
# The folder of a checkout has a `divmerge` of its own.
ELSEWHERE = Path(sysconfig.get_path("data"))

unix = pytest.mark.skipif(os.name == "nt", reason="signals and pipes of Unix")


def run(*words, program=INSTALLED, **how):
    how = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "cwd": ELSEWHERE, **how}
    return subprocess.run([*program, *map(str, words)], **how)


def ended(done):
    return done.returncode, done.stdout, done.stderr


@pytest.fixture(scope="module")
def twins(binary):
    """Runs words by the binary, the script and the module, and returns how each ended."""

    def run_all(*words, **how):
        return [ended(run(*words, program=program, **how)) for program in ([str(binary)], INSTALLED, MODULE)]

    return run_all


@pytest.mark.parametrize("words", [["--version"], ["-h"], ["--help"], ["annotate", "--help"], ["params"]])
def test_it_prints_what_the_binary_prints(twins, words):
    binary, script, module = twins(*words)
    assert binary[0] == 0 and binary[1] and binary == script == module


def test_exit_codes_and_errors_are_the_binarys(twins, drives, tmp_path):
    whole = drives("small")
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size * 2 // 3])
    endings = {
        0: [["info", whole], ["completions", "bash"]],
        1: [["info", tmp_path / "none.mcap"], ["info", ROOT / "Cargo.toml"]],
        2: [[], ["anotate"], ["info"], ["figure", whole, "--topic", "/none", "-o", tmp_path / "x.png"]],
        3: [["info", cut]],
    }
    for code, commands in endings.items():
        for words in commands:
            binary, script, module = twins(*words)
            assert binary[0] == code, (words, binary)
            assert binary == script == module, words


def test_it_annotates_as_the_binary_does(twins, drives, tmp_path):
    endings = []
    for name, program in {"binary": None, "script": INSTALLED}.items():
        folder = tmp_path / name
        folder.mkdir()
        words = ["annotate", drives("small"), "-o", "out.mcap", "--threads", 2]
        if program is None:
            endings.append(twins(*words, cwd=folder)[0])
            continue
        endings.append(ended(run(*words, program=program, cwd=folder)))
    assert endings[0][0] == endings[1][0] == 0
    made = [(tmp_path / name / "out.mcap").read_bytes() for name in ("binary", "script")]
    assert made[0] == made[1]
    assert divmerge.topics(tmp_path / "script" / "out.mcap")


def test_words_need_not_be_unicode(twins, tmp_path):
    if sys.platform != "linux":
        pytest.skip("names of files are Unicode here")
    name = os.fsdecode(os.fsencode(tmp_path) + b"/\xff.mcap")
    Path(name).write_bytes(b"no recording")
    binary, script, module = twins("info", name)
    assert binary[0] == 1 and binary == script == module


def test_compare_starts_itself_again(drives):
    """A process for each method, also where no environment is active."""
    done = run("compare", drives("rings"), "--methods", "paper,best")
    assert done.returncode == 0, done.stderr
    assert {line.split("|")[1].strip() for line in done.stdout.decode().splitlines()[2:]} >= {"paper", "best"}


@unix
def test_nobody_reads_what_it_prints():
    for program in (INSTALLED, MODULE):
        reading, writing = os.pipe()
        os.close(reading)
        done = run("params", program=program, stdout=writing)
        os.close(writing)
        assert (done.returncode, done.stderr) == (141, b"")


@unix
def test_the_reader_of_a_recording_goes_away(drives):
    words = [*INSTALLED, "annotate", str(drives("organised")), "-o", "-"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        head = process.stdout.read(100)
        process.stdout.close()
        said = process.stderr.read()
    assert head.startswith(b"\x89MCAP0\r\n")
    assert (process.returncode, said) == (141, b"")


def started(program, *words, **how):
    pipes = {name: subprocess.PIPE for name in ("stdin", "stdout", "stderr")}
    return subprocess.Popen([*program, *words], **pipes, **{"cwd": ELSEWHERE, **how})


def interrupted(process):
    """How a process ends at Ctrl-C; its standard input stays open until then."""
    process.send_signal(signal.SIGINT)
    process.wait()
    said = process.stderr.read()
    for pipe in (process.stdin, process.stdout, process.stderr):
        pipe.close()
    return process.returncode, said


@unix
def test_ctrl_c_ends_a_run_as_it_ends_the_binarys(binary, drives, tmp_path):
    """Half a recording comes, and then nothing: the run waits."""
    whole = drives("organised").read_bytes()
    endings = []
    for name, program in {"binary": [str(binary)], "script": INSTALLED, "module": MODULE}.items():
        folder = tmp_path / name
        folder.mkdir()
        process = started(program, "annotate", "-", "-o", "out.mcap", cwd=folder)
        process.stdin.write(whole[: len(whole) // 2])
        process.stdin.flush()
        # It has begun as soon as its output is there.
        while not os.listdir(folder):
            pass
        code, said = interrupted(process)
        endings.append((code, said, os.listdir(folder)))
    assert endings[0][0] == 130 and "out.mcap" not in endings[0][2], endings
    assert endings[0] == endings[1] == endings[2]


@unix
def test_ctrl_c_ends_what_listens_to_nothing(binary):
    """A command that does not ask for Ctrl-C is ended by the signal, in the middle of what it prints."""
    for program in ([str(binary)], INSTALLED, MODULE):
        process = started(program, "completions", "fish")
        # There is more to come than a pipe holds.
        assert process.stdout.read(1)
        assert interrupted(process) == (-signal.SIGINT, b"")


@unix
def test_ctrl_c_ends_the_inspector(drives):
    process = started(INSTALLED, "inspect", "--no-open", str(drives("small")))
    assert process.stdout.readline().startswith(b"http://127.0.0.1:")
    assert interrupted(process)[0] == 0


def test_networks_run_on_the_installed_onnxruntime(drives, tmp_path):
    """Without an active environment and without a variable that names the library."""
    needed("onnxruntime")
    bare = {name: value for name, value in os.environ.items() if name not in ("VIRTUAL_ENV", "ORT_DYLIB_PATH")}
    model = ROOT / "tests" / "data" / "network" / "network.onnx"
    words = ["annotate", drives("small"), "-o", tmp_path / "out.mcap", "--runtime", "onnxruntime"]
    done = run(*words, "--semantics", f"onnx:{model}", env=bare)
    assert done.returncode == 0, done.stderr
    own = tmp_path / "own.mcap"
    program = f"import divmerge; divmerge.annotate({str(drives('small'))!r}, {str(own)!r}, semantics='onnx:{model}')"
    subprocess.run([sys.executable, "-c", program], env=bare, cwd=ELSEWHERE, check=True)
    assert own.read_bytes() == (tmp_path / "out.mcap").read_bytes()


def test_view_writes_a_stream_or_says_what_is_missing(drives, tmp_path):
    saved = tmp_path / "drive.rrd"
    done = run("view", drives("small"), "--save", saved)
    if done.returncode == 0:
        assert saved.read_bytes().startswith(b"RRF2")
    else:
        assert done.returncode == 2 and b"built without Rerun" in done.stderr, done.stderr
        assert b"--features rerun" in done.stderr and not saved.exists()
